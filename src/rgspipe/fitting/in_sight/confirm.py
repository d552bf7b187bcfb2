"""Whether suspects are lamps, by the lights that the rest of the images tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.ndimage

from rgspipe.fitting.in_sight.lamp import BESIDE, TOUCHING, LampInSight, Mask, grown, parts
from rgspipe.fitting.in_sight.sight import Numbers, Sight
from rgspipe.fitting.in_sight.suspects import LEAST_PIXELS, SATURATED, sent, shaded
from rgspipe.scene import Light, LightRig

#: A lamp's pixels are so many times as bright as lights that stand elsewhere can make what is behind it.
BRIGHTER = 2.5


def confirmed(
    views: Sequence[Sight],
    images: Sequence[Numbers],
    lamps: Sequence[LampInSight],
    lights: LightRig,
    rendered: Sequence[Numbers],
    full: Sequence[Mask],
    near: float,
    faint: float,
) -> list[LampInSight]:
    """What of the lamps is nothing that `lights` light, with the numbers of the lights that stand there.

    Args:
        images, rendered: (H, W) mean radiance of the channels, one a view, as they are and under the lights.
        full: (H, W) bool, one a view, pixels that are saturated.
        near: how far beside the rays through a lamp its light may stand, scene units.
        faint: a lamp that no light was found for sends at least this part of what all lights send: highlights do not.
    """
    found = []
    for view, (sight, image, lit, most) in enumerate(zip(views, images, rendered, full, strict=True)):
        here = [lamp for lamp in lamps if lamp.view == view]
        if here:
            cores = parts(too_bright(sight, image, lit, most))
            named = located(views, [LampInSight(view, core, grown(core, BESIDE)) for core in cores], lights, near)
            found += [lamp for lamp in named if _is_lamp(sight, image - lit, lamp, here, lights, faint)]
    return found


def too_bright(sight: Sight, image: Numbers, rendered: Numbers, full: Mask) -> Mask:
    """(H, W) bool, pixels that are brighter than lights make them, or their neighbours, and than most of the view.

    Args:
        full: (H, W) bool, which are saturated.
    """
    shading = shaded(sight, image)
    lit = scipy.ndimage.maximum_filter(rendered, footprint=TOUCHING)
    return (image > np.where(full, SATURATED, BRIGHTER) * lit) & (shading > np.median(shading[sight.surface]))


def located(views: Sequence[Sight], lamps: Sequence[LampInSight], lights: LightRig, near: float) -> list[LampInSight]:
    """The lamps with the numbers of the lights that stand where they are seen."""
    return [replace(lamp, light=_light_at(views[lamp.view], lamp, lights, near)) for lamp in lamps]


def _is_lamp(
    sight: Sight, excess: Numbers, lamp: LampInSight, suspects: Sequence[LampInSight], lights: LightRig, faint: float
) -> bool:
    """Whether it was a suspect, and a light stands there or at least as much light comes from it as lamps send."""
    if not any((lamp.core & suspect.core).any() for suspect in suspects):
        return False
    if lamp.light is not None:
        return True
    sends = sum(float(light.intensity.double().mean()) for light in lights)
    return int(lamp.core.sum()) >= LEAST_PIXELS and sent(sight, excess, lamp.core) >= faint * sends


def _light_at(sight: Sight, lamp: LampInSight, lights: Sequence[Light], near: float) -> int | None:
    """The number (from 1) of the light that projects closest to a lamp, if that is close."""
    away = scipy.ndimage.distance_transform_edt(~lamp.core)
    # Of a lamp that something hides in part, the middle may be hidden.
    half = 0.5 * max(int(np.ptp(places)) + 1 for places in np.nonzero(lamp.core))
    beside = {}
    for number, light in enumerate(lights, start=1):
        (column, row), depth = (part.tolist() for part in sight.camera.project(light.position.double().cpu()))
        if depth > 0.0:
            allowed = BESIDE + half + near * sight.camera.fx / depth
            distance = _distance(away, column, row)
            if distance <= allowed:
                beside[distance] = number
    return beside[min(beside)] if beside else None


def _distance(away: Numbers, column: float, row: float) -> float:
    """Pixels from a place, in the image or beside it, to what `away` (H, W) is the distance from."""
    height, width = away.shape
    inside = np.clip(row, 0, height - 1e-6), np.clip(column, 0, width - 1e-6)
    beyond = np.hypot(row - inside[0], column - inside[1])
    return float(away[int(inside[0]), int(inside[1])] + beyond)
