"""Searches of the page: they find the lamps of photographs, start from lamps of now, and say where to look from."""

from __future__ import annotations

import threading

import pytest
import torch

from lit_room import VISIBLE, room_cameras
from rgspipe.errors import InputError
from rgspipe.progress import progress_told
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.scene.lights.sphere import SphereLight
from rgspipe.viewer.around import cameras_around
from rgspipe.viewer.lamp_images import LampImages
from rgspipe.viewer.material import Photograph
from rgspipe.viewer.search import Finder

LAMP = PointLight(list(VISIBLE), [0.6, 0.5, 0.4])


@pytest.fixture(scope="module")
def finder(frozen: FrozenScene) -> Finder:
    return Finder(frozen)


@pytest.fixture(scope="module")
def photographs(frozen: FrozenScene) -> list[Photograph]:
    return [Photograph(f"{k}", one, frozen.render(one, LAMP)) for k, one in enumerate(room_cameras(32))]


def test_the_lamp_of_photographs_is_found(finder: Finder, photographs: list[Photograph]) -> None:
    result = finder.find(photographs, "point")
    # Found 2.7e-8 off.
    assert torch.allclose(result.lights[0].position, LAMP.position, atol=1e-3)


def test_how_far_each_part_of_a_search_is_is_told(
    frozen: FrozenScene, photographs: list[Photograph], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rgspipe.progress.QUIET_SECONDS", 0.0)
    # Parts that take less than what lies between two lines are told, too.
    monkeypatch.setattr("rgspipe.progress._OFTEN", 0.0)
    told: list[str] = []
    with progress_told(told.append):
        Finder(frozen).find(photographs[:1])
    # The dictionary of the scene may be there already.
    begun = {line.partition(":")[0] for line in told if line}
    assert {"aimed candidates", "trying 1 light", "trying 2 lights", "polishing", "looking beside"} <= begun
    assert told[-1] == ""


def test_a_refit_begins_with_the_lamps_of_now(finder: Finder, photographs: list[Photograph]) -> None:
    result = finder.refit(photographs, (LAMP.at(LAMP.position - 0.1),))
    assert torch.allclose(result.lights[0].position, LAMP.position, atol=1e-3)


def test_a_refit_keeps_the_kind(finder: Finder, photographs: list[Photograph]) -> None:
    result = finder.refit(photographs, (SphereLight(list(VISIBLE), [0.6, 0.5, 0.4], 0.02),))
    assert [light.kind for light in result.lights] == ["sphere"]
    # A small sphere shines as a point does, but for shadows' edges: measured 1.1e-3.
    assert torch.allclose(result.lights[0].position, LAMP.position, atol=1e-2)


def test_pictures_are_made_while_a_search_runs(
    finder: Finder, frozen: FrozenScene, photographs: list[Photograph]
) -> None:
    images, camera = LampImages(frozen), photographs[0].camera
    alone = images.image(camera, (LAMP,), "soft")
    search = threading.Thread(target=finder.find, args=(photographs, "point"))
    search.start()
    made = []
    while search.is_alive():
        made.append(LampImages(frozen).image(camera, (LAMP,), "soft"))
    # Measured 21.
    assert len(made) > 3 and all(torch.equal(image, alone) for image in made)


def test_another_camera_is_advised(finder: Finder, frozen: FrozenScene, photographs: list[Photograph]) -> None:
    outside = [camera for _, camera in cameras_around(frozen, photographs[0].camera)[:3]]
    candidates = [photographs[1].camera, *outside]
    advice = finder.advice(photographs[:1], (LAMP,), candidates, wanted=0.003)
    assert len(advice.ranked) == len(candidates)
    assert advice.ranked[0].position_sd <= advice.present_sd


def test_nothing_to_search_is_refused(finder: Finder, photographs: list[Photograph]) -> None:
    with pytest.raises(InputError, match="target=DIR"):
        finder.find([])
    with pytest.raises(InputError, match="Add a lamp"):
        finder.refit(photographs, ())
    with pytest.raises(InputError, match="Find them first"):
        finder.advice(photographs, (), [], wanted=0.003)
