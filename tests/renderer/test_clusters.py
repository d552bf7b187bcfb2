"""Patches are compact, of one side of a surface, none empty, and the same for a seed."""

from __future__ import annotations

import numpy as np
import torch

from rgspipe.renderer.clusters import cluster_patches
from rooms import closed_box


def test_patches_are_compact_and_stay_on_one_wall() -> None:
    box = closed_box(1 / 16)
    labels = torch.from_numpy(cluster_patches(box.centers, box.normals, 200, seed=0)).long()
    assert set(labels.tolist()) == set(range(int(labels.max()) + 1)) and int(labels.max()) >= 190
    member = torch.nn.functional.one_hot(labels).double()
    means = (member.T @ box.centers) / member.sum(dim=0)[:, None]
    spread = (box.centers - means[labels]).norm(dim=1)
    # The mean distance from the middle of a disc of 6/200 of the surface is 0.065; measured mean 0.069, largest 0.16.
    assert float(spread.mean()) < 0.075 and float(spread.max()) < 0.2
    normals = (member.T @ box.normals) / member.sum(dim=0)[:, None]
    # Measured 100 % of patches on one wall.
    assert float((normals.norm(dim=1) > 0.999).double().mean()) > 0.98


def test_opposite_sides_of_a_thin_wall_are_apart() -> None:
    box = closed_box(1 / 8)
    labels = cluster_patches(torch.cat([box.centers] * 2), torch.cat([box.normals, -box.normals]), 100, seed=0)
    assert not set(labels[: len(box)]) & set(labels[len(box) :])


def test_a_seed_repeats_them_and_another_does_not() -> None:
    box = closed_box(1 / 8)
    one, again, other = (cluster_patches(box.centers, box.normals, 40, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one, again) and not np.array_equal(one, other)


def test_far_from_the_origin_they_are_the_same() -> None:
    box = closed_box(1 / 8)
    shifted = box.centers + torch.tensor([1e4, -1e4, 1e4], dtype=torch.float64)
    near, far = (cluster_patches(centers, box.normals, 40, seed=0) for centers in (box.centers, shifted))
    assert np.array_equal(near, far)


def test_more_patches_than_surfels_and_no_surfels() -> None:
    box = closed_box(1 / 2)
    assert sorted(cluster_patches(box.centers, box.normals, 500, seed=0)) == list(range(len(box)))
    assert len(cluster_patches(box.centers[:0], box.normals[:0], 500, seed=0)) == 0
