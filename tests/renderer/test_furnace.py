"""Furnaces: closed rooms whose light is known in closed form."""

from __future__ import annotations

import math

import pytest
import torch

from rgspipe.names import Solver
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.radiosity import GatherSolver, solve_radiosity_directly
from rgspipe.renderer.transport import with_albedo
from rgspipe.scene import PointLight
from rgspipe.scene.rectangles import inside_of_box, surfels_on
from rooms import sphere

ALBEDOS = [0.1, 0.3, 0.5, 0.7, 0.9, 0.99]


@pytest.fixture(scope="module")
def box() -> FrozenScene:
    room = surfels_on(inside_of_box([0, 0, 0], [1, 1, 1], [0.5, 0.5, 0.5]), 1000)
    return FrozenScene.freeze(room, gather_rays=64, patches=150, seed=0)


@pytest.fixture(scope="module")
def globe() -> FrozenScene:
    return FrozenScene.freeze(sphere(2000), gather_rays=64, patches=150, seed=0)


@pytest.mark.parametrize("albedo", ALBEDOS)
@pytest.mark.parametrize("solver", ["patches", "gather", "directly"])
def test_closed_box_with_uniform_emission(box: FrozenScene, solver: str, albedo: float) -> None:
    """B = E/(1 − ρ), whatever the shape of the room, everywhere in it."""
    emission = torch.ones(len(box.surfels), 3, 1)
    rho = torch.full((len(box.surfels), 3), albedo)
    if solver == "patches":
        radiosity = emission + with_albedo(box.transport, rho).indirect(emission)
    elif solver == "gather":
        radiosity = emission + GatherSolver(box.gather, rho, tolerance=1e-6).indirect(emission)
    else:
        radiosity = solve_radiosity_directly(box.gather, rho[:, :1], emission[:, 0]).float()[..., None]
    # Measured at 0.99: patches 6e-7, gather 3e-6, directly 2e-7; the others are smaller.
    torch.testing.assert_close((1.0 - albedo) * radiosity, torch.ones_like(radiosity), rtol=3e-5, atol=0)


@pytest.mark.parametrize("solver", ["patches", "gather"])
def test_pbrt_s_furnace(globe: FrozenScene, solver: Solver) -> None:
    """A unit sphere of albedo 0.5 around a point light of intensity π: radiance 1, and 0.5 of it directly."""
    light = (PointLight(torch.zeros(3), torch.full((3,), math.pi)),)
    direct = globe.radiance_of(light, Effects(interreflection=False))
    total = globe.with_solver(solver).radiance_of(light)
    # Measured 4e-6 (direct, and total by patches) and 3.5e-5 (total by gather, whose bounces end there).
    torch.testing.assert_close(direct, torch.full_like(direct, 0.5), rtol=2e-5, atol=0)
    torch.testing.assert_close(total, torch.full_like(total, 1.0), rtol=2e-4, atol=0)


@pytest.mark.parametrize("solver", ["patches", "gather"])
@pytest.mark.parametrize("bounces", [0, 1, 2, 3, 8])
def test_every_bounce_of_the_furnace_adds_half_of_the_one_before(
    globe: FrozenScene, solver: Solver, bounces: int
) -> None:
    light = (PointLight(torch.zeros(3), torch.full((3,), math.pi)),)
    total = globe.with_solver(solver, bounces=bounces).radiance_of(light)
    expected = sum(0.5 ** (k + 1) for k in range(bounces + 1))
    # Measured 4e-6.
    torch.testing.assert_close(total, torch.full_like(total, expected), rtol=3e-5, atol=0)
