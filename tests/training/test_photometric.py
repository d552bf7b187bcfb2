"""Normals from shading and heights from normals, where the truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from painted_room import LIGHT, painted_box, painted_views
from rgspipe.datasets.views import View
from rgspipe.scene import Surfels
from rgspipe.training.materials import fit_materials, trace_views
from rgspipe.training.options import TrainOptions
from rgspipe.training.parameters import tilted
from rgspipe.training.photometric import fit_heights, fit_normals, roughness, shading_of_view
from rgspipe.training.regularise import find_neighbours
from rgspipe.training.shading import SurfelLight, surfel_lights
from rgspipe.training.trainer import spacing_of_clips, train
from rooms import sphere

#: The painted room's surfels stand this far apart.
SPACING = 1 / 12


@pytest.fixture(scope="module")
def views() -> list[View]:
    return painted_views()


def leaning(surfels: Surfels, deviation: float) -> Surfels:
    """Normals turned at random by `deviation` [rad] in either direction."""
    noise = torch.randn(len(surfels), 2, generator=torch.Generator().manual_seed(1))
    return replace(surfels, rotations=tilted(surfels.rotations, deviation * noise.to(surfels.rotations)))


def rough(surfels: Surfels, deviation: float) -> Surfels:
    """Centres moved at random along the normals."""
    noise = torch.randn(len(surfels), generator=torch.Generator().manual_seed(2)).to(surfels.centers)
    return replace(surfels, centers=surfels.centers + deviation * noise[:, None] * surfels.normals)


def normal_error(surfels: Surfels, truth: Surfels) -> float:
    """Mean angle [deg]."""
    cosine = (surfels.normals * truth.normals).sum(dim=1).clamp(-1.0, 1.0)
    return float(torch.rad2deg(torch.acos(cosine)).mean())


def height_error(surfels: Surfels, truth: Surfels) -> float:
    return float(((surfels.centers - truth.centers) * truth.normals).sum(dim=1).square().mean().sqrt())


@pytest.mark.parametrize("common", [False, True])
def test_shading_turns_normals_back_although_albedo_was_fitted_with_the_wrong_ones(
    views: list[View], common: bool
) -> None:
    """Random turns, and one that whole walls share, which smoothness alone would leave."""
    truth = painted_box()
    turned = replace(truth, rotations=tilted(truth.rotations, torch.full((len(truth), 2), 0.05)))
    spoiled = turned if common else leaning(truth, 0.05)
    spoiled, lights = fitted_lights(spoiled, views)
    images = [view.image.reshape(-1, 3) for view in views]
    weights = trace_views(spoiled, views, 1)
    found = fit_normals(spoiled, weights, images, lights, find_neighbours(spoiled, SPACING))
    # Measured: 3.7° to 0.74° at random; 4.05° to 0.89° in common.
    assert normal_error(found, truth) < 0.5 * normal_error(spoiled, truth)


def fitted_lights(surfels: Surfels, views: list[View]) -> tuple[Surfels, list[SurfelLight]]:
    """`surfels` with the albedo that explains the views, and the views' light on them."""
    fitted = fit_materials(surfels, views, LIGHT)
    lamps = [view.light for view in views]
    return fitted.surfels, surfel_lights(fitted.surfels, lamps, fitted.radiance / fitted.surfels.albedo)


@pytest.mark.parametrize("axis", [0, 1])
def test_derivatives_of_shading_match_finite_differences(views: list[View], axis: int) -> None:
    truth, lights = fitted_lights(painted_box(), views)
    weights = trace_views(truth, views[:1], 1)[0]
    image = views[0].image.reshape(-1, 3)
    turns = torch.zeros(len(truth), 2)
    turns[:, axis] = 0.01 * torch.randn(len(truth), generator=torch.Generator().manual_seed(4))

    def residual(sign: float) -> np.ndarray:
        turned = replace(truth, rotations=tilted(truth.rotations, sign * turns))
        return shading_of_view(turned, weights, image, lights[0])[1]

    jacobian = shading_of_view(truth, weights, image, lights[0])[0]
    predicted = jacobian[:, axis * len(truth) : (axis + 1) * len(truth)] @ turns[:, axis].double().numpy()
    difference = 0.5 * (residual(-1.0) - residual(1.0))
    error = np.linalg.norm(predicted - difference) / np.linalg.norm(difference)
    # Measured 8e-5, the curvature over 0.01 rad.
    assert error < 1e-3


def test_heights_follow_the_normals_and_keep_what_was_measured_on_the_whole() -> None:
    truth = painted_box()
    spoiled = rough(truth, 0.1 * SPACING)
    found = fit_heights(spoiled, spoiled.centers, find_neighbours(spoiled, SPACING))
    # Measured: 0.0083 to 0.0011.
    assert height_error(found, truth) < 0.5 * height_error(spoiled, truth)
    moved = ((found.centers - spoiled.centers) * truth.normals).sum(dim=1)
    assert abs(float(moved.mean())) < 1e-3


def test_roughness_is_zero_on_spheres_and_measures_noise() -> None:
    ball = sphere(2000).to(torch.float32)
    spacing = spacing_of_clips(ball)
    clean = roughness(ball, find_neighbours(ball, spacing))
    noisy = leaning(ball, 0.05)
    # Measured 2e-7: chords of a sphere are at right angles to the mean normal.
    assert clean < 1e-5
    # The median of |½(δ_i + δ_j)| is 0.48 deviations; measured 0.0238.
    assert roughness(noisy, find_neighbours(noisy, spacing)) == pytest.approx(0.48 * 0.05, rel=0.1)


def test_training_turns_rough_normals_and_leaves_smooth_ones_alone(views: list[View]) -> None:
    truth = painted_box()
    options = TrainOptions(rounds=2, gather_rays=64, patches=100, supersampling=1, steps=0)
    smooth = train(views, truth, options).surfels
    assert torch.equal(smooth.rotations, truth.rotations)
    spoiled = leaning(truth, 0.05)
    found = train(views, spoiled, options).surfels
    # Measured: 3.7° to 0.76°.
    assert normal_error(found, truth) < 0.5 * normal_error(spoiled, truth)
