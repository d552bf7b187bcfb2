"""Direct light where pixels look: kernels against the float64 reference, and images against exact geometry."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse
import torch
from torch import Tensor

from clouds import DEVICES, FAR, cloud
from rgspipe.renderer import reference
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.kernels.irradiance import SOFTENING
from rgspipe.renderer.kernels.pixel_light import PixelLight
from rgspipe.renderer.kernels.pixel_rays import pixel_rays
from rgspipe.renderer.kernels.pixel_shadow import pixel_transmittance
from rgspipe.renderer.kernels.places import ways_to
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.pixel_direct import (
    LEAST_RAYS,
    SHADOW_RAYS,
    PixelDirect,
    _heaviest,
    edge_places,
    surfel_transmittance,
)
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.unit_light import Share
from rgspipe.renderer.view_weights import build_view_weights, even_places
from rgspipe.scene import Camera, Surfels, look_at
from rgspipe.scene.rectangles import inside_of_box, solid_box, surfels_on

LIGHT = torch.tensor([0.1, 0.2, 0.3], dtype=torch.float64)

#: The place of a light at infinity, which the cloud is lit by.
SUN = torch.nn.functional.normalize(torch.tensor([0.1, 0.2, 0.3, 0.0], dtype=torch.float64), dim=0)


def camera(resolution: int = 12, origin: tuple[float, float, float] = (0.3, -1.4, 0.4)) -> Camera:
    return Camera.from_field_of_view(look_at(torch.tensor(origin), torch.zeros(3)), 0.8, resolution, resolution)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("distance", [1.0, 0.02, math.inf])
def test_light_at_pixels_matches_the_reference(distance: float, device: str) -> None:
    """Lights at infinity, in the open and beside a surfel, where pixels are averaged over their footprint."""
    surfels, seen = cloud(60, seed=0), camera()
    bvh = SurfelBvh(surfels.to(torch.float32).to(device))
    view = build_view_weights(bvh, seen, supersampling=2)
    generator = torch.Generator().manual_seed(1)
    passing = torch.rand(60, generator=generator, dtype=torch.float64)
    own = torch.where(torch.rand(144, generator=generator) < 0.3, torch.rand(144, generator=generator), -1.0).double()
    light = SUN if distance == math.inf else surfels.centers[7] + distance * surfels.normals[7]
    softening = float(SOFTENING) * surfels.scales.prod(dim=1).sqrt()
    prepared = PixelLight(bvh, view.operator.matrix, view.edges, pixel_rays(bvh, seen), softening.to(device))
    own4 = torch.cat([own[:, None], torch.zeros(144, 3)], dim=1).float().to(device)
    slope = torch.zeros(60, 3, device=device)
    found = prepared.image(light, passing.to(device), slope, own4).double().cpu()

    weights = torch.from_numpy(view.operator.to_scipy().toarray()).double()

    def image(position: Tensor) -> Tensor:
        return reference.direct_image(surfels, weights, view.edges.cpu(), seen, position, passing, own)

    expected = image(light)
    exact = torch.func.jacfwd(image)(light)[..., :3]
    # Measured 2e-6 and 3e-6 of the largest.
    assert float((found[:, :, 0] - expected).abs().max()) < 2e-5 * float(expected.max())
    assert float((found[:, :, 1:] - exact).abs().max()) < 5e-5 * float(exact.abs().max())


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("place", [LIGHT, SUN], ids=["near", "at infinity"])
def test_shadows_of_pixels_match_the_reference(place: Tensor, device: str) -> None:
    surfels, seen = cloud(120, seed=2), camera()
    receivers = torch.randint(0, 120, (144,), generator=torch.Generator().manual_seed(3))
    pixels, places = torch.arange(0, 144, 3), even_places(4)
    bvh = SurfelBvh(surfels.to(torch.float32).to(device))
    found = pixel_transmittance(bvh, pixel_rays(bvh, seen), receivers, pixels, place, places).double().cpu()
    _, directions, lengths = seen.rays()
    axes = seen.camera_to_world[:3, :3].double()

    def passing_at(light: Tensor) -> Tensor:
        total = torch.zeros(len(pixels), dtype=torch.float64)
        for x, y in (places - 0.5).tolist():
            rays = (directions * lengths[:, None])[pixels] + x * axes[:, 0] / seen.fx + y * axes[:, 1] / seen.fy
            which = receivers[pixels]
            points = reference.points_on_surfels(surfels, seen.origin.double(), rays, which, torch.inf)
            lit = (ways_to(light, points) * surfels.normals[which]).sum(1) > 0.0
            total = total + torch.where(lit, reference.transmittance_at(surfels, light, which, points), 0.0)
        return total / len(places)

    expected = passing_at(place)
    exact = torch.func.jacfwd(passing_at)(place)[..., :3]
    assert float(((expected > 0.01) & (expected < 0.99)).double().mean()) > 0.1, "there must be penumbrae"
    assert bool((found[torch.arange(144) % 3 > 0, 0] == -1.0).all()), "the other pixels are left to the surfels"
    # Measured 1e-6, and 2e-6 of the largest derivative.
    assert float((found[pixels, 0] - expected).abs().max()) < 2e-5
    assert float((found[pixels, 1:] - exact).abs().max()) < 5e-5 * float(exact.abs().max())


def room() -> Surfels:
    return surfels_on(
        inside_of_box([0, 0, 0], [1, 1, 1], [0.6] * 3) + solid_box([0, 0, -0.3], [0.3] * 3, [0.5] * 3), 1500
    )


def exact_floor(seen: Camera, light: Tensor) -> Tensor:
    """(P,) direct radiance of the floor z = −0.5 under the box, nan where a pixel shows something else."""
    origins, directions, _ = seen.rays(places=even_places(64))
    points = origins + ((-0.5 - origins[:, 2]) / directions[:, 2])[:, None] * directions
    path = light - points
    # The box spans ±0.15 in x and y and z from −0.45 to −0.15.
    low, high = torch.tensor([-0.15, -0.15, -0.45]), torch.tensor([0.15, 0.15, -0.15])
    ends = torch.stack([(low - points) / path, (high - points) / path])
    enter, leave = ends.amin(dim=0).amax(dim=1), ends.amax(dim=0).amin(dim=1)
    shadowed = (enter < leave) & (leave > 0.0) & (enter < 1.0)
    value = torch.where(shadowed, 0.0, 0.6 / math.pi * path[:, 2] / path.norm(dim=1) ** 3)
    on_floor = (directions[:, 2] < 0.0) & (points[:, :2].abs() < 0.49).all(dim=1)
    ends = torch.stack([(low - origins) / directions, (high - origins) / directions])
    on_floor &= ends.amin(dim=0).amax(dim=1) > ends.amax(dim=0).amin(dim=1)
    return torch.where(on_floor, value, math.nan).reshape(-1, 64).mean(dim=1)


def test_a_shadow_is_as_sharp_as_the_image() -> None:
    """The floor's shadow edge against exact geometry: pixels are several times better than surfels."""
    surfels, seen = room().to(torch.float32), camera(64, (0.35, -0.45, 0.4))
    light = torch.tensor([0.2, 0.1, 0.3], dtype=torch.float64)
    bvh = SurfelBvh(surfels)
    view = build_view_weights(bvh, seen)
    exact = exact_floor(seen, light)
    plain = ~exact.isnan() & ~view.edges
    sharp = PixelDirect(bvh, view).image(light, *surfel_transmittance(bvh, light))[:, 0, 0].double()
    irradiance, _ = unit_irradiance(bvh, light[None])
    blurred = (view.operator @ (surfels.albedo * irradiance[0, :, None] / math.pi))[:, 0].double()
    white = float(exact[plain].max())
    errors = [float((image - exact)[plain].square().mean().sqrt()) / white for image in (sharp, blurred)]
    # Measured 0.011, most of it where the box stands on nothing but its gap to the floor, and 0.060.
    assert errors[0] < 0.02
    assert errors[1] > 3.0 * errors[0]


@pytest.mark.parametrize(("height", "worst"), [(0.01, 0.03), (0.02, 0.01), (0.05, 0.0015)])
def test_a_lamp_beside_a_surface_is_as_bright_there_as_it_is(height: float, worst: float) -> None:
    """The brightest pixels against the mean of the light over each; surfels have scales of 0.04.

    Measured 0.015, 0.005 and 0.0007 too dim or too bright; 0.75, 0.32 and 0.018 if pixels see lights as surfels do.
    """
    surfels, pose = room().to(torch.float32), look_at(torch.tensor([0.4, -0.4, 0.4]), torch.tensor([0.25, -0.2, -0.5]))
    seen = Camera.from_field_of_view(pose, 0.8, 64, 64)
    light = torch.tensor([0.25, -0.2, height - 0.5], dtype=torch.float64)
    exact = exact_floor(seen, light)
    bvh = SurfelBvh(surfels)
    found = PixelDirect(bvh, build_view_weights(bvh, seen)).image(light, *surfel_transmittance(bvh, light))[:, 0, 0]
    bright = (exact > 0.2 * exact[~exact.isnan()].max()).nonzero()[:, 0]
    off = found.double()[bright] / exact[bright] - 1.0
    assert float(off.abs().max()) < worst


def test_without_shadows_no_shadow_ray_is_cast(monkeypatch: pytest.MonkeyPatch) -> None:
    surfels, seen = room().to(torch.float32), camera(16, (0.35, -0.45, 0.4))
    bvh = SurfelBvh(surfels)
    direct = PixelDirect(bvh, build_view_weights(bvh, seen))
    monkeypatch.setattr("rgspipe.renderer.pixel_direct.transmittance", None)
    monkeypatch.setattr("rgspipe.renderer.kernels.pixel_shadow.light_transmittance", None)
    assert bool(direct.image(LIGHT, *surfel_transmittance(bvh, LIGHT, shadows=False)).isfinite().all())


def test_far_from_the_origin_nothing_changes() -> None:
    near, far = room(), replace(room(), centers=room().centers + FAR)
    images = []
    for surfels, offset in ((near, torch.zeros(3).double()), (far, FAR)):
        pose = camera(16, (0.35, -0.45, 0.4)).camera_to_world.double().clone()
        pose[:3, 3] += offset
        bvh = SurfelBvh(surfels)
        view = build_view_weights(bvh, Camera.from_field_of_view(pose, 0.8, 16, 16))
        images.append(PixelDirect(bvh, view).image(LIGHT + offset, *surfel_transmittance(bvh, LIGHT + offset)))
    # Measured 1e-6 of the largest: what float64 at 1e4 leaves of the places.
    assert float((images[0] - images[1])[:, :, 0].abs().max()) < 1e-4 * float(images[0][:, :, 0].abs().max())


def test_the_operator_gives_the_image_of_any_albedo() -> None:
    surfels, seen = room().to(torch.float32), camera(32, (0.35, -0.45, 0.4))
    light = torch.tensor([0.2, 0.1, 0.3], dtype=torch.float64)
    bvh = SurfelBvh(surfels)
    view = build_view_weights(bvh, seen)
    painted = replace(surfels, albedo=torch.rand(len(surfels), 3, generator=torch.Generator().manual_seed(5)))
    passing, slope = surfel_transmittance(bvh, light)
    operator = PixelDirect(bvh, view).operator(light, passing)
    expected = PixelDirect(SurfelBvh(painted), view).image(light, passing, slope)[:, :, 0]
    # Measured 2e-7 of the largest.
    difference = (operator @ (painted.albedo / math.pi) - expected).abs()
    assert float(difference.max()) < 2e-6 * float(expected.max())


@pytest.mark.parametrize("levels", [1, 3, 1000])
@pytest.mark.parametrize("filled", [0.0, 0.6, 1.0])
def test_the_heaviest_surfel_of_a_pixel_is_the_last_of_the_largest(filled: float, levels: int) -> None:
    """As a stable sort of each row has it, also where rows are empty and weights are equal."""
    rng = np.random.default_rng(levels)
    for _ in range(100):
        counts = rng.integers(0, 8, rng.integers(1, 40))
        counts[rng.random(len(counts)) >= filled] = 0
        rows, entries = np.repeat(np.arange(len(counts)), counts), int(counts.sum())
        weights = (rng.integers(0, levels, entries) / levels).astype(np.float32)
        columns, starts = rng.integers(0, 50, entries), np.concatenate([[0], np.cumsum(counts)])
        operator = SparseOperator.from_scipy(scipy.sparse.csr_matrix((weights, columns, starts), (len(counts), 50)))
        order = np.lexsort((weights, rows))
        expected = dict(zip(rows[order].tolist(), columns[order].tolist(), strict=True))
        assert _heaviest(operator).tolist() == [expected.get(row, 0) for row in range(len(counts))]


@pytest.mark.parametrize("count", [1, 4, 12, 16])
def test_the_points_of_a_light_share_the_shadow_rays_of_a_pixel(count: int) -> None:
    """Together they are those of one light, or two each where that is more."""
    parts = [edge_places(Share(index, count)) for index in range(count)]
    assert all(len(part) >= LEAST_RAYS for part in parts)
    together = torch.cat(parts)
    assert len(together) == max(SHADOW_RAYS, LEAST_RAYS * count)
    # Each column and each row of the lattice holds one.
    for axis in (0, 1):
        torch.testing.assert_close(together[:, axis].sort().values, _middles(len(together)))


def _middles(count: int) -> Tensor:
    return (torch.arange(count, dtype=torch.float64) + 0.5) / count
