"""Tracks are read and given frame by frame."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from moving_lamp import NAMES, PLACES, followed_lamp
from rgspipe.datasets.light_file import write_lights
from rgspipe.errors import InputError
from rgspipe.fitting.result import dark_result
from rgspipe.fitting.tracking.frame import FrameStatus, TrackedFrame
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.scene.lights import SunLight
from rgspipe.viewer.drawings import ways
from rgspipe.viewer.material import Case
from rgspipe.viewer.serve import view
from rgspipe.viewer.tracks import followed, found_or_followed

pytest.importorskip("viser")

from viewer.visiting import press, visited, wait_for

RIGS = [(PointLight([0.1 * index, 0.2, 0.3], 1.0),) for index in range(11)]


def test_the_folder_of_a_track_is_read_in_the_order_of_its_frames(tmp_path: Path) -> None:
    (tmp_path / "frames").mkdir()
    for index, rig in enumerate(RIGS):
        write_lights(tmp_path / "frames" / f"frame_{index}.json", rig, {"status": "traced_back"})
    write_lights(tmp_path / "frames" / "frame_11.json", (), {"status": "lost"})
    found = found_or_followed(tmp_path)
    assert found.path == (*RIGS, ()) and found.lights == RIGS[-1] and found.step == 10
    assert found.frames[2] == "frame_2: traced back" and found.frames[11] == "frame_11: lost"
    assert len(ways(found.path)[0]) == 11
    assert found.told == "12 frames: 11 traced back, 1 lost."


def test_frames_that_were_followed_are_shown(tmp_path: Path) -> None:
    frames = [TrackedFrame(replace(dark_result(1.0), lights=rig), FrameStatus.TRACKED, 0.1) for rig in RIGS]
    found = followed(frames)
    assert found.path == tuple(RIGS) and found.step == 10 and found.frames[0] == "frame 0: tracked"
    [way] = ways(found.path)
    assert way[:, 0] == pytest.approx([0.1 * index for index in range(11)])


def test_a_folder_of_fits_is_read_as_before(tmp_path: Path) -> None:
    write_lights(tmp_path / "lights.json", RIGS[3])
    assert found_or_followed(tmp_path).lights == RIGS[3] and found_or_followed(tmp_path).frames == ()
    (tmp_path / "frames").mkdir()
    with pytest.raises(InputError, match="light files, one a frame"):
        found_or_followed(tmp_path)


def test_what_is_neither_a_fit_nor_a_track_is_refused_by_its_folder(tmp_path: Path) -> None:
    """It was a light file in it that was missing, whose path was to be checked."""
    with pytest.raises(
        InputError, match=rf"{tmp_path}: expected the folder of a target's fit, .* found neither\. Name"
    ):
        found_or_followed(tmp_path)
    with pytest.raises(InputError, match=r"nowhere: expected the folder of a target's fit, .* found no such folder"):
        found_or_followed(tmp_path / "nowhere")
    (tmp_path / "rig_0000").mkdir()
    write_lights(tmp_path / "rig_0000/lights.json", RIGS[3])
    with pytest.raises(InputError, match="found fits of rig_0000"):
        found_or_followed(tmp_path)


def test_suns_have_no_place_on_the_way() -> None:
    """They stand nowhere: their line would join where they are drawn."""
    rigs = [(SunLight([0.0, 0.0, 0.0], 1.0, [0.1 * index, 0.0, -1.0]), *rig) for index, rig in enumerate(RIGS)]
    [way] = ways(rigs)
    assert way[:, 0] == pytest.approx([0.1 * index for index in range(11)])


def test_what_the_stage_wrote_is_shown_frame_by_frame(tmp_path: Path) -> None:
    """Read as `rgspipe view SCENE fit=TRACK` does, and shown as it shows it."""
    freeze, context = followed_lamp(tmp_path / "store", tmp_path / "track")
    found = found_or_followed(context.folder)
    assert [frame.partition(":")[0] for frame in found.frames] == NAMES
    # Measured 1.5e-7.
    for (lamp,), place in zip(found.path, PLACES, strict=True):
        assert lamp.position.tolist() == pytest.approx(place, abs=1e-5)
    viewer = view(FrozenScene.load(freeze.folder()), cases=[Case(found=found)], port=0, resolution=32)
    try:
        with visited(viewer) as (page, browser):
            slider, way = page.fit._step, page.drawings.kinds["way"]
            assert (slider.label, slider.max, slider.value) == ("frame", 2, 2) and way.visible
            assert page.session.lights == found.path[2]
            press(page, browser, "8")
            press(page, browser, "8")
            assert page.session.lights == found.path[0] and "rig_0000: searched" in page.fit._told.content
            wait_for(page.painter.at_rest.is_set)
            assert page.session.picture(page.camera(32))[0].any()
    finally:
        viewer.stop()


def test_a_slider_goes_through_the_frames(frozen: FrozenScene) -> None:
    frames = [TrackedFrame(replace(dark_result(1.0), lights=rig), FrameStatus.TRACKED, 0.1) for rig in RIGS]
    viewer = view(frozen, fit=frames, port=0, resolution=32)
    try:
        with visited(viewer) as (page, browser):
            slider = page.fit._step
            assert (slider.label, slider.max, slider.value, slider.visible) == ("frame", 10, 10, True)
            press(page, browser, "8")
            assert page.session.lights == RIGS[9] and "frame 9: tracked" in page.fit._told.content
    finally:
        viewer.stop()
