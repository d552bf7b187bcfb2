"""One frozen room for all tests of fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pytest
import torch

from lit_room import frozen_room, room_cameras
from rgspipe.fitting import FitViews
from rgspipe.renderer.dictionary import LightDictionary
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import PointLight


@dataclass(frozen=True)
class Room:
    """A frozen room, the weights of two views of 48², the dictionary, and both ready for fits of one view and two."""

    frozen: FrozenScene
    views: list[ViewWeights]
    dictionary: LightDictionary
    one: FitViews
    two: FitViews

    def images(self, light: PointLight, count: int = 1) -> list[torch.Tensor]:
        return [self.frozen.render(view, (light,), sharp=False) for view in self.views[:count]]


@pytest.fixture(scope="session")
def room() -> Room:
    frozen = frozen_room().with_dictionary(6)
    views = [frozen.view(camera) for camera in room_cameras(48)]
    one, two = (FitViews.prepare(frozen, views[:count], sharp=False) for count in (1, 2))
    return Room(frozen, views, frozen.dictionary, one, two)


@pytest.fixture(scope="session")
def point_light() -> Callable[..., PointLight]:
    def make(position: tuple[float, float, float], intensity: tuple[float, ...] = (1.0, 2.0, 0.5)) -> PointLight:
        return PointLight(torch.tensor(position, dtype=torch.float64), torch.tensor(intensity, dtype=torch.float64))

    return make
