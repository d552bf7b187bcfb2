"""A .blend file is taken as a render of it would show it, and what is called the same is told apart."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

MEASURED = (
    "rendered_alone",
    "linked",
    "hidden_cameras",
    "extents",
    "treated",
    "mirrored",
    "keyed",
    "distorted",
    "posed",
)


@pytest.fixture(scope="module")
def folder(in_blender: Callable[..., None], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What blend_in_blender.py writes."""
    folder = tmp_path_factory.mktemp("blend")
    in_blender(folder, *MEASURED, script="blend_in_blender.py")
    return folder


@pytest.fixture(scope="module")
def found(folder: Path) -> Callable[[str], Any]:
    """`found("linked")` is what that function of it writes."""
    return lambda name: json.loads((folder / f"{name}.json").read_text())


def test_what_a_render_shows_is_taken_whatever_the_viewport_shows(found: Callable[[str], Any]) -> None:
    """Beside a cube of 6 faces another one, 3 units away: subdivided, in a row of 5, as instances, hidden.

    Some of them are a scatter of geometry nodes, an instance of a collection, or a NURBS ball.
    """
    shown = found("rendered_alone")
    assert {name: one["faces"] for name, one in shown.items()} == {
        "subdivided": 6 + 6 * 4**3,
        "row in renders": 6 + 5 * 6,
        "row in the viewport": 6 + 6,
        "instancer": 6 + 8 * 6,  # one at each corner of the second cube, which is not shown itself
        "scattered": 6 + 6 + 8 * 6,
        "collection": 6 + 6 * 4**3,
        "ball": 6 + 608,
        "hidden in the viewport": 6 + 6,
        "hidden in renders": 6,
        "second layer": 6 + 6,
    }
    # Measured 8.000000 and 4.000000, in single precision.
    assert shown["row in renders"]["length"] == pytest.approx(8.0, rel=1e-6)
    assert shown["row in the viewport"]["length"] == pytest.approx(4.0, rel=1e-6)
    # Half a small cube further. Measured 4.050000.
    assert shown["scattered"]["length"] == pytest.approx(4.05, rel=1e-6)


def test_materials_and_cameras_of_a_library_are_not_taken_for_those_of_the_same_name(
    found: Callable[[str], Any],
) -> None:
    told = found("linked")
    assert sorted(told["colours"]) == [[0.0, 0.0, 1.0, 1.0], [1.0, 0.0, 0.0, 1.0]]
    # Poses are of single precision; measured exact.
    assert told["cameras"] == {
        "Kitchen": pytest.approx([9.0, -9.0, 9.0], rel=1e-6),
        "Kitchen [library.blend]": pytest.approx([0.0, -5.0, 0.0], abs=1e-6),
    }


def test_cameras_are_where_they_are_also_where_they_are_hidden(found: Callable[[str], Any]) -> None:
    assert found("hidden_cameras") == {"viewport": 0.0, "render": 1.0, "collection": 2.0, "eye": 3.0}


def test_a_scene_that_is_too_small_or_too_far_away_is_refused_by_its_file(
    found: Callable[[str], Any], folder: Path
) -> None:
    said = found("extents")
    assert {*said} == {"tiny", "huge", "far"}
    for name, sentence in said.items():
        assert sentence.startswith(f"{folder / name}.blend: expected a scene of 1e-10 units at least")
    assert "its longest side 1.00053e-42" in said["tiny"] and "3e+10 away" in said["far"]


def test_what_a_render_does_with_an_object_besides_showing_it_is_told(found: Callable[[str], Any]) -> None:
    ordinary = "is left out: it is a surface like any other, in all images"
    assert found("treated") == [
        f'invisibility to some rays of "unseen" {ordinary}',
        f'the holdout of "held", "out" {ordinary}',
        f'the shadow catcher of "caught" {ordinary}',
    ]


def test_a_mirrored_room_is_the_room_that_it_is_as_it_was_modelled(found: Callable[[str], Any]) -> None:
    """A closed room whose faces look inwards, at scale x of 1 and -1: it would be a solid inside out."""
    assert found("mirrored") == {"1": True, "-1": True}


def test_materials_stand_at_the_frame_at_which_the_file_was_saved(found: Callable[[str], Any]) -> None:
    told = found("keyed")
    assert 0.5 < told["set"] < 1.0 and told["colour"] == told["set"]
    assert told["glow"] == 0.0  # keys of it would turn it on again


def test_a_camera_whose_images_are_stretched_or_cropped_is_none_of_ours(found: Callable[[str], Any]) -> None:
    """A border that leaves the rest of the image black crops nothing, and neither does one around all of it."""
    last = "and cannot be a target's: Kitchen"
    assert found("distorted") == {
        "wide": [[], [f"cameras whose pixels are not square (aspect 2 : 1), {last}"]],
        "cropped": [[], [f"cameras whose images are cropped to a render region, {last}"]],
        "border": [["Kitchen"], []],
        "whole": [["Kitchen"], []],
    }


def test_materials_that_go_by_their_object_are_named(found: Callable[[str], Any]) -> None:
    """Places in the box around an object are other ones only where it is turned."""
    pattern, relief = 'pattern of "Paint"', 'relief of "Paint"'
    override = '"Paint", the material of all in its view layer,'
    both = {"object": [pattern], "position": [pattern], "random": [pattern], "uv": [], "relief": [relief], "bump": []}
    expected = {f"{name} {turn}": said for name, said in both.items() for turn in ("0", "0.6")}
    expected |= {f"{name} 0": [] for name in ("generated", "checker")}
    expected |= {f"{name} 0.6": [pattern] for name in ("generated", "checker")}
    expected |= {f"override {turn}": [override] for turn in ("0", "0.6")}
    assert found("posed") == expected
