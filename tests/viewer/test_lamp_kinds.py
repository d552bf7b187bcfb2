"""What is said of lamps beside their numbers."""

from __future__ import annotations

import pytest

from luminaire_files import photometry
from open_room import frozen_open_room
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene.lights import KINDS
from rgspipe.viewer.lamp_images import LampImages
from rgspipe.viewer.lamp_kinds import HELP, words


def test_a_sun_is_told_whether_it_reaches_the_scene(frozen: FrozenScene) -> None:
    sun = KINDS["sun"].shaped()
    assert "No sun reaches this scene" in words(sun, LampImages(frozen))
    assert "through openings" in words(sun, LampImages(frozen_open_room()))


def test_a_profile_names_its_luminaire(frozen: FrozenScene) -> None:
    images, light = LampImages(frozen), KINDS["profile"].shaped()
    assert words(light, images) == "Luminaire: none, so that it shines with the cosine."
    assert words(light.with_tables(photometry(name="office.ies")), images) == "Luminaire: office.ies."


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"sun", "profile"}))
def test_of_others_their_numbers_tell_all(frozen: FrozenScene, kind: str) -> None:
    assert words(KINDS[kind].shaped(), LampImages(frozen)) == ""


def test_the_kinds_that_do_not_say_what_they_are_are_told() -> None:
    assert all(kind in HELP for kind in ("led", "sun", "profile"))
