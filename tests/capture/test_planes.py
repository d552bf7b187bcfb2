"""Values that change evenly are off no plane, wherever a surfel has neighbours enough for one."""

from __future__ import annotations

import numpy as np

from rgspipe.capture.planes import off_planes


def test_a_ramp_is_off_no_plane_and_a_bowl_is_off_by_its_curvature() -> None:
    """A tilted square of nine, each beside all others, and one surfel with a single neighbour, whose row is empty."""
    rng = np.random.default_rng(0)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    flat = np.array([(x, y) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)] + [(2.0, 2.0)])
    centers, normals = flat @ frame[:2], np.tile(frame[2], (10, 1))
    first, second = np.triu_indices(9, 1)
    pairs = np.append(first, 8), np.append(second, 9), rng.uniform(0.5, 1.0, len(first) + 1)
    off = off_planes(centers, normals, pairs)
    assert np.abs(off @ (flat @ [0.3, -0.7] + 2.0)).max() < 1e-12
    assert off[[9]].nnz == 0
    # Of eight alike neighbours of the middle, r² is 1.5 in the mean.
    alike = off_planes(centers[:9], normals[:9], (first, second, np.ones(len(first))))
    np.testing.assert_allclose((alike @ (flat[:9] ** 2).sum(axis=1))[4], -1.5)


def test_neighbours_in_a_row_are_a_plane_for_what_lies_on_it_alone() -> None:
    centers = np.array([(x, 0.0, 0.0) for x in range(4)] + [(0.5, 1.0, 0.0)])
    pairs = np.array([0, 0, 0, 1, 1, 2, 4, 4, 4]), np.array([1, 2, 3, 2, 3, 3, 1, 2, 3]), np.ones(9)
    off = off_planes(centers, np.tile([0.0, 0.0, 1.0], (5, 1)), pairs)
    np.testing.assert_allclose((off @ centers[:, 0])[0], 0.0, atol=1e-12)
    assert off[[4]].nnz == 0
