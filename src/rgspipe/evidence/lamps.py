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

#: Pixels of each view, and the fewest that have an order.
POINTS, FEWEST_POINTS = 500, 50


@dataclass(frozen=True)
class LampReading:
    """How places of lamps could have been meant.

    Attributes:
        words: in words.
        remedy: what to do.
        place: from the place (3,) that was read and the camera's pose (4, 4) to the one that was meant.
    """

    words: str
    remedy: str
    place: Callable[[Numbers, Numbers], Numbers]


def _in_camera(flip: Numbers) -> Callable[[Numbers, Numbers], Numbers]:
    return lambda place, pose: (pose @ flip @ np.append(place, 1.0))[:3]


def _turned(*rows: tuple[float, float, float]) -> Callable[[Numbers, Numbers], Numbers]:
    return lambda place, pose: np.array(rows) @ place


STATED = LampReading("as read", "", lambda place, pose: place)
READINGS = (
    STATED,
    LampReading("with +z up where +y was", "Write (x, −z, y) for (x, y, z).",
                _turned((1, 0, 0), (0, 0, -1), (0, 1, 0))),
    LampReading("with +y up where +z was", "Write (x, z, −y) for (x, y, z).",
                _turned((1, 0, 0), (0, 0, 1), (0, -1, 0))),
    LampReading("with y and z of other sign", "Change the sign of y and z.",
                _turned((1, 0, 0), (0, -1, 0), (0, 0, -1))),
    LampReading("times 0.001", "Write them in the unit of the poses: times 0.001.", lambda place, pose: 0.001 * place),
    LampReading("times 1000", "Write them in the unit of the poses: times 1000.", lambda place, pose: 1000.0 * place),
    LampReading("in the camera's axes", "Multiply them by transform_matrix.", _in_camera(np.eye(4))),
    LampReading("in OpenCV axes of the camera", "Change the sign of y and z, then multiply by transform_matrix.",
                _in_camera(FLIP)),
)  # fmt: skip


@dataclass(frozen=True)
class LampFinding:
    """Places that explain the brightness of images where the files' own do not.

    Attributes:
        lamps: what was meant.
        found, stated: mean rank correlation of brightness with what surfaces get, as meant and as stated.
    """

    lamps: LampReading
    found: float
    stated: float


def misplaced(views: Sequence[View], seed: int = 0) -> LampFinding | None:
    """The places of lamps that brightness clearly calls for, if they are not those that were read."""
    generator = np.random.default_rng(seed)
    lit = [view for view in views if view.depth is not None and view.light is not None]
    shown = [(view, surface) for view in lit if (surface := _surface(view, generator)) is not None]
    if len(shown) < FEWEST_VIEWS:
        return None
    scores = {lamps: np.array([_correlation(view, surface, lamps) for view, surface in shown]) for lamps in READINGS}
    meant = plainest(scores)
    found, stated = float(scores[meant].mean()), float(scores[STATED].mean())
    if 1.0 - found > REMAINDER * (1.0 - stated) or not clearly_above(scores[meant]):
        return None
    return LampFinding(meant, found, stated)


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


def _correlation(view: View, surface: _Surface, lamps: LampReading) -> float:
    """Rank correlation of brightness with what the surfaces would get; 0 where either is the same all over."""
    place = lamps.place(view.light.position.double().numpy(), view.camera.camera_to_world.numpy())
    path = place - surface.points
    squared = np.maximum((path**2).sum(axis=1), 1e-300)
    received = np.maximum((path * surface.normals).sum(axis=1), 0.0) / squared**1.5
    if np.ptp(received) == 0.0 or np.ptp(surface.brightness) == 0.0:
        return 0.0
    # Slow to import, and asked only of lamps that are given.
    from scipy.stats import spearmanr

    return float(spearmanr(received, surface.brightness).statistic)
