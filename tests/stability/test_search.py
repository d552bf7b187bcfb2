"""Hypothesis looks for hard cases that nobody thought of: shading, light and spots on any soup of surfels.

Everything must be finite for scales over twelve decades. Float32 may fall on the other side of a jump (a footprint's
rim, a layer's end, a hard edge), so an error counts only where the float64 result itself stands still when its input
moves by ten times the rounding of float32; and only for surfels at least 1e-4 wide, in which float32 can place a ray.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from double_precision import in_double, irradiance_and_slope
from rgspipe.renderer import reference
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.kernels.shade import shade_rays
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.rig import unit_response
from rgspipe.scene import NO_CLIP, Coverage, SpotLight, Surfels

#: How far inputs move to see where the result stands still: a little and more, as jumps lie near or far.
SHAKES = (1e-7, 5e-7, 2e-6, 1e-7, 5e-7, 2e-6, 2e-6, 2e-6)

GEOMETRY = ("centers", "rotations", "scales", "opacities", "clip_offsets", "clip_angles")


def search(examples: int) -> Callable:
    return settings(max_examples=examples, derandomize=True, deadline=None, database=None)


def vectors(low: float = -1.0, high: float = 1.0) -> st.SearchStrategy[list[float]]:
    return st.lists(st.floats(low, high, width=32), min_size=3, max_size=3)


#: Axis-parallel, degenerate and any quaternions.
TURNS = st.one_of(
    st.sampled_from([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.5, 0.5, 0.5, 0.5], [1.0, 1e-4, 0.0, 0.0]]),
    st.lists(st.floats(0.125, 1.0, width=32), min_size=4, max_size=4),
)


def surfel(smallest: float) -> st.SearchStrategy[tuple]:
    """Centre, quaternion, decimal logarithms of the scales, opacity, and the offset and angle of a clip."""
    return st.tuples(
        vectors(),
        TURNS,
        st.tuples(st.floats(smallest, 3.0), st.floats(smallest, 3.0)),
        st.sampled_from([0.0, 1e-3, 0.0101, 0.3, 0.9, 0.999, 1.0]),
        st.tuples(st.sampled_from([NO_CLIP, 0.0, 0.5, -0.5, 5.0]), st.floats(0.0, 6.0)),
    )


COVERAGE = st.tuples(
    st.sampled_from([(0.0, 1.0), (0.5, 0.9), (0.05, 0.3), (0.7, 0.99)]), st.floats(-6.0, 1.0), st.floats(-6.0, 0.0)
)


def tensor(values: object) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)


@st.composite
def soups(draw: st.DrawFn, smallest: float = -9.0) -> Surfels:
    """One to seven surfels with scales from 10^smallest to 1e3; some stand twice."""
    chosen = draw(st.lists(surfel(smallest), min_size=1, max_size=6))
    chosen += chosen[: draw(st.integers(0, 1))]
    centers, turns, exponents, opacities, clips = zip(*chosen, strict=True)
    (low, high), thickness, softness = draw(COVERAGE)
    scales = 10.0 ** tensor(exponents)
    clip = tensor(clips)
    return Surfels(
        centers=tensor(centers),
        rotations=torch.nn.functional.normalize(tensor(turns), dim=1),
        scales=scales,
        opacities=tensor(opacities),
        albedo=torch.full((len(chosen), 3), 0.5, dtype=torch.float64),
        clip_offsets=torch.stack([clip[:, 0] * scales[:, 0], torch.full_like(clip[:, 0], NO_CLIP)], dim=1),
        clip_angles=torch.stack([clip[:, 1], torch.zeros_like(clip[:, 1])], dim=1),
        coverage=Coverage(low=low, high=high, layer_thickness=10.0**thickness, clip_softness=10.0**softness),
    )


def shaken(surfels: Surfels) -> list[Surfels]:
    """Copies with other centres and rotations."""
    generator = torch.Generator().manual_seed(0)
    return [_shaken(surfels, size, generator) for size in SHAKES]


def _shaken(surfels: Surfels, size: float, generator: torch.Generator) -> Surfels:
    noise = torch.randn(surfels.centers.shape, generator=generator, dtype=torch.float64)
    turn = torch.randn(surfels.rotations.shape, generator=generator, dtype=torch.float64)
    return replace(surfels, centers=surfels.centers + size * noise, rotations=surfels.rotations + size * turn)


def assert_agrees(found: Tensor, expected: Tensor, others: list[Tensor], bound: float, rounding: float = 1e-30) -> None:
    """Finite; within `bound` of the largest value, twice what float64 itself moves by, and `rounding`."""
    assert torch.isfinite(found).all()
    moved = torch.stack([(other - expected).abs() for other in others]).amax(dim=0)
    allowed = bound * float(expected.abs().max()) + 2.0 * moved + rounding
    worst = ((found.double() - expected).abs() / allowed).max()
    assert float(worst) <= 1.0, f"{float(worst):.1f} times what is allowed"


def ray_bundle(surfels: Surfels, origin: list[float]) -> tuple[Tensor, Tensor]:
    """Rays from a point at every surfel's centre, beside it, within its plane and along its normal."""
    start = tensor(origin)
    frames = in_double(surfels).frames
    to_center = surfels.centers - start + 1e-3 * tensor([0.3, 0.2, 0.1])
    beside = to_center + frames[:, 0] * surfels.scales[:, :1].clamp(max=1.0)
    directions = torch.cat([to_center, beside, frames[:, 0], -frames[:, 2]])
    origins = torch.cat([start.expand(len(surfels) * 3, 3), surfels.centers + 0.1 * frames[:, 2]])
    return origins, torch.nn.functional.normalize(directions, dim=1)


def shade_in_double(surfels: Surfels, radiance: Tensor, origins: Tensor, directions: Tensor) -> dict[str, Tensor]:
    """Colours and gradients of their sum, scales by their logarithm."""
    return _shade(in_double(surfels), radiance, origins, directions, kernel=False)


def _shade(surfels: Surfels, radiance: Tensor, origins: Tensor, directions: Tensor, kernel: bool) -> dict[str, Tensor]:
    leaves = {name: getattr(surfels, name).clone().requires_grad_() for name in GEOMETRY}
    surfels = replace(surfels, **leaves)
    coverage, dtype = surfels.coverage, surfels.centers.dtype
    arguments = (
        surfels,
        torch.tensor([coverage.low, coverage.high], dtype=dtype, requires_grad=True),
        radiance.float() if kernel else radiance,
        origins,
        directions,
        torch.zeros(len(origins), dtype=torch.int32),
    )
    colours = shade_rays(SurfelBvh(surfels), *arguments) if kernel else reference.shade_rays(*arguments)
    if colours.requires_grad:  # the reference has no graph where no ray meets anything
        colours.sum().backward()
    gradients = {name: torch.zeros_like(x) if x.grad is None else x.grad for name, x in leaves.items()}
    unit = leaves["rotations"].detach()
    turn = gradients["rotations"]
    gradients["rotations"] = turn - (turn * unit).sum(dim=1, keepdim=True) * unit
    return {"colours": colours.detach(), **gradients}


@search(100)
@given(surfels=soups(), origin=vectors())
def test_shading_of_any_soup_is_finite(surfels: Surfels, origin: list[float]) -> None:
    radiance = torch.ones(1, len(surfels), 3, dtype=torch.float64)
    found = _shade(surfels, radiance, *ray_bundle(surfels, origin), kernel=True)
    assert all(torch.isfinite(value).all() for value in found.values())
    assert float(found["colours"].min()) >= 0.0 and float(found["colours"].max()) <= 1.0 + 1e-5


@search(40)
@given(surfels=soups(smallest=-4.0), origin=vectors())
def test_shading_of_any_soup_agrees_with_float64(surfels: Surfels, origin: list[float]) -> None:
    generator = torch.Generator().manual_seed(0)
    origins, directions = ray_bundle(surfels, origin)
    radiance = torch.rand(1, len(surfels), 3, generator=generator, dtype=torch.float64)
    found = _shade(surfels, radiance, origins, directions, kernel=True)
    expected = shade_in_double(surfels, radiance, origins, directions)
    others = [shade_in_double(moved, radiance, origins, directions) for moved in shaken(surfels)]
    # Where a ray meets the very middle of a surfel, its turn changes nothing; float32 finds what is rounding of the
    # colours that are added up, 6e-8 of the radiance each: measured 3.8e-7, of 36 of them.
    rounding = 6e-8 * found["colours"].numel() * float(radiance.max())
    for name, value in found.items():
        floor = rounding if name == "rotations" else 1e-30
        assert_agrees(value, expected[name], [other[name] for other in others], 1e-4, floor)


#: A light by its direction and distance, or exactly on the first surfel.
PLACES = st.one_of(st.none(), st.tuples(vectors(), st.sampled_from([1.0, 1e3, 1e6])))


def place(surfels: Surfels, light: tuple[list[float], float] | None) -> Tensor:
    return surfels.centers[0].clone() if light is None else light[1] * tensor(light[0])


@search(100)
@given(surfels=soups(), light=PLACES)
def test_light_on_any_soup_is_finite(surfels: Surfels, light: tuple[list[float], float] | None) -> None:
    irradiance, slope = unit_irradiance(SurfelBvh(surfels), place(surfels, light)[None])
    assert torch.isfinite(irradiance).all() and torch.isfinite(slope).all()
    assert float(irradiance.min()) >= 0.0


@search(30)
@given(surfels=soups(smallest=-4.0), light=PLACES)
def test_light_on_any_soup_agrees_with_float64(surfels: Surfels, light: tuple[list[float], float] | None) -> None:
    position = place(surfels, light)
    irradiance, slope = unit_irradiance(SurfelBvh(surfels), position[None])
    expected, exact = irradiance_and_slope(in_double(surfels), position)
    others = [irradiance_and_slope(in_double(moved), position) for moved in shaken(surfels)]
    assert_agrees(irradiance[0], expected, [other[0] for other in others], 1e-4)
    assert_agrees(slope[0], exact, [other[1] for other in others], 1e-4)


@search(100)
@given(
    profile=st.sampled_from(["gaussian", "smoothstep", "linear"]),
    cone=st.one_of(st.sampled_from([0.0, math.pi / 2, math.pi]), st.floats(0.0, math.pi)),
    falloff=st.one_of(st.just(0.0), st.floats(1e-6, 1.0)),
    axis=vectors(),
    length=st.sampled_from([1e-6, 1.0, 1e6]),
    position=vectors(),
    surfels=soups(smallest=-4.0),
)
def test_any_spot_on_any_soup(
    profile: str, cone: float, falloff: float, axis: list[float], length: float, position: list[float], surfels: Surfels
) -> None:
    """Response and derivatives of a spot are finite, and its profile agrees with float64 where that stands still."""
    direction = tensor(axis)
    if float(direction.norm()) < 1e-3:
        direction = tensor([0.0, 0.0, 1.0])
    where = tensor(position)
    light = SpotLight(where, tensor([1.0, 1.0, 1.0]), (length * direction).requires_grad_(), profile, cone, falloff)
    bvh = SurfelBvh(surfels)
    response = unit_response(bvh, (light,), Effects(shadows=False))
    assert response.slopes[0].shape[1] == 6
    for value in (response.irradiance, *response.slopes):
        assert torch.isfinite(value).all()
    point, _ = unit_irradiance(bvh, where[None], shadows=False)
    unit = replace(light, direction=torch.nn.functional.normalize(direction, dim=0))
    expected = unit.relative_intensity_towards(surfels.centers)
    others = [unit.relative_intensity_towards(moved.centers) for moved in shaken(surfels)]
    lit = point[0] > 0
    relative = torch.where(lit, response.irradiance[0] / torch.where(lit, point[0], 1.0), expected.float())
    assert_agrees(relative, expected, others, 1e-5)
