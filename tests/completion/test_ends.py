"""Where faces end: at the convex edges of their thing, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from rgspipe.completion.ends import ends
from rgspipe.completion.unseen import SCALE
from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene.surfels import NO_CLIP, Coverage, Surfels, quaternion_from_normal, quaternion_to_axes

SPACING = 0.05

#: Half a side of the cube.
HALF = 0.5


def face(axis: int, sign: float, low: tuple[float, float], high: tuple[float, float], at: float = HALF):
    """Places (K, 3) one distance apart on a plane across an axis, from `low` to `high` along the others; normals."""
    a, b = (np.arange(one + 0.5 * SPACING, two, SPACING) for one, two in zip(low, high, strict=True))
    places = np.zeros((len(a) * len(b), 3))
    places[:, [i for i in range(3) if i != axis]] = np.stack(np.meshgrid(a, b), axis=-1).reshape(-1, 2)
    places[:, axis] = sign * at
    normal = np.zeros(3)
    normal[axis] = sign
    return places, np.broadcast_to(normal, places.shape)


def nowhere(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Offsets and angles of surfels of which no end is known."""
    return np.full((count, 2), NO_CLIP), np.zeros((count, 2))


def found(parts):
    """Places, normals, axes and ends of all surfels of some faces, which were guessed."""
    places, normals = (np.concatenate([part[index] for part in parts]) for index in (0, 1))
    axes = quaternion_to_axes(quaternion_from_normal(torch.from_numpy(normals))).numpy()[:, :2]
    return places, normals, axes, ends(places, normals, axes, *nowhere(len(places)), 0, SPACING)


def cut(parts, number: int) -> np.ndarray:
    """(K,) bool: the surfels of one of the faces that end somewhere."""
    *_, result = found(parts)
    first = sum(len(part[0]) for part in parts[:number])
    return result.offsets[first : first + len(parts[number][0]), 0] < NO_CLIP


def surfels_of(places, normals, offsets, angles, kept) -> Surfels:
    count = len(places)
    whole = Surfels(
        centers=torch.from_numpy(places),
        rotations=quaternion_from_normal(torch.from_numpy(normals)),
        scales=torch.full((count, 2), SCALE * SPACING),
        opacities=torch.full((count,), 0.95),
        albedo=torch.full((count, 3), 0.5),
        clip_offsets=torch.from_numpy(offsets),
        clip_angles=torch.from_numpy(angles),
        coverage=Coverage(0.5, 0.9, 0.6 * SPACING, 0.12 * SPACING),
    )
    return whole.to(torch.float32).selected(torch.from_numpy(kept.nonzero()[0]))


def widths_of(surfels: Surfels) -> np.ndarray:
    """(21,) how wide the cube is for rays that run past its sides, at as many heights, scene units."""
    across = torch.linspace(-0.7, 0.7, 1401)
    heights = torch.linspace(-0.3, 0.3, 21)
    y, z = (part.reshape(-1) for part in torch.meshgrid(across, heights, indexing="ij"))
    origins = torch.stack([torch.full_like(y, 2.0), y, z], dim=1)
    directions = torch.tensor([-1.0, 0.0, 0.0]).expand_as(origins)
    hits = composite(SurfelBvh(surfels), origins, directions, two_sided=True)
    return (hits.transmittance < 0.5).double().reshape(1401, 21).sum(dim=0).numpy() * 0.001


def width_of(surfels: Surfels) -> float:
    return float(widths_of(surfels).mean())


@pytest.mark.parametrize("over", [0.0, 0.9])
def test_faces_of_a_cube_end_at_its_edges_though_they_were_laid_past_them(over):
    """Seen along one face, of whose neighbours one goes on past the edge by almost a distance of surfels."""
    past = HALF + over * SPACING
    sides = [face(1, sign, (-HALF, -HALF), (past, HALF)) for sign in (1.0, -1.0)]
    parts = [face(0, 1.0, (-past, -HALF), (past, HALF)), *sides]
    places, normals, _, result = found(parts)
    plain = np.full(result.offsets.shape, NO_CLIP)
    before = width_of(surfels_of(places, normals, plain, result.angles, np.ones_like(result.kept)))
    after = width_of(surfels_of(places, normals, result.offsets, result.angles, result.kept))
    # Measured: too wide by 1.2 and 3.2 distances before, and by 0.02 and 0.00 after.
    assert before - 2.0 * HALF > SPACING
    assert abs(after - 2.0 * HALF) < 0.1 * SPACING


def test_a_face_is_cut_in_its_plane_in_the_direction_of_the_other():
    parts = [face(0, 1.0, (-HALF, -HALF), (HALF, HALF)), face(1, 1.0, (-HALF, -HALF), (HALF, HALF))]
    places, _, axes, result = found(parts)
    own = (result.offsets[:, 0] < NO_CLIP) & (np.arange(len(places)) < len(parts[0][0]))
    assert own.any()
    at = result.angles[own, 0]
    outward = np.cos(at)[:, None] * axes[own, 0] + np.sin(at)[:, None] * axes[own, 1]
    np.testing.assert_allclose(outward, np.broadcast_to([0.0, 1.0, 0.0], outward.shape), atol=1e-12)
    np.testing.assert_allclose(places[own, 1] + result.offsets[own, 0], HALF, atol=1e-12)
    assert (result.offsets[own, 1] == NO_CLIP).all()
    assert result.kept.all()


def test_at_a_corner_a_face_has_two_edges():
    parts = [face(axis, 1.0, (-HALF, -HALF), (HALF, HALF)) for axis in range(3)]
    places, _, _, result = found(parts)
    corner = np.linalg.norm(places - HALF, axis=1).argmin()
    np.testing.assert_allclose(result.offsets[corner], 0.5 * SPACING, atol=1e-12)


def test_walls_that_meet_in_a_corner_of_a_room_are_left_whole():
    outside = [face(axis, 1.0, (-HALF, -HALF), (HALF, HALF)) for axis in (0, 1)]
    parts = [(places, -normals) for places, normals in outside]
    assert not cut(parts, 0).any()
    assert not cut(parts, 1).any()


def test_a_face_that_another_only_touches_from_within_is_left_whole():
    """A box inside of another, as heaps have them: the outer face goes on past it."""
    outer, inner = face(0, 1.0, (-HALF, -HALF), (HALF, HALF)), face(1, 1.0, (-HALF, -HALF), (HALF, HALF), at=0.0)
    assert not cut([outer, inner], 0).any()


def seen_cube(errors: np.ndarray) -> tuple[Surfels, Surfels]:
    """Three faces of a cube that cameras saw, each surfel's ends off by one of `errors`; and as they end together."""
    sides = [face(1, sign, (-HALF, -HALF), (HALF, HALF)) for sign in (1.0, -1.0)]
    places, normals, _, whole = found([face(0, 1.0, (-HALF, -HALF), (HALF, HALF)), *sides])
    off = np.resize(errors, whole.offsets.shape)
    offsets = np.where(whole.offsets < NO_CLIP, np.maximum(whole.offsets + off, 0.1 * SPACING), NO_CLIP)
    photographed = surfels_of(places, normals, offsets, whole.angles, whole.kept).to(torch.float64)
    axes = quaternion_to_axes(photographed.rotations).numpy()[:, :2]
    result = ends(places, normals, axes, offsets, whole.angles, len(places), SPACING)
    return photographed, surfels_of(places, normals, result.offsets, result.angles, result.kept)


def test_surfels_that_cameras_saw_end_where_planes_meet_and_not_each_for_itself() -> None:
    photographed, cut = seen_cube(0.2 * SPACING * np.random.default_rng(3).standard_normal(4001))
    ragged, straight = (widths_of(surfels.to(torch.float32)) for surfels in (photographed, cut))
    # Measured: 0.13 distances of deviation before and none after; too wide by 0.02.
    assert ragged.std() > 0.1 * SPACING
    assert straight.std() < 0.02 * SPACING
    assert abs(straight.mean() - 2.0 * HALF) < 0.1 * SPACING


def test_a_surfel_that_was_seen_to_end_elsewhere_keeps_its_end() -> None:
    """Half a distance and more before the edge: something else is there."""
    photographed, cut = seen_cube(np.array([-0.6 * SPACING]))
    last = (photographed.clip_offsets[:, 0] < NO_CLIP) & (photographed.clip_offsets[:, 0] > 0.6 * SPACING)
    assert int(last.sum()) >= 60  # measured 80
    np.testing.assert_allclose(cut.clip_offsets[last, 0], photographed.clip_offsets[last, 0], atol=1e-6)


def last_row_beside(turns: float) -> np.ndarray:
    """Offsets, in distances, of a seen top's last surfels, which depth has end 0.7 on, where their edge is at 0.5; what
    is across has normals that are turned by `turns` [rad, standard deviation] about both axes.
    """
    top = face(2, 1.0, (-HALF, -HALF), (HALF, HALF))
    side, normals = face(0, 1.0, (-HALF, -HALF), (HALF, HALF))
    normals = normals + turns * np.random.default_rng(0).standard_normal(normals.shape) * [0.0, 1.0, 1.0]
    places = np.concatenate([top[0], side])
    normals = np.concatenate([top[1], normals / np.linalg.norm(normals, axis=1, keepdims=True)])
    axes = quaternion_to_axes(quaternion_from_normal(torch.from_numpy(normals))).numpy()[:, :2]
    offsets, angles = nowhere(len(places))
    last = np.flatnonzero(np.isclose(top[0][:, 0], HALF - 0.5 * SPACING))[3:-3]
    offsets[last, 0], angles[last, 0] = 0.7 * SPACING, np.arctan2(axes[last, 1, 0], axes[last, 0, 0])
    return ends(places, normals, axes, offsets, angles, len(places), SPACING).offsets[last, 0] / SPACING


def test_what_is_ragged_is_no_plane_at_which_a_seen_surface_ends() -> None:
    np.testing.assert_allclose(last_row_beside(0.0), 0.5, atol=1e-9)  # measured 5e-15
    known = last_row_beside(0.05)
    assert np.abs(known - 0.5).max() < 0.1  # measured 0.045
    np.testing.assert_allclose(last_row_beside(0.6), 0.7, atol=1e-9)  # measured 1e-16; of 0.4, 93 % keep their end


def seen_floor(gap: float, guess) -> tuple[np.ndarray, Surfels]:
    """Offsets of the last surfels of a floor that was seen to end at 0, with what was guessed `gap` distances on."""
    floor = face(2, 1.0, (-HALF, -HALF), (0.0, HALF), at=0.0)
    beyond = guess(gap * SPACING)
    places, normals = (np.concatenate([floor[k], beyond[k]]) for k in (0, 1))
    axes = quaternion_to_axes(quaternion_from_normal(torch.from_numpy(normals))).numpy()[:, :2]
    offsets, angles = nowhere(len(places))
    last = np.flatnonzero(np.isclose(floor[0][:, 0], -0.5 * SPACING))
    offsets[last, 0], angles[last, 0] = 0.3 * SPACING, np.arctan2(axes[last, 1, 0], axes[last, 0, 0])
    result = ends(places, normals, axes, offsets, angles, len(floor[0]), SPACING)
    return result.offsets[last, 0], surfels_of(places, normals, result.offsets, result.angles, result.kept)


def test_a_floor_that_goes_on_under_what_hides_it_has_no_end_there() -> None:
    """It ended where photographs did, and left a slit before the nearest guess, through which one saw the void."""
    last, surfels = seen_floor(1.0, lambda at: face(2, 1.0, (at, -HALF), (HALF, HALF), at=0.0))
    assert (last == NO_CLIP).all()
    x, y = torch.meshgrid(torch.linspace(-0.2, 0.2, 201), torch.linspace(-0.3, 0.3, 31), indexing="ij")
    above = torch.stack([x, y, torch.ones_like(x)], dim=-1).reshape(-1, 3)
    hits = composite(SurfelBvh(surfels), above, torch.tensor([0.0, 0.0, -1.0]).expand_as(above))
    assert float((hits.transmittance > 0.5).float().mean()) < 0.005  # 0; 0.05 with the ends


@pytest.mark.parametrize(
    "guess",
    [
        lambda at: face(2, 1.0, (at, -HALF), (HALF, HALF), at=-1.5 * SPACING),  # a lower step
        lambda at: face(0, 1.0, (-HALF, -0.4), (HALF, -0.1), at=at),  # a face that stands on it
        lambda at: face(2, -1.0, (at, -HALF), (HALF, HALF), at=0.0),  # what faces the other way
        lambda at: face(2, 1.0, (at + 3.0 * SPACING, -HALF), (HALF, HALF), at=0.0),  # a floor farther away
    ],
)
def test_a_surface_ends_before_what_is_not_its_own(guess) -> None:
    last, _ = seen_floor(0.6, guess)
    np.testing.assert_allclose(last, 0.3 * SPACING)


def test_without_surfels_nothing_ends() -> None:
    nothing = ends(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2, 3)), *nowhere(0), 0, SPACING)
    assert len(nothing.kept) == 0
    assert nothing.offsets.shape == (0, 2)
