"""Whether lamps are where the files say: near surfaces that face them must be brighter than far ones that do not.

What a surface gets is n·l / d² and not more; its colour, shadows and light that bounces blur the order of brightness,
but favour no other place. The order is compared by Spearman's rank correlation, view by view.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rgspipe.datasets.views import View
from rgspipe.evidence.comparison import FEWEST_VIEWS, REMAINDER, clearly_above, plainest
from rgspipe.evidence.readings import FLIP, Numbers

#: Units of the poses over those of the lamps, as millimetres, centimetres or a scene that was scaled without its lamps.
SCALES = (0.001, 1000.0, 0.01, 100.0, 0.1, 10.0)

#: Of so many views a smaller mean correlation is of images that do not show what the lamps light: true places have 0.6
#: and more, images put to other frames −0.1 to 0.1.
ENOUGH_VIEWS, LEAST_CORRELATED = 10, 0.1

#: Pixels of each view, and the fewest that have an order.
POINTS, FEWEST_POINTS = 500, 50


@dataclass(frozen=True)
class LampReading:
    """How places of lamps could have been meant.

    Attributes:
        words: in words.
        remedy: what to do.
        place: from the place (3,) that was read and the camera's pose (4, 4) to the one that was meant.
        frame: how many views further on the place was read.
    """

    words: str
    remedy: str
    place: Callable[[Numbers, Numbers], Numbers]
    frame: int = 0


def _in_camera(flip: Numbers) -> Callable[[Numbers, Numbers], Numbers]:
    return lambda place, pose: (pose @ flip @ np.append(place, 1.0))[:3]


def _turned(*rows: tuple[float, float, float]) -> Callable[[Numbers, Numbers], Numbers]:
    return lambda place, pose: np.array(rows) @ place


def _scaled(factor: float) -> LampReading:
    words = f"times {factor:g}"
    return LampReading(words, f"Write them in the unit of the poses: {words}.", lambda place, pose: factor * place)


def _moved(frame: int, words: str) -> LampReading:
    remedy = f"Each frame needs its own lamp: give each that of the {words} frame."
    return LampReading(f"of the {words} frame", remedy, lambda place, pose: place, frame)


STATED = LampReading("as read", "", lambda place, pose: place)
READINGS = (
    STATED,
    LampReading("with +z up where +y was", "Write (x, −z, y) for (x, y, z).",
                _turned((1, 0, 0), (0, 0, -1), (0, 1, 0))),
    LampReading("with +y up where +z was", "Write (x, z, −y) for (x, y, z).",
                _turned((1, 0, 0), (0, 0, 1), (0, -1, 0))),
    LampReading("with y and z of other sign", "Change the sign of y and z.",
                _turned((1, 0, 0), (0, -1, 0), (0, 0, -1))),
    *map(_scaled, SCALES),
    _moved(1, "next"),
    _moved(-1, "previous"),
    LampReading("in the camera's axes", "Multiply them by transform_matrix.", _in_camera(np.eye(4))),
    LampReading("in OpenCV axes of the camera", "Change the sign of y and z, then multiply by transform_matrix.",
                _in_camera(FLIP)),
)  # fmt: skip


@dataclass(frozen=True)
class LampFinding:
    """Places that explain the brightness of images where the files' own do not.

    Attributes:
        lamps: what was meant; None where no reading explains it.
        found, stated: mean rank correlation of brightness with what surfaces get, as meant and as stated.
    """

    lamps: LampReading | None
    found: float
    stated: float


def misplaced(views: Sequence[View], seed: int = 0) -> LampFinding | None:
    """What brightness clearly says of the lamps' places, unless it is that they are where they were read."""
    generator = np.random.default_rng(seed)
    lit = [view for view in views if view.light is not None]
    surfaces = [None if view.depth is None else _surface(view, generator) for view in lit]
    if sum(surface is not None for surface in surfaces) < FEWEST_VIEWS:
        return None
    scores = {lamps: _scores(lit, surfaces, lamps) for lamps in READINGS}
    meant = plainest(scores)
    found, stated = float(scores[meant].mean()), float(scores[STATED].mean())
    if 1.0 - found <= REMAINDER * (1.0 - stated) and clearly_above(scores[meant]):
        return LampFinding(meant, found, stated)
    told = scores[STATED][scores[STATED] != 0.0]
    if len(told) >= ENOUGH_VIEWS and told.mean() < LEAST_CORRELATED:
        return LampFinding(None, float(told.mean()), float(told.mean()))
    return None


@dataclass(frozen=True, eq=False)
class _Surface:
    """Pixels (N,) of a view: where they are (N, 3), their normals (N, 3), and how bright they are (N,)."""

    points: Numbers
    normals: Numbers
    brightness: Numbers


def _surface(view: View, generator: np.random.Generator) -> _Surface | None:
    """Some pixels of a view with neighbours of known depth that are not saturated; None where they are too few."""
    origins, directions, lengths = view.camera.rays()
    points = origins + directions * (view.depth.reshape(-1).double() * lengths)[:, None]
    points = points.reshape(*view.depth.shape, 3).numpy()
    with np.errstate(invalid="ignore"):
        across, down = points[1:-1, 2:] - points[1:-1, :-2], points[2:, 1:-1] - points[:-2, 1:-1]
        # Rows go down in the image, so that this faces the camera.
        normals = np.cross(down, across)
        size = np.linalg.norm(normals, axis=-1)
    known = np.isfinite(size) & (size > 0.0) & ~view.saturated.any(dim=-1).numpy()[1:-1, 1:-1]
    rows, columns = _some(known, generator)
    if len(rows) < FEWEST_POINTS:
        return None
    brightness = view.image.mean(dim=-1).double().numpy()[1:-1, 1:-1]
    unit = normals[rows, columns] / size[rows, columns][:, None]
    return _Surface(points[1:-1, 1:-1][rows, columns], unit, brightness[rows, columns])


def _some(
    known: npt.NDArray[np.bool_], generator: np.random.Generator
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    rows, columns = known.nonzero()
    chosen = generator.permutation(len(rows))[:POINTS]
    return rows[chosen], columns[chosen]


def _scores(views: Sequence[View], surfaces: Sequence[_Surface | None], lamps: LampReading) -> Numbers:
    """(V,) correlations of those views that show surfaces."""
    found = []
    for index, (view, surface) in enumerate(zip(views, surfaces, strict=True)):
        if surface is not None:
            read = views[(index + lamps.frame) % len(views)].light.position.double().numpy()
            found.append(_correlation(surface, lamps.place(read, view.camera.camera_to_world.numpy())))
    return np.array(found)


def _correlation(surface: _Surface, place: Numbers) -> float:
    """Rank correlation of brightness with what the surfaces would get; 0 where either is the same all over."""
    path = place - surface.points
    squared = np.maximum((path**2).sum(axis=1), 1e-300)
    received = np.maximum((path * surface.normals).sum(axis=1), 0.0) / squared**1.5
    if np.ptp(received) == 0.0 or np.ptp(surface.brightness) == 0.0:
        return 0.0
    # Slow to import, and asked only of lamps that are given.
    from scipy.stats import spearmanr

    return float(spearmanr(received, surface.brightness).statistic)
