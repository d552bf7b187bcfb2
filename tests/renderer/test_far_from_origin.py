"""A scene 1e4 of its sizes away from the origin is lit as it is at the origin, from freezing to derivatives."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import Tensor

from hard_cases import INSIDE, room
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight, SpotLight

#: Where a float32 is rounded to 1e-3, a sixtieth of a surfel's spacing.
AWAY = torch.tensor([1e4, -1e4, 1e4], dtype=torch.float64)


def freeze(offset: Tensor) -> FrozenScene:
    surfels = room()
    moved = replace(surfels, centers=surfels.centers.double() + offset)
    return FrozenScene.freeze(moved, gather_rays=32, patches=60, seed=0)


@pytest.fixture(scope="module")
def near() -> FrozenScene:
    return freeze(torch.zeros(3, dtype=torch.float64))


@pytest.fixture(scope="module")
def far() -> FrozenScene:
    return freeze(AWAY)


def lit(frozen: FrozenScene, offset: Tensor) -> dict[str, Tensor]:
    """Radiance of a point and a spot, and derivatives of its sum."""
    inside = INSIDE.double()
    positions = (torch.stack([inside, -inside]) + offset).requires_grad_()
    axis = torch.tensor([0.3, 0.5, -1.0], dtype=torch.float64, requires_grad=True)
    intensities = torch.ones(2, 3, dtype=torch.float64, requires_grad=True)
    spot = SpotLight(positions[1], intensities[1], axis, "gaussian", 0.4, 0.3)
    radiance = frozen.radiance_of((PointLight(positions[0], intensities[0]), spot))
    radiance.sum().backward()
    return {
        "radiance": radiance.detach(),
        "positions": positions.grad,
        "axis": axis.grad,
        "intensity": intensities.grad,
    }


def test_light_and_its_derivatives_are_the_same(near: FrozenScene, far: FrozenScene) -> None:
    here, there = lit(near, torch.zeros(3, dtype=torch.float64)), lit(far, AWAY)
    for name, expected in here.items():
        error = float((there[name] - expected).norm() / expected.norm())
        # Measured 0; with centres rounded to float32 2e-3 of the radiance and 5e-3 of the derivative towards positions.
        assert error < 1e-5, name


def test_the_centres_are_stored(far: FrozenScene, tmp_path) -> None:
    far.save(tmp_path)
    loaded = FrozenScene.load(tmp_path)
    assert torch.equal(loaded.centers, far.centers)
    # Products with one lighting add in an order that depends on where a matrix lies in memory; measured: 2.3e-7.
    torch.testing.assert_close(lit(loaded, AWAY)["radiance"], lit(far, AWAY)["radiance"], rtol=2e-6, atol=0.0)
