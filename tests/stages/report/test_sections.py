"""What a report shows of generated targets, courses of fits and tracks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch

from frozen_store import RESOLUTION, write_targets
from lit_room import room_surfels
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.evaluation import images
from rgspipe.pages.html import render
from rgspipe.pages.section import shown_sections
from rgspipe.scene import LightRig, PointLight, SpotLight
from rgspipe.stages.report import sections
from rgspipe.stages.report.sections import found_galleries, found_sections, section_files
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key

PNG = images.png_bytes(np.random.default_rng(0).integers(0, 255, (8, 8, 3), dtype=np.uint8))


def _vector(*values: float) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float64)


RIG: LightRig = (
    PointLight(_vector(0.1, 0.2, 0.3), torch.ones(3).double()),
    SpotLight(_vector(-0.2, 0.0, 0.3), torch.ones(3).double(), _vector(0.0, 0.0, -1.0), "gaussian", 0.5, 0.1),
)


@pytest.fixture(autouse=True)
def days(monkeypatch: pytest.MonkeyPatch) -> None:
    """Artifacts that are made one after the other within a second are made in the order of their names."""
    monkeypatch.setattr(sections, "_made", lambda found: found.fingerprint)


def config(root: Path) -> RgspipeConfig:
    return with_changes(RgspipeConfig(), {"stage": "report", "scene.name": "room", "outputs": str(root)})


def build(
    root: Path,
    stage: str,
    fingerprint: str,
    make: Callable[[Path], None],
    count: Sequence[int] = (2, 2),
    **facts: object,
) -> Artifact:
    def whole(folder: Path) -> dict:
        make(folder)
        return facts

    settings = {"targets.count": list(count), "study": {"methods": ["paper_adam"]}}
    recipe = {"config": settings, "inputs": {"freeze": ["f1"]}, "code": {}}
    return ArtifactStore(root).build(Key("room", stage, fingerprint), recipe, whole)[0]


def _targets(folder: Path, count: int, rig: LightRig = RIG) -> None:
    views = [torch.rand(RESOLUTION, RESOLUTION, 3, generator=torch.Generator().manual_seed(k)) for k in range(2)]
    names = [f"rig_{index:04d}" for index in range(count)]
    write_targets(folder, dict.fromkeys(names, views), dict.fromkeys(names, rig))
    listed = (folder / "targets" / "targets.json").read_text().replace("visible", "unknown")
    (folder / "targets" / "targets.json").write_text(listed)


def _courses(folder: Path) -> None:
    row = {"target": "visible_000", "occlusion": "visible", "method": "paper_adam", "steps": 1250, "seconds": 31.5}
    row |= {"position_error_start": 0.5, "position_error_end": 0.012, "seconds_to_limit": float("nan")}
    row |= {f"{name}_{end}": 0.25 for name in ("intensity_error", "image_error") for end in ("start", "end")}
    pd.DataFrame([{"kind": "courses", "scene": "room"} | row]).to_csv(folder / "study.csv", index=False)
    (folder / "pictures").mkdir()
    (folder / "pictures" / "visible_000.png").write_bytes(PNG)


def _track(folder: Path, truth: bool = True) -> None:
    statuses = ("tracked", "tracked", "tracked", "uncertain")
    found = [
        {"frame": k, "target": f"rig_{k}", "status": status, "seconds": 0.25, "light": 0}
        for k, status in enumerate(statuses)
    ]
    errors = {"position_error": [0.01, 0.02, 0.09, 0.5], "intensity_error": 0.05, "axis_error": 0.5} if truth else {}
    pd.DataFrame(found).assign(**errors).to_csv(folder / "track.csv", index=False)
    (folder / "track.png").write_bytes(PNG)


def test_generated_targets_are_numbered_on_the_plan_and_beside_it(tmp_path: Path) -> None:
    build(tmp_path, "generate_targets", "01", lambda folder: _targets(folder, 2), kind="mixed")
    build(tmp_path, "generate_targets", "02", lambda folder: _targets(folder, 6), kind="mixed")
    (section,) = found_galleries(config(tmp_path), room_surfels())
    assert section.title == "Points and spots, 2 a target" and section.words[0].startswith("6 targets, each seen by 2")
    assert len(section.shots) == sections.SHOWN and len(section.drawings) == 1
    assert section.shots[0].caption.startswith("1 · rig_0000, mixed: light at (0.10, 0.20, 0.30)")
    assert "spot at (−0.20, 0.00, 0.30)" in section.shots[0].caption
    assert found_galleries(config(tmp_path), None) == []
    assert [path.parent.name for path in section_files(config(tmp_path))] == ["02"]


def test_lights_of_large_rigs_are_counted_instead_of_listed(tmp_path: Path) -> None:
    rig = (*RIG, *RIG, RIG[0])
    build(tmp_path, "generate_targets", "01", lambda folder: _targets(folder, 1, rig), kind="mixed")
    (section,) = found_galleries(config(tmp_path), room_surfels())
    assert section.shots[0].caption == "1 · rig_0000, mixed: 3 point lights and 2 spots"


def test_generated_targets_are_in_the_order_of_kinds_and_numbers_of_lights(tmp_path: Path) -> None:
    for fingerprint, kind, count in (("01", "drive", 2), ("02", "spots", 1), ("03", "points", 2), ("04", "points", 1)):
        make = partial(_targets, count=1, rig=RIG[:1] * count)
        build(tmp_path, "generate_targets", fingerprint, make, count=[count, count], kind=kind)
    titles = [section.title for section in found_galleries(config(tmp_path), room_surfels())]
    assert titles == [
        "Point lights, 1 a target",
        "Point lights, 2 a target",
        "Spots, 1 a target",
        "Headlights of a car that drives around the bend, 2 a target",
    ]


def test_courses_and_tracks_are_shown_with_what_was_measured(tmp_path: Path) -> None:
    build(tmp_path, "study", "01", _courses, kind="courses")
    build(tmp_path, "track", "01", _track)
    courses, track = found_sections(config(tmp_path), None)
    assert courses.rows == [
        ["visible_000", "visible", "paper_adam", "1250", "31.50", "—", "50.00 → 1.20"] + ["25.00 → 25.00"] * 2
    ]
    assert track.words == ["4 frames: 3 tracked, 1 uncertain; 0.25 s a frame (worst 0.25 s)."]
    # The uncertain frame is no part of the errors.
    assert track.rows == [["light 1", "3", "2.00 %", "9.00 %", "5.00 %", "0.50"]]
    assert "another frozen scene" in courses.remark and "another frozen scene" in track.remark
    assert len(section_files(config(tmp_path))) == 2
    page = render("sections.html", sections=shown_sections([courses, track]))
    assert page.count("<img") == 2 and page.count("data:image/png;base64,") == 2
    assert '<td class="text">paper_adam</td>' in page and "<td>1250</td>" in page


def test_a_track_without_truth_has_no_errors_and_nothing_made_shows_nothing(tmp_path: Path) -> None:
    assert found_sections(config(tmp_path), None) == [] and section_files(config(tmp_path)) == []
    made = build(tmp_path, "track", "01", lambda folder: _track(folder, truth=False))
    freeze = Artifact(made.path, {"fingerprint": "f1"})
    (track,) = found_sections(config(tmp_path), freeze)
    assert track.rows == [] and track.remark == ""
