"""Emitters of fits, from where they are and where they point, and rigs of them."""

from __future__ import annotations

import torch
from torch import Tensor

from lit_room import VISIBLE
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.search.refine import Refiner, State
from rgspipe.fitting.search.weighting import ROBUST
from rgspipe.scene.lights import Light, PointLight


def emitter_at(place: Tensor, axis: Tensor | None = None, shape: Light | None = None, **more) -> Emitter:
    """A light at `place` (3,), along `axis` (3,) if it is no point; `more` is what an `Emitter` has besides."""
    return Emitter((shape or PointLight.shaped()).at(place, axis), **more)


def refiner_of(room, point_light) -> Refiner:
    """On one view of a room under a point light at VISIBLE."""
    images = room.images(point_light(VISIBLE))
    return Refiner.of(LightProblem.create(room.one.prepared, room.one.prepared.stack_images(images)))


def placed(refiner: Refiner, *by: float) -> State:
    """A point light for each number, so far from VISIBLE along all axes."""
    return refiner.start([emitter_at(torch.tensor(VISIBLE, dtype=torch.float64) + one) for one in by], ROBUST)
