"""What the command line says of lights that were found."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
import torch

from fitted_lights import make_fitted
from frozen_store import artifact
from rgspipe.cli.cells import percent
from rgspipe.cli.columns import columns, without_empty
from rgspipe.cli.outcome import outcome
from rgspipe.datasets.light_file import write_lights
from rgspipe.evaluation.summary import summary_table
from rgspipe.evaluation.tables import target_table
from rgspipe.fitting.findings import FitStatus
from rgspipe.fitting.words import MEANINGS
from rgspipe.scene import LightRig, PointLight, SpotLight
from rgspipe.store.artifacts import Artifact
from rgspipe.store.files import write_json


def _vector(*values: float) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float64)


POINT = PointLight(_vector(0.1, 0.2, 0.3), _vector(1.0, 2.0, 3.0))
SPOT = SpotLight(_vector(0.5, 0.5, 0.5), _vector(4.0, 4.0, 4.0), _vector(0.0, 0.0, -1.0), "gaussian", 0.5236, 0.1)
AT_BOUND = MEANINGS[FitStatus.AT_BOUND]


def _fits(
    tmp_path: Path,
    count: int,
    rig: LightRig = (POINT, SPOT),
    exposures: tuple[float, ...] = (),
    advice: str = "",
    **more: object,
) -> Artifact:
    def make(folder: Path) -> None:
        rows = []
        for index in range(count):
            name, status = f"rig_{index}", FitStatus.AT_BOUND if index else FitStatus.CONVERGED
            told = {"result": str(status), "reason": MEANINGS[status], "seconds": 0.5 + index, "psnr": 36.04}
            told["exposures"] = list(exposures)
            spread = [{"covariance": torch.diag(torch.full((6,), value)).tolist()} for value in (1e-4, 4e-4)]
            write_lights(folder / name / "lights.json", rig, told | {"lights": spread[: len(rig)]} | more)
            if advice:
                write_json(folder / name / "advice.json", {"words": advice})
            rows.append({"target": name, "occlusion": "occluded"} | told)
        pd.DataFrame(rows).to_csv(folder / "results.csv", index=False)

    return artifact(tmp_path, "fit_light", make)


def test_few_targets_show_their_lights_with_deviations_and_what_is_wrong(tmp_path: Path) -> None:
    lines = outcome(_fits(tmp_path, 2))
    assert lines[0] == "rig_0 (occluded): converged in 0.50 s, PSNR 36.0 dB"
    assert lines[1] == "  point at (0.100, 0.200, 0.300) ± 0.0100, RGB (1.000, 2.000, 3.000) W/sr ± 0.010"
    assert "spot at (0.500, 0.500, 0.500) ± 0.0200, axis (0.000, 0.000, -1.000), cone angle 30.0°" in lines[2]
    assert "stopped at the bound after 1.50 s" in lines[3] and f"  {AT_BOUND}" in lines
    assert lines.count(f"  {AT_BOUND}") == 1 and "lights.json" in lines[-1]


def test_a_fit_tells_the_exposures_and_the_advice_that_it_was_asked_for(tmp_path: Path) -> None:
    lines = outcome(_fits(tmp_path / "asked", 1, exposures=(1.0 - 2e-16, 1.25, 0.5), advice="r_1 would help most."))
    assert lines[-3:-1] == [
        "  exposures of the views over the first one's: 1.000, 1.250, 0.500",
        "  further views: r_1 would help most.",
    ]
    known = outcome(_fits(tmp_path / "known", 1, exposures=(1.0, 1.0)))
    assert len(known) == len(lines) - 2 and "over the first" not in "".join(known)


def test_a_fit_tells_the_other_light_that_it_was_asked_for(tmp_path: Path) -> None:
    """Only `lights.json` said it."""
    known, open_ = torch.diag(_vector(1e-4, 1e-4, 1e-4)).tolist(), [["inf", 0, 0], [0, "inf", 0], [0, 0, "inf"]]
    other = {
        "ambient": {"radiance": [3.0, 2.0, 1.0], "covariance": known, "share": 0.55},
        "base_scale": {"factor": [1.5, 1.5, 1.5], "covariance": open_, "share": 0.2},
    }
    lines = outcome(_fits(tmp_path, 1, **other))
    assert lines[3:-1] == [
        "  ambient RGB (3.000, 2.000, 1.000) ± 0.010 W/(sr·unit²), 55 % of the light",
        "  lamps off RGB (1.500, 1.500, 1.500) ± unknown times, 20 % of the light",
    ]


def test_a_fit_in_a_scene_that_was_scaled_says_where_lamps_are_in_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lamp of a .blend was told at (0.332, 0.281, 0.014) alone, and not where it is in the file."""
    info = tmp_path / "dataset_info.json"
    monkeypatch.setattr("rgspipe.cli.outcome.origin_of", lambda path: info)
    write_json(info, {"version": 1, "rescale": 0.25, "offset": [-2.0, -1.5, -1.25]})
    fits = _fits(tmp_path, 1)
    assert outcome(fits)[3] == (
        "  in the scene's own file (1 here is 4 there): (2.4, 2.3, 2.45), (4, 3.5, 3.25); stage=export brings lamps "
        "there"
    )
    write_json(info, {"version": 1, "rescale": 1.0, "offset": [0, 0, 0]})
    assert not any("own file" in line for line in outcome(fits))


def test_many_targets_are_a_row_a_class(tmp_path: Path) -> None:
    lines = outcome(_fits(tmp_path, 6, (POINT,)))
    assert len(lines) == 3 and lines[0].split() == ["targets", "converged", "PSNR", "time"]
    assert lines[1].split() == ["occluded", "6", "1", "36.0", "dB", "3.00", "s", "(worst", "5.50", "s)"]


def test_an_evaluation_is_a_table_per_class_or_a_line_per_target(tmp_path: Path) -> None:
    targets, _ = make_fitted(views=1)

    def make(folder: Path, rows: pd.DataFrame) -> None:
        rows.to_csv(folder / "metrics.csv", index=False)
        summary_table(rows, seed=0, resamples=10).to_csv(folder / "summary.csv", index=False)
        write_json(folder / "metrics.json", {"sought": {"number": False, "types": False}})

    many = outcome(artifact(tmp_path / "many", "evaluate", lambda folder: make(folder, targets)))
    assert [line.split()[0] for line in many[1:5]] == ["visible", "out", "occluded", "all"]
    assert "axis" not in many[0] and "summary.csv" in many[-1]
    median = 100.0 * targets["position_error"].median()
    assert f"{median:.2f} %" in many[4]
    few = outcome(artifact(tmp_path / "few", "evaluate", lambda folder: make(folder, targets.head(2))))
    assert [line.split()[0] for line in few[1:3]] == ["visible_000", "visible_001"]
    assert max(map(len, few[:-1])) <= 80 and not any(" visible " in line for line in few)
    other = targets.head(2).assign(target=["kitchen", "hall"])
    named = outcome(artifact(tmp_path / "named", "evaluate", lambda folder: make(folder, other)))
    assert [line.split()[:2] for line in named[1:3]] == [["kitchen", "visible"], ["hall", "visible"]]
    assert f"{100.0 * targets['position_error'][1]:.2f} %" in few[2] and few[2].endswith("converged")
    alone = outcome(artifact(tmp_path / "alone", "evaluate", lambda folder: make(folder, pd.concat([targets[:3]] * 2))))
    assert [line.split()[0] for line in alone[1:-1]] == ["visible"]


def _sought(tmp_path: Path, types: bool, many: bool) -> list[str]:
    """What is said of a point taken for a spot, one light of two, and others that are right."""
    names = [f"rig_{index}" for index in range(6 if many else 3)]
    results = pd.DataFrame({"target": names, "occlusion": "visible", "method": "search_lm", "views": 1, "seconds": 1.0})
    found = dict.fromkeys(names, (POINT, SPOT)) | {"rig_0": (POINT, replace_type(SPOT)), "rig_1": (POINT,)}
    rows = target_table(results.assign(result="converged"), found, dict.fromkeys(names, (POINT, SPOT)), 1.0)

    def make(folder: Path) -> None:
        rows.to_csv(folder / "metrics.csv", index=False)
        summary_table(rows, seed=0, resamples=10).to_csv(folder / "summary.csv", index=False)
        write_json(folder / "metrics.json", {"sought": {"number": types, "types": types}})

    return outcome(artifact(tmp_path, "evaluate", make))


def replace_type(light: SpotLight) -> PointLight:
    return PointLight(light.position, light.intensity)


def test_an_evaluation_says_what_number_and_types_are_wrong(tmp_path: Path) -> None:
    few = _sought(tmp_path / "few", types=True, many=False)
    assert "lights" in few[0] and "types" in few[0]
    assert "wrong" in few[1] and "there" not in few[1]
    assert "1 found, 2 there" in few[2] and "wrong" not in few[2]
    assert "wrong" not in few[3] and "there" not in few[3]


def test_shares_of_right_numbers_and_types_are_said_where_they_were_sought(tmp_path: Path) -> None:
    sought = _sought(tmp_path / "sought", types=True, many=True)
    assert "right number  right types" in sought[0] and "83 %" in sought[1] and "67 %" in sought[1]
    told = _sought(tmp_path / "told", types=False, many=True)
    assert "right" not in told[0] and "67 %" not in told[1]


def test_a_track_says_how_frames_were_found_and_how_far_off_each_light_is(tmp_path: Path) -> None:
    rows = [
        {"frame": frame, "target": f"rig_{frame}", "status": status, "seconds": 0.2 + frame, "light": light}
        | {"position_error": 0.01 * (1 + light + frame), "intensity_error": 0.1, "axis_error": 0.5}
        for frame, status in enumerate(("searched", "tracked", "uncertain"))
        for light in range(2)
    ]

    def make(folder: Path) -> None:
        pd.DataFrame(rows).to_csv(folder / "track.csv", index=False)

    lines = outcome(artifact(tmp_path, "track", make))
    assert lines[0] == "3 frames: 1 searched, 1 tracked, 1 uncertain; 1.20 s (worst 2.20 s) a frame"
    # The uncertain frame is no part of the errors.
    assert lines[2].split() == ["light", "1", "2", "1.50", "%", "2.00", "%", "10.00", "%", "0.50°"]
    assert lines[3].split()[4:7] == ["%", "3.00", "%"] and "track.png" in lines[-1]


def test_columns_align_and_leave_out_what_nobody_fills() -> None:
    rows = without_empty([["", "size", "empty", "word"], ["a", "10", "", "x"], ["bb", "9", "", "yes"]])
    assert columns(rows) == ["      size  word", "  a     10  x", "  bb     9  yes"]
    assert percent(float("inf")) == "unbounded" and percent(float("nan")) == ""
