"""How far a recovered rig is from the true one, once each light has found its match."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import linear_sum_assignment

from rgspipe.evaluation import metrics
from rgspipe.evaluation.arrays import to_array
from rgspipe.evaluation.shapes import is_one_kind, shape_kind
from rgspipe.scene import Light, LightRig


@dataclass(frozen=True)
class RigErrors:
    """How far a recovered rig is from the true one.

    Attributes:
        position: the largest position error of the matched lights, fraction of the scene size.
        intensity: the mean intensity error of the matched lights, a fraction.
        axis: the largest angle between the axes of the true lights that have one and their matches, degrees; infinite
            where a match is of another kind, NaN where no light has an axis.
        shape: the largest error of the first numbers of their shapes and of those that are measured as these (cone
            angles, degrees; exponents; radii; both sides of panels), likewise; NaN where the true lights that have
            shapes are of several kinds, whose numbers have no common unit.
        pairs: (estimate, truth) indices of the matched lights, in the order of the truth.
    """

    position: float
    intensity: float
    axis: float
    shape: float
    pairs: tuple[tuple[int, int], ...]


def match_positions(estimate: npt.ArrayLike, truth: npt.ArrayLike) -> tuple[tuple[int, int], ...]:
    """Pairs (estimate, truth) of positions (K, 3) and (L, 3) with the smallest sum of distances.

    min(K, L) pairs, in the order of the truth. Estimates that are not finite are matched last.
    """
    estimate, truth = np.asarray(estimate, dtype=float), np.asarray(truth, dtype=float)
    if estimate.ndim != 2 or truth.ndim != 2 or estimate.shape[1] != 3 or truth.shape[1] != 3:
        raise ValueError(f"positions must have shapes (K, 3) and (L, 3), got {estimate.shape} and {truth.shape}")
    distance = np.linalg.norm(estimate[:, None] - truth[None], axis=-1)
    finite = distance[np.isfinite(distance)]
    # Larger than any sum of finite distances, so a broken estimate is taken only when nothing else is left.
    far = 1.0 + (float(finite.sum()) if finite.size else 0.0)
    chosen, wanted = linear_sum_assignment(np.where(np.isfinite(distance), distance, far))
    return tuple(sorted(zip(chosen.tolist(), wanted.tolist(), strict=True), key=lambda pair: pair[1]))


def nearest_position(position: npt.ArrayLike, rig: LightRig) -> npt.NDArray | None:
    """(3,) the position of the light of `rig` that is nearest to `position` (3,); None without lights."""
    places = [to_array(light.position) for light in rig]
    return min(places, key=lambda place: float(np.linalg.norm(place - np.asarray(position)))) if places else None


def rig_errors(estimate: LightRig, truth: LightRig, scene_size: float) -> RigErrors:
    """Errors of a recovered rig after the optimal matching of its lights.

    The position error is the worst of the matched lights, so a target counts as solved only when each
    of its lights is; that of a light at infinity is the angle by which it is off [rad].
    Lights too many or too few are not in these numbers: see `target_table`.

    Raises:
        ValueError: the truth has no light.
    """
    if not truth:
        raise ValueError("the true rig has no light")
    if not estimate:
        axis = math.inf if any(light.axis is not None for light in truth) else math.nan
        shape = math.inf if is_one_kind(shape_kind(truth)) else math.nan
        return RigErrors(math.inf, math.inf, axis, shape, ())
    found, wanted = (np.stack([to_array(light.standing(scene_size)) for light in rig]) for rig in (estimate, truth))
    pairs = match_positions(found, wanted)
    positions = [metrics.position_error(found[i], wanted[j], scene_size) for i, j in pairs]
    intensities = [metrics.intensity_error(estimate[i].intensity, truth[j].intensity) for i, j in pairs]
    axis, shape = _shape_errors([(estimate[i], truth[j]) for i, j in pairs])
    comparable = is_one_kind(shape_kind(truth))
    return RigErrors(max(positions), float(np.mean(intensities)), axis, shape if comparable else math.nan, pairs)


def _shape_errors(pairs: Sequence[tuple[Light, Light]]) -> tuple[float, float]:
    """The largest errors of axes [degrees] and of the shapes of matched lights (estimate, truth)."""
    axes, shapes = [], []
    for found, wanted in pairs:
        alike = found.kind == wanted.kind
        if wanted.axis is not None:
            axes.append(metrics.angle_between(found.axis, wanted.axis) if alike else math.inf)
        if wanted.shape:
            shapes.append(_shape_error(found.like(wanted), wanted) if alike else math.inf)
    return max(axes, default=math.nan), max(shapes, default=math.nan)


def _shape_error(found: Light, wanted: Light) -> float:
    """By how much the first number of a shape is off, a spot's cone angle for one, or others like it, in its unit."""
    first, *others = wanted.shape
    numbers = [first, *(one for one in others if one.coordinate is first.coordinate)]
    return max(abs(one.shown(getattr(found, one.name) - getattr(wanted, one.name))) for one in numbers)
