"""Form factors between squares against their closed forms, and the gather's reciprocity."""

from __future__ import annotations

import math

import pytest
import torch
from torch import Tensor

from rgspipe.renderer.areas import surfel_areas
from rgspipe.renderer.clusters import cluster_patches
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.gather import build_gather
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.rectangles import Rectangles, inside_of_box, rectangle, surfels_on

GREY = [0.5, 0.5, 0.5]

#: Surfels along each side of a unit square.
SIDE = 20


def parallel_squares(distance: float) -> float:
    """Form factor of facing unit squares (Howell, A Catalog of Radiation Heat Transfer Configuration Factors, C-11)."""
    x = 1.0 / distance
    root = math.sqrt(1.0 + x * x)
    logarithm = 0.5 * math.log((1.0 + x * x) ** 2 / (1.0 + 2.0 * x * x))
    return 2.0 / (math.pi * x * x) * (logarithm + 2.0 * x * root * math.atan(x / root) - 2.0 * x * math.atan(x))


def adjacent_rectangles(height: float, width: float) -> float:
    """From a rectangle `width` deep to one `height` high across an edge of length 1 that they share (Howell, C-14)."""
    h, w, s = height**2, width**2, height**2 + width**2
    root = math.sqrt(s)
    logarithm = math.log((1.0 + w) * (1.0 + h) / (1.0 + s))
    logarithm += w * math.log(w * (1.0 + s) / ((1.0 + w) * s)) + h * math.log(h * (1.0 + s) / ((1.0 + h) * s))
    angles = width * math.atan(1.0 / width) + height * math.atan(1.0 / height) - root * math.atan(1.0 / root)
    return (angles + 0.25 * logarithm) / (math.pi * width)


def perpendicular_squares(gap: float) -> float:
    """From a unit wall to a unit square of floor that begins `gap` from its foot: a difference of two strips."""
    near = adjacent_rectangles(gap, 1.0) if gap > 0.0 else 0.0
    return adjacent_rectangles(1.0 + gap, 1.0) - near


def sampled(two_squares: Rectangles) -> tuple[float, float]:
    """Mean share of its hemisphere that each of two squares sees of the other, from the gather operator."""
    frozen = FrozenScene.freeze(surfels_on(two_squares, 2 * SIDE**2), gather_rays=512, patches=20, seed=0)
    first = torch.arange(len(frozen.surfels)) < SIDE**2
    return seen(frozen, first, ~first), seen(frozen, ~first, first)


def seen(frozen: FrozenScene, group: Tensor, other: Tensor) -> float:
    rows = (frozen.gather.matrix @ other.float()[:, None])[group, 0]
    return float((rows * frozen.areas[group]).sum() / frozen.areas[group].sum())


def test_closed_forms_have_their_tabulated_values() -> None:
    """Squares of a cube: 0.1998 across, 0.2000 beside, and together the whole hemisphere."""
    assert parallel_squares(1.0) == pytest.approx(0.199825, abs=1e-6)
    assert adjacent_rectangles(1.0, 1.0) == pytest.approx(0.200044, abs=1e-6)
    assert parallel_squares(1.0) + 4.0 * adjacent_rectangles(1.0, 1.0) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("distance", [0.5, 1.0, 2.0])
def test_parallel_squares(distance: float) -> None:
    floor = rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0], GREY)
    ceiling = rectangle([0, 0, distance], [0, 1, 0], [1, 0, 0], GREY)
    # Measured +1.2, +1.1 and +0.6 %: a square's edges reach 0.05 of the surfels' spacing too far, 1.1 % of its area.
    assert sampled(floor + ceiling) == pytest.approx([parallel_squares(distance)] * 2, rel=0.02)


@pytest.mark.parametrize("gap", [0.0, 0.25, 1.0])
def test_perpendicular_squares(gap: float) -> None:
    wall = rectangle([0, 0, 0], [0, 1, 0], [0, 0, 1], GREY)
    floor = rectangle([gap, 0, 0], [1, 0, 0], [0, 1, 0], GREY)
    # Measured up to 0.1, 1.5 and 1.0 %.
    assert sampled(wall + floor) == pytest.approx([perpendicular_squares(gap)] * 2, rel=0.025)


def test_reciprocity_comes_with_more_rays() -> None:
    """A_i F_ij = A_j F_ji between patches of the sampled operator; what is left is due to the surfels' size."""
    bvh = SurfelBvh(surfels_on(inside_of_box([0, 0, 0], [1, 1, 1], GREY), 600).to(torch.float32))
    areas = surfel_areas(bvh, samples=512, seed=0)
    labels = torch.from_numpy(cluster_patches(bvh.surfels.centers, bvh.surfels.normals, 24, seed=0)).long()
    member = torch.nn.functional.one_hot(labels).float()

    def defect(rays: int) -> float:
        flow = areas[:, None] * (build_gather(bvh, rays, seed=0).matrix.to_dense() @ member)
        between = member.T @ flow
        return float((between - between.T).norm() / between.norm())

    few, more, most = defect(16), defect(64), defect(1024)
    # Measured 0.112, 0.048 and 0.0375.
    assert more < 0.55 * few
    assert most < 0.05
