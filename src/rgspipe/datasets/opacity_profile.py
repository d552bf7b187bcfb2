"""Our sharpened Gaussian footprint fitted to the opacity profiles of other renderers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

#: Radii, in standard deviations, at which profiles are compared, and the opacities in between which they are fitted.
RADII = np.linspace(0.0, 4.0, 161)
OPACITY_RANGE = (1e-3, 0.999)
STRETCH_RANGE = (0.1, 4.0)

#: Strengths for which the fit is done; it is smooth in between.
FITTED = 48


@dataclass(frozen=True)
class FittedProfiles:
    """Gaussians in the place of other profiles, one a surfel.

    Attributes:
        opacities: (N,) of the Gaussians.
        stretch: (N,) their standard deviation over the other profile's.
        rms: (N,) root mean square difference of covered share over the footprint, weighted by area.
        largest: (N,) largest difference of covered share.
    """

    opacities: np.ndarray
    stretch: np.ndarray
    rms: np.ndarray
    largest: np.ndarray


def smoothstep(low: float, high: float, alpha: np.ndarray) -> np.ndarray:
    """What a layer of opacity α covers, as in Coverage."""
    t = np.clip((alpha - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def fit_profiles(
    profile: Callable[[float, np.ndarray], np.ndarray], strengths: np.ndarray, low: float, high: float
) -> FittedProfiles:
    """For each strength the Gaussian that covers most like `profile` where it lies alone.

        min over o, k of ∫ (smoothstep(o·exp(−r²/2k²)) − profile(strength, r))² r dr

    Args:
        profile: covered share at radii r (R,) for a strength.
        strengths: (N,) one a surfel, positive.
        low, high: thresholds of the coverage in force.
    """
    knots = np.unique(np.quantile(strengths, np.linspace(0.0, 1.0, FITTED)))
    fits = np.empty((len(knots), 4))
    start = np.array([0.5 * (low + high), 1.0])
    for index, strength in enumerate(knots):
        fits[index] = _fit(profile(float(strength), RADII), low, high, start)
        start = fits[index, :2]
    return FittedProfiles(*(np.interp(strengths, knots, column) for column in fits.T))


def _fit(wanted: np.ndarray, low: float, high: float, start: np.ndarray) -> np.ndarray:
    """Opacity, stretch, and the rms and largest difference."""
    weight = np.sqrt(RADII)

    def difference(x: np.ndarray) -> np.ndarray:
        return smoothstep(low, high, x[0] * np.exp(-0.5 * (RADII / x[1]) ** 2)) - wanted

    bounds = tuple(zip(OPACITY_RANGE, STRETCH_RANGE, strict=True))
    # Below `low` nothing is covered and no slope says where to go, so a second start is tried from above it.
    starts = [np.clip(first, *bounds) for first in (start, np.array([0.5 * (low + 1.0), 1.0]))]
    found = min(
        (least_squares(lambda x: weight * difference(x), first, bounds=bounds) for first in starts),
        key=lambda result: result.cost,
    ).x
    error = difference(found)
    footprint = RADII * (wanted > 0.01 * max(wanted.max(), 1e-12))
    rms = np.sqrt((footprint * error**2).sum() / max(footprint.sum(), 1e-12))
    return np.array([*found, rms, np.abs(error).max()])
