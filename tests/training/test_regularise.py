"""Regularisers vanish where they should, and their gradients point back to it."""

from __future__ import annotations

import math
from dataclasses import replace

import torch

from rgspipe.renderer.kernels.composite import composite
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.scene import Surfels
from rgspipe.training.parameters import tilted
from rgspipe.training.regularise import continuity, distortion, find_neighbours, normal_smoothness
from rgspipe.training.trainer import spacing_of_clips
from rooms import closed_box, sphere


def on_sphere() -> tuple[Surfels, float]:
    ball = sphere(500)
    return ball, spacing_of_clips(ball)


def test_continuity_is_zero_on_a_sphere_and_smoothness_is_not() -> None:
    ball, spacing = on_sphere()
    pairs = find_neighbours(ball, spacing)
    # Measured 1e-33 and 0.007.
    assert float(continuity(ball, pairs)) < 1e-20
    assert float(normal_smoothness(ball, pairs)) > 1e-3


def test_descending_continuity_brings_a_surfel_back_to_its_surface() -> None:
    ball, spacing = on_sphere()
    pairs = find_neighbours(ball, spacing)
    height = torch.zeros(len(ball), dtype=torch.float64)
    height[7] = 0.1 * spacing
    height.requires_grad_()
    continuity(replace(ball, centers=ball.centers + height[:, None] * ball.normals), pairs).backward()
    # Measured: the lifted surfel's gradient is 4 times that of any other.
    assert int(height.grad.abs().argmax()) == 7
    assert float(height.grad[7]) > 0.0


def test_walls_that_meet_at_an_angle_do_not_pull_at_each_other() -> None:
    """Two rows of surfels along a crease of 60°."""
    box = closed_box(1 / 10)
    floor = (box.normals[:, 2] > 0.5) & (box.centers[:, 1].abs() < 0.1)
    surfels = replace(box, **{name: tensor[floor].clone() for name, tensor in box.tensors().items()})
    turn = (surfels.centers[:, 1] > 0.0).double()[:, None] * torch.tensor([[math.radians(60.0), 0.0]])
    creased = replace(surfels, rotations=tilted(surfels.rotations, turn))
    pairs = find_neighbours(creased, 1 / 10)
    across = (creased.normals[pairs.first] * creased.normals[pairs.second]).sum(dim=1) < 0.9
    assert bool(across.any()), "the crease must have pairs for this to prove anything"
    # (1 + (1/CREASE)² + …)⁻² = 0.0032.
    assert float(pairs.weight[across].max()) < 5e-3
    assert float(pairs.weight[~across].max()) > 0.99


def test_distortion_is_that_of_hits_in_one_layer_and_its_gradient_closes_it() -> None:
    """A ray straight down onto two surfels whose planes are a third of a layer apart."""
    box = closed_box(1 / 2)
    floor = (box.normals[:, 2] > 0.5).nonzero()[:2, 0]
    pair = replace(box, **{name: tensor[floor].clone() for name, tensor in box.tensors().items()}).to(torch.float32)
    thickness = pair.coverage.layer_thickness
    gap = torch.tensor([0.0, thickness / 3.0], requires_grad=True)
    flat = torch.zeros(2, 2)
    pair = replace(pair, centers=torch.cat([flat, gap[:, None]], dim=1))
    origins, directions = torch.tensor([[0.01, 0.0, 1.0]]), torch.tensor([[0.0, 0.0, -1.0]])
    hits = composite(SurfelBvh(pair), origins, directions)
    value = distortion(pair, hits, origins, directions)
    total = float(hits.weights.sum())
    # Equal weights: each hit is a sixth of a thickness from their mean. Measured to 1e-6.
    torch.testing.assert_close(float(value.detach()), total / 36.0, rtol=1e-4, atol=0.0)
    value.backward()
    assert float(gap.grad[1]) > 0.0
    torch.testing.assert_close(gap.grad[0], -gap.grad[1], rtol=1e-4, atol=1e-7)
