"""The operators of hard scenes: gather, areas, view weights and bounces, in float32 against float64."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from double_precision import DoubleTransport, in_double, solve_radiosity
from hard_cases import CAMERAS, DEEP, GEOMETRIES, SCENES, HardScene, camera
from rgspipe.renderer import reference
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.radiosity import solve_radiosity as solve_in_single
from rgspipe.renderer.rays import SURFACE_SHARE
from rgspipe.renderer.view_weights import build_view_weights, nearest_hit

#: Scenes that are the plain one at another size or place: with the same draws their operators are the same.
MOVED = ("size 1e-3", "size 1e3", "1e4 from the origin")


@pytest.fixture(scope="module")
def frozen() -> dict[str, FrozenScene]:
    return {}


def freeze(kept: dict[str, FrozenScene], name: str) -> FrozenScene:
    """Each scene is frozen once."""
    if name not in kept:
        rays = 4 if name in DEEP else 16
        kept[name] = FrozenScene.freeze(SCENES[name].build(), gather_rays=rays, patches=20, seed=0)
    return kept[name]


@pytest.mark.parametrize("name", GEOMETRIES)
def test_gather_rows_are_shares_of_a_hemisphere(frozen: dict[str, FrozenScene], name: str) -> None:
    scene = freeze(frozen, name)
    matrix = scene.gather.matrix.to_dense().double()
    assert torch.isfinite(matrix).all() and torch.isfinite(scene.areas).all()
    if len(matrix) == 0:
        return
    assert float(matrix.min()) >= 0.0 and float(scene.areas.min()) >= 0.0
    # So no eigenvalue is above 1 either. Measured 1 + 2e-7.
    assert float(matrix.sum(dim=1).max()) <= 1.0 + 1e-5


@pytest.mark.parametrize("name", MOVED)
def test_gather_and_areas_do_not_depend_on_size_and_place(frozen: dict[str, FrozenScene], name: str, within) -> None:
    """The plain room's operators at its own place stand for float64: they are held against it above."""
    plain, moved, size = freeze(frozen, "plain"), freeze(frozen, name), SCENES[name].size
    rows = [scene.gather.matrix.to_dense() for scene in (moved, plain)]
    # A ray in a few thousand meets the rim of a footprint and falls on its other side.
    within("gather", *rows, 1e-5, outliers=1e-3, cap=5e-2)
    within("areas", moved.areas / size**2, plain.areas, 1e-4, outliers=0.02, cap=2e-2)


def pixel_weights(scene: HardScene, name: str) -> tuple[Tensor, Tensor]:
    """(P, N) weights of the pixels of a camera, one ray each, in float32 and in float64."""
    surfels, seen = scene.build(), camera(name, scene)
    bvh = SurfelBvh(surfels)
    view = build_view_weights(bvh, seen, supersampling=1)
    origins, directions, _ = seen.rays()
    weights, passing = reference.composite_dense(in_double(surfels), origins, directions, nearest_hit(bvh))
    stopped = 1.0 - passing
    gain = torch.where(stopped > SURFACE_SHARE, 1.0 / stopped.clamp(min=SURFACE_SHARE), torch.ones_like(stopped))
    assert torch.isfinite(view.coverage).all()
    return view.operator.matrix.to_dense(), weights * gain[:, None]


@pytest.mark.parametrize("name", [name for name in GEOMETRIES if name not in DEEP])
def test_view_weights_of_hard_scenes(name: str, within) -> None:
    found, expected = pixel_weights(SCENES[name], "plain")
    if name == "coincident duplicates":
        half = found.shape[1] // 2
        found, expected = (w[:, :half] + w[:, half:] for w in (found, expected))
    within("pixels", found, expected, 2e-6, outliers=1e-3, cap=5e-4)


@pytest.mark.parametrize("name", CAMERAS)
def test_view_weights_of_hard_cameras(name: str, within) -> None:
    scene = SCENES["a solid" if name == "in a solid" else "plain"]
    found, expected = pixel_weights(scene, name)
    within("pixels", found, expected, 2e-6, outliers=1e-3, cap=5e-4)
    if name == "looking at nothing":
        assert float(found.abs().max()) == 0.0


def lightings(count: int) -> Tensor:
    """(N, 2) irradiances, some of them dark."""
    values = torch.rand(count, 2, generator=torch.Generator().manual_seed(1))
    return torch.where(values < 0.3, torch.zeros_like(values), values)


def compare_radiance(scene: FrozenScene, lit: Tensor, within) -> None:
    """Patch transport and the solve by bounces, values and gradients."""
    single, double = lit.clone().requires_grad_(), lit.double().requires_grad_()
    found, expected = scene.radiance(single), DoubleTransport.of(scene).radiance(double)
    within("radiance", found, expected, 2e-5)
    for value in (found, expected):
        value.square().sum().backward()
    within("gradient", single.grad, double.grad, 2e-5)


@pytest.mark.parametrize("name", SCENES)
def test_patch_transport(frozen: dict[str, FrozenScene], name: str, within) -> None:
    scene = freeze(frozen, name)
    compare_radiance(scene, lightings(len(scene.surfels)), within)


@pytest.mark.parametrize("name", SCENES)
def test_the_solve_by_bounces(frozen: dict[str, FrozenScene], name: str, within) -> None:
    """To the tolerance that it is asked for, at albedo 1 as well: there it counts as 0.999."""
    scene, tolerance = freeze(frozen, name), 1e-5
    albedo, direct = scene.surfels.albedo[:, :2], lightings(len(scene.surfels))
    single, double = direct.clone().requires_grad_(), direct.double().requires_grad_()
    found = solve_in_single(scene.gather, albedo, single, tolerance)
    expected = solve_radiosity(scene.gather.matrix.to_dense().double(), albedo.double(), double)
    within("radiosity", found, expected, 1e-4)
    for value in (found, expected):
        value.square().sum().backward()
    within("gradient", single.grad, double.grad, 2e-4)


def test_light_in_a_closed_white_room_stays_bounded(frozen: dict[str, FrozenScene]) -> None:
    """Albedo 1 counts as 0.999: the room holds at most a thousand times the direct light."""
    scene = freeze(frozen, "albedo 1")
    lit = lightings(len(scene.surfels))
    ratio = float(scene.radiance(lit).mean()) / float(scene.radiance(lit, indirect=False).mean())
    assert 10.0 < ratio < 1100.0  # measured 1002
