"""Surfels from the truth carry the truth."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from raycast import BLOCK, cast, room_views, surface_distance
from rgspipe.datasets.views import View
from rgspipe.evaluation.ceiling import project_albedo, surfels_from_passes, transmittance_image
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.view_weights import build_view_weights
from rgspipe.scene import Camera, Surfels, look_at
from rgspipe.scene.models import Box, CornellBox, exact_surfels


def _colour(normals: torch.Tensor) -> torch.Tensor:
    """A colour that the direction of the surface decides."""
    return 0.5 + 0.4 * normals


@pytest.fixture(scope="module")
def views() -> list[View]:
    plain = room_views(8, 48, normals=True)
    return [replace(view, albedo=_colour(view.normal)) for view in plain]


@pytest.fixture(scope="module")
def surfels(views: list[View]) -> Surfels:
    return surfels_from_passes(views, 700, seed=0)


def test_true_surfels_lie_on_the_surfaces_and_have_their_colours(surfels: Surfels) -> None:
    assert np.median(surface_distance(surfels.centers.double().numpy())) < 1e-3  # measured 0: the planes are exact
    error = (surfels.albedo - _colour(surfels.normals)).abs().amax(dim=1)
    assert float(error.quantile(0.95)) < 0.01  # measured 1e-7


def test_colours_are_means_over_footprints(surfels: Surfels, views: list[View]) -> None:
    noise = torch.Generator().manual_seed(0)
    noisy = [
        replace(view, albedo=view.albedo + 0.1 * torch.randn(view.albedo.shape, generator=noise)) for view in views
    ]
    spread = (project_albedo(surfels, noisy) - project_albedo(surfels, views)).std()
    assert 0.015 < float(spread) < 0.06  # measured 0.026: single pixels would give 0.1


def test_views_without_passes_are_refused(views: list[View]) -> None:
    with pytest.raises(ValueError, match="none has all three"):
        surfels_from_passes([replace(view, albedo=None) for view in views], 100, seed=0)


def test_transmittance_is_that_of_cast_rays() -> None:
    surfels = exact_surfels(CornellBox(boxes=(Box(BLOCK.center, BLOCK.size, BLOCK.turn),)), 3000)
    light = torch.tensor([0.35, -0.35, 0.1], dtype=torch.float64)
    camera = Camera.from_field_of_view(look_at(torch.tensor([0.0, -1.9, 0.4]), torch.zeros(3)), 0.6, 32, 32)
    bvh = SurfelBvh(surfels)
    found = transmittance_image(bvh, build_view_weights(bvh, camera, 1), light)
    origins, directions, _ = (part.numpy() for part in camera.rays())
    walls = replace(BLOCK, center=(0.0, 0.0, 0.0), size=(1.0, 1.0, 1.0), turn=0.0, room=True)
    reach = cast([walls, BLOCK], origins[0], directions)[0]
    assert (np.isfinite(found).ravel() <= np.isfinite(reach)).all()
    points = origins + directions * np.where(np.isfinite(reach), reach, 0.0)[:, None]
    away = points - light.numpy()
    distance = np.linalg.norm(away, axis=1)
    lit = cast([BLOCK], light.numpy(), away / distance[:, None])[0] > distance - 1e-4
    # Faces that turn away from the light count as lit: the cosine keeps them dark.
    known = np.isfinite(found).ravel() & (surface_distance(points, (BLOCK,)) > 1e-3)
    wrong = np.abs(found.ravel() - lit)[known] > 0.5
    assert 0.05 < 1.0 - lit[known].mean() < 0.5
    assert wrong.mean() < 0.03  # measured 0.2 %
    pose = look_at(torch.tensor([0.0, -1.9, 0.4]), torch.tensor([0.0, -9.0, 0.0]))
    elsewhere = Camera.from_field_of_view(pose, 0.6, 8, 8)
    assert np.isnan(transmittance_image(bvh, build_view_weights(bvh, elsewhere, 1), light)).all()
