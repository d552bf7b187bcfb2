"""Non-negative intensities against an active-set solver, and in hard cases."""

from __future__ import annotations

import numpy as np
import scipy.optimize
import torch

from rgspipe.fitting.model.moments import moments
from rgspipe.fitting.model.nonnegative import nonnegative


def test_answers_are_those_of_an_active_set_solver() -> None:
    rng = np.random.default_rng(0)
    for count in (2, 3, 5):
        for _ in range(8):
            matrix, target = rng.normal(size=(12, count)), rng.normal(size=12)
            expected, _ = scipy.optimize.nnls(matrix, target)
            found = nonnegative(torch.from_numpy(matrix.T @ matrix), torch.from_numpy(matrix.T @ target))
            np.testing.assert_allclose(found.numpy(), expected, atol=1e-10)


def test_many_problems_at_once_are_each_of_them() -> None:
    generator = torch.Generator().manual_seed(0)
    matrix = torch.randn(7, 3, 9, 4, generator=generator, dtype=torch.float64)
    gram, product = matrix.transpose(-1, -2) @ matrix, matrix.sum(dim=-2)
    found = nonnegative(gram, product)
    torch.testing.assert_close(found[2, 1], nonnegative(gram[2, 1], product[2, 1]))


def test_equal_and_dark_lights_are_solvable() -> None:
    gram = torch.tensor([[4.0, 4.0, 0.0], [4.0, 4.0, 0.0], [0.0, 0.0, 0.0]], dtype=torch.float64)
    found = nonnegative(gram, torch.tensor([8.0, 8.0, 0.0], dtype=torch.float64))
    assert torch.isfinite(found).all() and float(found[2]) == 0.0
    assert abs(float(found[:2].sum()) - 2.0) < 1e-6


def test_intensities_of_a_rig_are_eliminated_exactly() -> None:
    """The projected Gauss-Newton matrix of two lights is the Schur complement of the joint one."""
    generator = torch.Generator().manual_seed(0)
    columns = [torch.rand(200, 3, 1 + d, generator=generator, dtype=torch.float64) for d in (3, 5)]
    truth = torch.tensor([[1.0, 2.0, 0.5], [0.3, 0.2, 0.7]], dtype=torch.float64)
    target = sum(column[:, :, 0] * strength for column, strength in zip(columns, truth, strict=True))
    system = moments(columns, target, torch.ones(200, 1))
    torch.testing.assert_close(system.intensity, truth)
    joint, count = system.information(truth), 8
    corner, side, rest = joint[:count, :count], joint[:count, count:], joint[count:, count:]
    torch.testing.assert_close(system.parameter_system()[0], corner - side @ torch.linalg.solve(rest, side.T))
    assert system.cost < 1e-9
