"""What a run leads on to: every stage, by what its configuration and result say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import rgspipe
from frozen_store import artifact
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.fitting.findings import Finding, LightMissing, LightSpare
from rgspipe.stages import NAMES
from rgspipe.stages.following import FOLLOWING, Following, following
from rgspipe.store.artifacts import Artifact
from rgspipe.store.files import write_json, write_text

#: A file of each stage that is led on to a file.
FILES = ("track.png", "sheet.png", "study.png", "accuracy.md", "surfels.ply", "report.html", "overview.html")


def _led(
    tmp_path: Path, stage: str, result: str = "converged", finding: str = "on_surface", **changes: object
) -> Following:
    """What follows a stage one of whose fits ended with `result`; `changes` by key, with __ for the dot."""

    def make(folder: Path) -> None:
        write_text(folder / "results.csv", "target\na\nb\n")
        for name, found in (("a", []), ("b", [{"finding": finding}])):
            told = {"result": result if found else "converged", "findings": found}
            write_json(folder / name / "lights.json", told)
        for name in FILES:
            write_text(folder / name, "")

    made: Artifact = artifact(tmp_path, stage, make)
    named = {key.replace("__", "."): value for key, value in changes.items()}
    return following(with_changes(RgspipeConfig(stage=stage), named), made)


@pytest.mark.parametrize("stage", NAMES)
def test_every_stage_leads_to_another_one_or_to_a_file_that_it_makes(stage: str, tmp_path: Path) -> None:
    found = _led(tmp_path, stage)
    assert (found.stage in (*NAMES, "view")) != bool(found.file)
    assert found.stage != stage
    sources = (path for path in Path(rgspipe.__file__).parent.rglob("*.py") if path.stem != "following")
    assert not found.file or any(found.file in path.read_text() for path in sources)


def test_no_stage_is_told_of_that_there_is_none() -> None:
    assert FOLLOWING.keys() == set(NAMES)


def test_a_stage_of_elsewhere_leads_nowhere(tmp_path: Path) -> None:
    assert _led(tmp_path, "sow") is None


@pytest.mark.parametrize(
    ("stage", "changes", "result", "next_stage"),
    [
        ("generate_dataset", {}, "", "train_surfels"),
        ("generate_dataset", {"scene__lamps": "unknown"}, "", "capture_surfels"),
        ("freeze", {}, "", "evaluate"),
        ("freeze", {"scene__kind": "blend", "scene__path": "a.blend", "dataset__targets_per_class": 0}, "", "view"),
        ("freeze", {"fit__target": "evening"}, "", "fit_light"),
        ("freeze", {"scene__kind": "ply", "scene__path": "a.ply"}, "", "view"),
        ("fit_light", {}, "ambiguous", "evaluate"),
        ("fit_light", {"fit__target": "evening"}, "converged", "view"),
        ("fit_light", {"fit__target": "evening"}, "ambiguous", "fit_light"),
        ("fit_light", {"fit__target": "evening", "fit__suggest_view": True}, "ambiguous", "view"),
        ("fit_light", {"fit__target": "evening", "fit__truth": "true.json"}, "converged", "evaluate"),
        ("generate_targets", {"targets__kind": "drive"}, "", "track"),
    ],
)
def test_what_follows_is_what_there_is_to_do(
    stage: str, changes: dict[str, object], result: str, next_stage: str, tmp_path: Path
) -> None:
    assert _led(tmp_path, stage, result, **changes).stage == next_stage


@pytest.mark.parametrize("finding", [LightSpare(1, 2, 0.1, 0.5, decided_by=()), LightMissing(1, 0.9, decided_by=())])
def test_a_number_that_is_doubted_is_to_be_found(finding: Finding, tmp_path: Path) -> None:
    status, name = str(finding.status), finding.data()["finding"]
    given, open_ = ({"fit__target": "evening", "light__count": count} for count in (2, None))
    assert _led(tmp_path, "fit_light", status, name, **given).changes == {"light.count": None}
    assert _led(tmp_path, "fit_light", status, name, **open_).changes != {"light.count": None}


def test_a_scene_from_disk_is_asked_for_its_targets_and_their_truth(tmp_path: Path) -> None:
    disk = {"scene__kind": "external", "scene__path": str(tmp_path / "own")}
    (tmp_path / "own").mkdir()
    assert _led(tmp_path, "freeze", **disk).stage == "view"
    (tmp_path / "own" / "targets").mkdir()
    assert _led(tmp_path, "freeze", **disk).stage == "fit_light"
    (tmp_path / "own" / "truth").mkdir()
    assert _led(tmp_path, "freeze", **disk).stage == "evaluate"


def test_a_capture_leads_to_its_lamps(tmp_path: Path) -> None:
    scan = {"scene__kind": "rgbd", "scene__path": "scan", "scene__lamps": "unknown"}
    captured, frozen = (_led(tmp_path, stage, **scan) for stage in ("capture_surfels", "freeze"))
    assert captured.stage == frozen.stage == "view"
    assert "see its lamps" in captured.purpose and "see" not in frozen.purpose


def test_without_a_picture_the_folder_is_looked_at(tmp_path: Path) -> None:
    made = artifact(tmp_path, "relight", lambda folder: write_text(folder / "relight.csv", ""))
    assert following(RgspipeConfig(stage="relight"), made) == Following("look at")


def test_true_surfaces_are_looked_at_with_the_setting_that_has_them_frozen(tmp_path: Path) -> None:
    assert _led(tmp_path, "true_surfels").changes == {"freeze.surfels": "truth"}


def test_purposes_are_said_before_a_colon(tmp_path: Path) -> None:
    for stage in NAMES:
        assert re.fullmatch(r"[a-z].*[a-z]", _led(tmp_path, stage).purpose)
