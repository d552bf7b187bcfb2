"""What is shown beside a scene is read as it was written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
import torch

from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.light_file import write_lights
from rgspipe.demo import TARGET
from rgspipe.errors import InputError
from rgspipe.scene import PointLight, SpotLight
from rgspipe.stages.lights.capture import found_capture
from rgspipe.viewer.drawings import ways
from rgspipe.viewer.material import Case, case_in, found_in

RIG = (PointLight([0.1, 0.2, 0.3], 1.0), SpotLight.shaped("smoothstep", 0.4, 0.1))


def write_fit(folder: Path, steps: int) -> None:
    light = {"type": "point", "position": [0.5, 0.2, 0.3], "intensity": [1.0, 1.0, 1.0]}
    others = [{"lights": [light], "told": "2 times the cost.", "ruled_out": True}]
    told = {
        "result": "converged",
        "reason": "It is.",
        "seconds": 2.0,
        "costs": {"1": 2.0, "2": 1.0},
        "alternatives": others,
    }
    write_lights(folder / "lights.json", RIG, told)
    rows = []
    for step in range(steps):
        moved = [light.at(light.position + 0.1 * step) for light in RIG]
        second = {f"{name}_1": value for name, value in moved[1].columns().items()}
        rows.append({"step": step, "loss": 1.0} | moved[0].columns() | second)
    pd.DataFrame(rows).to_csv(folder / "convergence.csv", index=False)


def test_a_fit_is_read_with_its_way(tmp_path: Path) -> None:
    write_fit(tmp_path, 4)
    found = found_in(tmp_path)
    assert [light.kind for light in found.lights] == ["point", "spot"]
    assert found.told.startswith("2 lights, converged in 2 s\n  point at (") and found.told.endswith("\nIt is.")
    assert found.costs == {1: 2.0, 2: 1.0} and found.covariance == ()
    assert [(one.told, one.ruled_out, len(one.lights)) for one in found.alternatives] == [
        ("2 times the cost.", True, 1)
    ]
    first, second = ways(found.path)
    torch.testing.assert_close(torch.from_numpy(first)[:, 0], 0.1 + 0.1 * torch.arange(4).double())
    torch.testing.assert_close(torch.from_numpy(second)[:, 2], 0.1 * torch.arange(4).double())


@pytest.mark.parametrize("result", ["ambiguous", "converged"])
def test_why_a_fit_is_not_sure_is_read(tmp_path: Path, result: str) -> None:
    write_lights(tmp_path / "lights.json", RIG, {"result": result, "reason": "By two rivals.", "seconds": 1.0})
    doubt = "The fit that found these lights is ambiguous: By two rivals."
    assert found_in(tmp_path).doubt == (doubt if result == "ambiguous" else "")


def test_what_a_fit_found_of_exposures_and_of_the_lamps_off_is_read(tmp_path: Path) -> None:
    told = {"exposures": [1.0, 2.0], "base_scale": {"factor": [0.5, 0.5, 0.25]}}
    told |= {"ambient": {"radiance": [0.1, 0.2, 0.3]}}
    write_lights(tmp_path / "lights.json", RIG, told)
    found = found_in(tmp_path)
    assert found.exposures == (1.0, 2.0) and found.base_scale.tolist() == [0.5, 0.5, 0.25]
    assert found.ambient.tolist() == [0.1, 0.2, 0.3]
    assert found.unknowns == {"exposure_free": True, "base_scale_free": True, "ambient": True}
    write_fit(tmp_path, 1)
    assert not any(found_in(tmp_path).unknowns.values())


def test_a_target_in_a_folder_is_clipped_where_its_images_are(monkeypatch: pytest.MonkeyPatch) -> None:
    target = load_target(TARGET)
    read = replace(target, views=tuple(replace(view, saturated_from=0.2 + k) for k, view in enumerate(target.views)))
    monkeypatch.setattr("rgspipe.viewer.material.load_target", lambda folder: read)
    for one, view in zip(case_in(TARGET, None, found_capture).photographs, read.views, strict=True):
        assert one.clip == view.saturated_from and torch.equal(one.mask, view.alpha)
    # Without that, what is saturated is left out.
    assert not case_in(TARGET).photographs[0].mask[(read.views[0].image >= 0.2).any(dim=-1)].any()


def test_images_with_the_lamps_off_come_with_their_photographs() -> None:
    target = load_target(TARGET)
    off = [replace(view, base=0.5 * view.image, saturated_from=0.2) for view in target.views]
    photographs = Case.of(replace(target, views=tuple(off))).photographs
    for view, one in zip(off, photographs, strict=True):
        assert one.base is view.base
        # What is saturated with the lamps off tells nothing of them.
        assert not one.mask[(view.base >= 0.2).any(dim=-1)].any()
    case = Case.of(replace(target, views=(off[0], *target.views[1:])))
    assert not case.photographs and "only some of the photographs" in case.lacking


@pytest.mark.parametrize("change", ["gone", "fewer lights", "not finite"])
def test_a_way_that_cannot_be_read_is_left_out(tmp_path: Path, change: str) -> None:
    write_fit(tmp_path, 3)
    table = tmp_path / "convergence.csv"
    steps = pd.read_csv(table)
    table.unlink()
    if change == "fewer lights":
        steps[[name for name in steps if not name.endswith("_1")]].to_csv(table, index=False)
    elif change == "not finite":
        steps.assign(x=float("nan")).to_csv(table, index=False)
    assert found_in(tmp_path).path == () and ways(()) == []


def test_the_target_of_the_demo_is_whole() -> None:
    case = case_in(TARGET)
    assert len(case.photographs) == 3 and len(case.truth) == 1
    for photograph in case.photographs:
        assert photograph.image.shape == (128, 128, 3) and photograph.lights is None
        # The lamp is out of sight of all of them.
        (x, y), depth = photograph.camera.project(case.truth[0].position)
        assert depth > 0 and 0 < x < 128 and 0 < y < 128


def test_the_folder_of_all_fits_is_told_from_that_of_one(tmp_path: Path) -> None:
    write_lights(tmp_path / "kitchen" / "lights.json", PointLight([0.0, 0.0, 0.5], 1.0))
    with pytest.raises(InputError, match=r"found fits of kitchen\. Name one of them: .*kitchen"):
        found_in(tmp_path)
    with pytest.raises(InputError, match=r"lights\.json: expected a light file, found no such file"):
        found_in(tmp_path / "nowhere")
