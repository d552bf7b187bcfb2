"""Where a target's hidden light is, as the target's cameras see it."""

from __future__ import annotations

from typing import Literal, get_args

#: Classes that a light can be asked for in; see docs/reference/conventions.md.
LightClass = Literal["visible", "out_of_frame", "occluded", "around_corner"]
LIGHT_CLASSES: tuple[LightClass, ...] = get_args(LightClass)

#: A target may not say.
Occlusion = Literal[LightClass, "unknown"]
OCCLUSIONS: tuple[Occlusion, ...] = get_args(Occlusion)
