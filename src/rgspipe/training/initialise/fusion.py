"""Noisy depth of many views made into one surface: sightings moved along their rays onto facets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rgspipe.datasets.views import View
from rgspipe.training.initialise.cloud import Cloud
from rgspipe.training.initialise.creases import distance_to, meet
from rgspipe.training.initialise.depth_noise import relative_noise
from rgspipe.training.initialise.facets import Facets, fit_facets
from rgspipe.training.initialise.resample import cells, estimate_area
from rgspipe.training.initialise.sightings import EXACT, Sightings
from rgspipe.training.initialise.visibility import confirmed

#: Radii of the neighbourhoods that a facet is fitted to, over the smallest.
GROWTH = np.array([1.0, 1.5, 2.25, 3.4])
#: Noise of a facet's normal [rad] for the smallest radius.
FIRST_TURN = 0.045
#: Smallest radius over the spacing of surfels, and over the scene's extent at the largest.
LEAST_RADIUS, MOST_RADIUS = 0.8, 0.05
#: Facets across the widest radius.
FACETS_ACROSS = 6.0
#: Fewest sightings of a facet, on average.
SIGHTINGS_PER_FACET = 10.0
ROUNDS = 3


def fuse(sightings: Sightings, views: Sequence[View], spacing: float) -> Cloud:
    """The points and normals of `sightings` once all views have agreed on the surface.

    In turns, facets are fitted to the sightings around them, and every sighting is moved along its own ray, which is
    exact, onto the facet that it meets. Facets that the views see through, and sightings that no facet explains, are
    left out.

    Args:
        views: those with depth, of which the sightings come.
        spacing: of the surfels that are wanted; finer detail is not looked for.
    """
    radii = fit_radii(sightings, spacing)
    size = radii[-1] / FACETS_ACROSS
    noise = [max(relative_noise(view.depth.detach().cpu().double().numpy()), EXACT) for view in views]
    for turn in range(ROUNDS):
        # Facets are laid out anew as long as strays are being sorted out.
        if turn < 2:
            label = cells(Cloud(sightings.points, sightings.normals), size)
        label = _renumbered(label)
        facets = fit_facets(sightings, label, radii)
        facets = replace(facets, strong=facets.strong & confirmed(facets, views, noise))
        if not facets.strong.any():
            # Views that agree on nothing: each one's own planes are all there is.
            return Cloud(sightings.points, sightings.normals)
        sightings, label = _settle(sightings, facets, meet(sightings, facets, label, size))
    kept = sightings[label >= 0]
    return Cloud(kept.points, kept.normals)


def fit_radii(sightings: Sightings, spacing: float) -> np.ndarray:
    """(R,) radii [scene units] of neighbourhoods, from how much the sightings say of a piece of surface.

    Sightings of density ω [inverse variance per area], weighted 1 − r²/R² in a disc of radius R, fix the slope of
    its plane with a variance of 12/(π ω R⁴).
    """
    points = sightings.points
    # The median, as a few close or grazing views would outweigh the rest of the scene.
    per_area = len(points) / estimate_area(Cloud(points, sightings.normals))
    density = per_area * float(np.median(sightings.certainty()))
    radius = (12.0 / (math.pi * density * FIRST_TURN**2)) ** 0.25
    low, high = np.percentile(points, [1.0, 99.0], axis=0)
    filled = FACETS_ACROSS / GROWTH[-1] * math.sqrt(SIGHTINGS_PER_FACET / per_area)
    least = max(LEAST_RADIUS * spacing, filled)
    most = max(MOST_RADIUS * float(np.linalg.norm(high - low)), least)
    return float(np.clip(radius, least, most)) * GROWTH


def _renumbered(label: np.ndarray) -> np.ndarray:
    """Labels without gaps; −1 stays."""
    used = label >= 0
    numbers = np.full(len(label), -1)
    numbers[used] = np.unique(label[used], return_inverse=True)[1]
    return numbers


def _settle(sightings: Sightings, facets: Facets, label: np.ndarray) -> tuple[Sightings, np.ndarray]:
    """The sightings on their facets; those without one stay where they were."""
    distance = distance_to(sightings, facets, label)
    settled = np.isfinite(distance)
    normals, bends = facets.normals[label], facets.bends[label]
    # From the plane, where it is met, to the paraboloid in one step: both are close within a facet.
    away = sightings.origins + sightings.directions * np.where(settled, distance, 0.0)[:, None] - facets.centers[label]
    slope = (bends @ away[..., None])[..., 0]
    height = 0.5 * np.einsum("md,md->m", away, slope)
    cosine = np.einsum("md,md->m", normals, sightings.directions)
    distances = np.where(settled, distance + height / np.where(settled, cosine, 1.0), sightings.distances)
    normals = normals - slope
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(settled[:, None], normals, sightings.normals)
    return sightings.moved(distances, normals), np.where(settled, label, -1)
