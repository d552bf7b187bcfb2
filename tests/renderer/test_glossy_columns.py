"""Value and derivatives of a unit light in one pass are those of autograd, from every side."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.glossy_columns import unit_light_columns
from rgspipe.scene import Gloss, PointLight
from rooms import closed_box

EYE = torch.tensor([-0.3, 0.25, 0.2])


@pytest.fixture(scope="module")
def room() -> FrozenScene:
    box = closed_box(1 / 8)
    colours = torch.tensor([0.4, 0.2, 0.1], dtype=torch.float64) * (torch.arange(len(box)) % 2)[:, None]
    gloss = Gloss(colours, torch.linspace(1.0, 40.0, len(box), dtype=torch.float64))
    return FrozenScene.freeze(replace(box, gloss=gloss), gather_rays=32, patches=60, seed=0)


@pytest.mark.parametrize("indirect", [False, True])
def test_columns_are_radiance_and_its_derivatives(room: FrozenScene, indirect: bool) -> None:
    position = torch.tensor([0.1, -0.2, 0.15])
    irradiance, slope = room.unit_irradiance(position[None])
    columns = unit_light_columns(room.gloss, room.transport, position, irradiance[0], slope[0], indirect)
    found = columns.seen_from(EYE)

    def radiance(place: torch.Tensor) -> torch.Tensor:
        return room.glossy_light((PointLight(place, torch.ones(3)),), Effects(interreflection=indirect)).seen_from(EYE)

    weights = torch.rand(5, len(room.surfels), 3, generator=torch.Generator().manual_seed(0))
    slopes = torch.autograd.functional.jacobian(lambda p: (weights * radiance(p)).sum(dim=(1, 2)), position)
    torch.testing.assert_close(found[..., 0], radiance(position), rtol=1e-5, atol=1e-6)
    expected = torch.einsum("wnc,ncl->wl", weights, found[..., 1:])
    # Measured 3e-6 of the largest: sums of terms that cancel, in two orders.
    torch.testing.assert_close(expected, slopes, rtol=0, atol=2e-5 * float(slopes.abs().max()))


@pytest.mark.parametrize("height", [0.0, 1e-6, -1e-6, 0.03])
def test_columns_are_finite_for_a_light_on_a_glossy_surfel(room: FrozenScene, height: float) -> None:
    index = room.gloss.glossy[10]
    position = room.surfels.centers[index] + height * room.surfels.normals[index]
    irradiance, slope = room.unit_irradiance(position[None])
    columns = unit_light_columns(room.gloss, room.transport, position, irradiance[0], slope[0])
    assert torch.isfinite(columns.seen_from(position)).all()
