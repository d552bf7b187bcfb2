"""What is proved about shadows and sight without rays holds for the rays."""

from __future__ import annotations

import pytest
import torch

from rgspipe.benchmark.effect_scenes import ball
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.gather import build_gather
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.mutual_visibility import MutualVisibility, mutual_visibility
from rgspipe.scene import Surfels
from rgspipe.scene.rectangles import inside_of_box, rectangle, solid_box, surfels_on

FLOOR = rectangle([-0.5, -0.5, 0.0], [1, 0, 0], [0, 1, 0], [0.5] * 3)


def lights(count: int) -> torch.Tensor:
    """All around, half of them within a tenth of the surface of a scene of diameter 1."""
    generator = torch.Generator().manual_seed(0)
    directions = torch.nn.functional.normalize(torch.randn(count, 3, generator=generator), dim=1)
    radius = torch.where(torch.arange(count) % 2 == 0, 0.5 + 0.1 * torch.rand(count, generator=generator), 2.0)
    return directions * radius[:, None]


@pytest.mark.parametrize(
    "surfels",
    [ball(3000, 0.5), surfels_on(FLOOR, 400), surfels_on(FLOOR, 1)],
    ids=["ball", "floor", "few surfels"],
)
def test_where_nothing_is_exposed_no_ray_meets_anything(surfels: Surfels) -> None:
    assert mutual_visibility(surfels) == MutualVisibility(shadow=False, sight=False)
    bvh = SurfelBvh(surfels.to(torch.float32))
    shaded, clear = (unit_irradiance(bvh, lights(64), shadows=on)[0] for on in (True, False))
    assert float(clear.max()) > 0.0 and torch.equal(shaded, clear)
    assert float(build_gather(bvh, 64, seed=0).to_scipy().sum()) == 0.0


def test_what_blocks_light_from_behind_is_not_seen_but_shades() -> None:
    """A screen over a floor that faces the same way: its back is not met by gather rays, but stops light."""
    screen = rectangle([-0.1, -0.1, 0.3], [0.2, 0, 0], [0, 0.2, 0], [0.5] * 3)
    assert mutual_visibility(surfels_on(FLOOR + screen, 400)) == MutualVisibility(shadow=True, sight=False)


@pytest.mark.parametrize("count", [300, 1500])
def test_scenes_that_face_themselves_are_exposed(count: int) -> None:
    for surfaces in (
        inside_of_box([0, 0, 0], [1, 1, 1], [0.5] * 3),
        FLOOR + solid_box([0, 0, 0.2], [0.2] * 3, [0.5] * 3),
    ):
        assert mutual_visibility(surfels_on(surfaces, count)) == MutualVisibility(shadow=True, sight=True)


def test_one_small_thing_on_a_convex_object_is_not_missed() -> None:
    """An upright rectangle of 1/300 of the surface."""
    antenna = rectangle([0.0, 0.0, 0.5], [0.05, 0, 0], [0, 0, 0.1], [0.5] * 3)
    one, many = surfels_on(antenna, 8), ball(2600, 0.5)
    parts = {name: torch.cat([many.tensors()[name], one.tensors()[name]]) for name in many.tensors()}
    assert mutual_visibility(Surfels(**parts, coverage=many.coverage)) == MutualVisibility(shadow=True, sight=True)


def test_no_surfel_and_one_surfel_are_exposed_to_nothing() -> None:
    surfels = ball(3000, 0.5)
    for count in (0, 1):
        few = Surfels(**{name: tensor[:count] for name, tensor in surfels.tensors().items()}, coverage=surfels.coverage)
        assert mutual_visibility(few) == MutualVisibility(shadow=False, sight=False)


@pytest.mark.parametrize(("scale", "offset"), [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e4)])
def test_the_proof_does_not_depend_on_size_or_place(scale: float, offset: float) -> None:
    one = ball(3000, 0.5)
    tensors = one.tensors() | {"centers": scale * one.centers + offset, "scales": scale * one.scales}
    assert mutual_visibility(Surfels(**tensors, coverage=one.coverage)) == MutualVisibility(shadow=False, sight=False)
