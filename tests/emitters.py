"""Emitters of fits, from where they are and where they point."""

from __future__ import annotations

from torch import Tensor

from rgspipe.fitting.model.emitter import Emitter
from rgspipe.scene.lights import Light, PointLight


def emitter_at(place: Tensor, axis: Tensor | None = None, shape: Light | None = None, **more) -> Emitter:
    """A light at `place` (3,), along `axis` (3,) if it is no point; `more` is what an `Emitter` has besides."""
    return Emitter((shape or PointLight.shaped()).at(place, axis), **more)
