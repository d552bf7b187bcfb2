"""Direct light in closed form: inverse square, cosine, their derivatives, and the shadow of a screen."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.kernels.irradiance import SOFTENING
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.rig import rig_irradiance
from rgspipe.scene import PointLight, Surfels
from rooms import closed_box, rectangle, surfels_on


@pytest.fixture(scope="module")
def box() -> FrozenScene:
    return FrozenScene.freeze(closed_box(1 / 10, albedo=0.5), gather_rays=32, patches=60, seed=0)


def softened(light: Tensor, surfels: Surfels) -> Tensor:
    """(N,) max(0, n·d)/(|d|⁴ + ε⁴)^{3/4}, in float64."""
    d = light - surfels.centers
    scale = float(SOFTENING) * surfels.scales.prod(dim=1).sqrt()
    cosine = (d * surfels.normals).sum(dim=1).clamp(min=0.0)
    return cosine / (d.square().sum(dim=1).square() + scale.pow(4)).pow(0.75)


def test_inverse_square_and_cosine() -> None:
    """E = cosθ/r² on a plane, for distances far above the softening."""
    points, normals = rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0], 0.02)
    light = torch.tensor([[0.1, 0.2, 0.7]], dtype=torch.float64)
    irradiance, _ = unit_irradiance(SurfelBvh(surfels_on(points, normals, 0.02).to(torch.float32)), light)
    d = light - points
    # Measured 4e-7; the softening ε = half a scale takes ¾(ε/r)⁴.
    torch.testing.assert_close(irradiance[0].double(), d[:, 2] / d.norm(dim=1) ** 3, rtol=5e-6, atol=0)


@pytest.mark.parametrize("light", [[0.1, 0.2, 0.1], [-0.45, 0.3, 0.4], [0.0, 0.0, -0.48]])
def test_derivative_matches_finite_differences_of_the_closed_form(light: list[float]) -> None:
    surfels = closed_box(1 / 10)
    position, step = torch.tensor(light, dtype=torch.float64), 1e-6
    _, slope = unit_irradiance(SurfelBvh(surfels.to(torch.float32)), position[None], shadows=False)
    shifts = step * torch.eye(3, dtype=torch.float64)
    pairs = [(softened(position + shift, surfels), softened(position - shift, surfels)) for shift in shifts]
    expected = torch.stack([(ahead - behind) / (2.0 * step) for ahead, behind in pairs], dim=1)
    # Measured up to 5e-7 of the largest.
    assert float((slope[0] - expected).abs().max()) < 3e-6 * float(expected.abs().max())


def test_autograd_is_the_derivative(box: FrozenScene) -> None:
    light = torch.tensor([[0.1, 0.2, 0.1]], requires_grad=True)
    weights = torch.rand(len(box.surfels), generator=torch.Generator().manual_seed(0))
    (rig_irradiance(box.bvh, (PointLight(light[0], 1.0),))[:, 0] * weights).sum().backward()
    _, slope = box.unit_irradiance(light.detach())
    expected = (slope[0] * weights[:, None]).sum(dim=0)
    # Measured 1e-6: float32 sums of terms that cancel, in two orders.
    torch.testing.assert_close(light.grad[0], expected, rtol=0, atol=1e-5 * float(expected.norm()))


def test_lights_add_up_and_are_linear_in_intensity(box: FrozenScene) -> None:
    a = PointLight(torch.tensor([0.1, 0.2, 0.1]), torch.tensor([1.0, 2.0, 3.0]))
    b = PointLight(torch.tensor([-0.2, 0.0, 0.3]), torch.tensor([0.5, 0.1, 0.2]))
    twice = PointLight(a.position, 2.0 * a.intensity)
    together, alone = box.radiance_of((a, b)), box.radiance_of((a,)) + box.radiance_of((b,))
    # Measured 2e-7 of the largest, and none at all.
    assert float((together - alone).abs().max()) < 2e-6 * float(alone.max())
    assert torch.equal(box.radiance_of((twice,)), 2.0 * box.radiance_of((a,)))


def test_shadow_of_a_screen() -> None:
    """Behind an opaque screen it is dark, beside it light; the penumbra is as wide as the surfels are soft."""
    floor, up = rectangle([-1, -1, 0], [2, 0, 0], [0, 2, 0], 0.05)
    screen, down = rectangle([-0.5, -0.5, 0.5], [0, 1, 0], [1, 0, 0], 0.02)
    bvh = SurfelBvh(surfels_on(torch.cat([floor, screen]), torch.cat([up, down]), 0.03).to(torch.float32))
    lit, irradiance = (unit_irradiance(bvh, torch.tensor([[0.0, 0.0, 2.0]]), shadows)[0] for shadows in (False, True))
    share = (irradiance / lit)[0, : len(floor)]
    reach = floor[:, :2].abs().amax(dim=1)
    edge = 0.5 * 2.0 / 1.5  # the screen's half-width, projected from the light onto the floor
    # Measured 0 and 1.
    assert float(share[reach < edge - 0.1].max()) < 1e-3
    assert float(share[reach > edge + 0.1].min()) > 1.0 - 1e-3
