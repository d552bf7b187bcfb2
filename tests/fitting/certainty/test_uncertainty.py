"""How sure a fit is: in closed form where the truth about the errors is known."""

from __future__ import annotations

import dataclasses
import math

import pytest
import torch

from lit_room import HIDDEN, VISIBLE
from rgspipe.fitting.certainty import uncertainty
from rgspipe.fitting.certainty.doubts import doubts
from rgspipe.fitting.certainty.uncertainty import (
    inflated,
    light_covariances,
    sandwich,
    shrunk,
    surface_cells,
    whitener,
)
from rgspipe.fitting.findings import Undetermined
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.moments import group_moments, information, scores
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.options import CertaintyOptions
from rgspipe.fitting.search.refine import State
from rgspipe.scene import PointLight

#: χ² with three degrees of freedom is below this in 95 % of the cases.
CHI_SQUARE_95 = 7.815


def _coverage(correlated: float, trials: int = 400, cells: int = 60) -> tuple[float, float]:
    """How often the 95 % regions of `sandwich` and of plain least squares hold the truth of a linear problem.

    Cells of 20 numbers; each cell has an error of its own, `correlated` times as large as the noise.
    """
    generator = torch.Generator().manual_seed(3)
    size, unknowns = 20, 3
    inside = torch.zeros(2)
    for _ in range(trials):
        own = torch.randn(cells, 1, unknowns, generator=generator, dtype=torch.float64)
        jacobian = own + 0.5 * torch.randn(cells, size, unknowns, generator=generator, dtype=torch.float64)
        noise = torch.randn(cells, size, generator=generator, dtype=torch.float64)
        error = noise + correlated * torch.randn(cells, 1, generator=generator, dtype=torch.float64)
        per_cell = jacobian.transpose(1, 2) @ jacobian
        found = torch.linalg.solve(per_cell.sum(0), torch.einsum("kpi,kp->i", jacobian, error))
        residual = error - jacobian @ found
        root, unknown = whitener(per_cell.sum(0))
        assert not bool(unknown.any())
        variance = float(residual.square().sum()) / (cells * size - unknowns)
        model = sandwich(
            root, per_cell, torch.einsum("kpi,kp->ki", jacobian, residual), CertaintyOptions().largest_share
        )
        whitened = torch.linalg.solve(root, found)
        for index, matrix in enumerate((inflated(model, variance, 1.0), variance * torch.eye(3, dtype=torch.float64))):
            inside[index] += float(whitened @ torch.linalg.solve(matrix, whitened)) < CHI_SQUARE_95
    return tuple((inside / trials).tolist())


def test_the_sandwich_covers_as_stated_where_cells_share_errors_and_plain_noise_does_not():
    model, plain = _coverage(correlated=1.0)
    assert 0.91 < model < 0.985  # measured 0.945; 95 % ± 1.1 % expected of many cells
    assert plain < 0.6  # measured 0.185


def test_without_shared_errors_the_sandwich_is_hardly_wider_than_the_noise():
    model, plain = _coverage(correlated=0.0)
    assert 0.92 < plain < 0.98 and plain <= model < 0.995  # measured 0.955 and 0.97


def test_few_cells_hold_the_truth_nearly_as_often_as_many(monkeypatch):
    few, _ = _coverage(correlated=1.0, cells=8)
    monkeypatch.setattr(uncertainty, "shrunk", lambda moves: moves.T @ moves)
    unshrunk, _ = _coverage(correlated=1.0, cells=8)
    assert few > 0.87 and unshrunk < 0.83  # measured 0.905 and 0.79


def test_shrinking_keeps_the_sum_of_variances_and_what_many_cells_say():
    generator = torch.Generator().manual_seed(5)
    scales = torch.tensor([3.0, 1.0, 0.1, 1.0], dtype=torch.float64)
    for cells, least, most in ((3, 0.5, 1.0), (3000, 0.0, 0.01)):
        moves = torch.randn(cells, 4, generator=generator, dtype=torch.float64) * scales / math.sqrt(cells)
        spread, found = moves.T @ moves, shrunk(moves)
        assert float(found.trace()) == pytest.approx(float(spread.trace()))
        alike = spread.trace() / 4.0 * torch.eye(4, dtype=torch.float64)
        each = torch.einsum("ki,kj->kij", moves, moves) * cells
        chance = float((each - spread).square().sum()) / cells**2
        share = min(1.0, chance / float((spread - alike).square().sum()))
        torch.testing.assert_close(found, (1.0 - share) * spread + share * alike)
        assert least <= share <= most  # measured 0.58 and 0.0014
    torch.testing.assert_close(shrunk(torch.zeros(0, 2, dtype=torch.float64)), torch.zeros(2, 2, dtype=torch.float64))


def test_group_moments_give_the_evidence_of_an_explicit_jacobian():
    generator = torch.Generator().manual_seed(0)
    columns = [torch.randn(30, 3, 4, generator=generator), torch.randn(30, 3, 6, generator=generator)]
    residual, intensity = torch.randn(30, 3, generator=generator), torch.rand(2, 3, generator=generator).double()
    groups = torch.randint(0, 4, (30,), generator=generator)
    values, owners = group_moments(columns, residual, torch.ones(30, 1), groups, 5)
    jacobian = torch.zeros(30, 3, 14, dtype=torch.float64)
    jacobian[:, :, :3] = columns[0][:, :, 1:] * intensity[0][None, :, None]
    jacobian[:, :, 3:8] = columns[1][:, :, 1:] * intensity[1][None, :, None]
    for channel in range(3):
        jacobian[:, channel, 8 + channel] = columns[0][:, channel, 0]
        jacobian[:, channel, 11 + channel] = columns[1][:, channel, 0]
    assert float(values[4].abs().sum()) == 0.0
    for group in range(4):
        own = jacobian[groups == group].reshape(-1, 14)
        torch.testing.assert_close(information(values[group], owners, intensity), own.T @ own)
        expected = own.T @ residual[groups == group].double().reshape(-1)
        torch.testing.assert_close(scores(values, owners, intensity)[group], expected)


def test_the_whitener_knows_what_is_not_determined():
    """Two unknowns of which only the sum is known, one that is known, in very different units, and one unseen."""
    jacobian = torch.tensor([[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1e6, 0.0], [2.0, 2.0, 1e6, 0.0]], dtype=torch.float64)
    matrix = jacobian.T @ jacobian
    root, unknown = whitener(matrix)
    assert unknown.tolist() == [True, True, False, True] and root.shape == (4, 2)
    torch.testing.assert_close(root.T @ matrix @ root, torch.eye(2, dtype=torch.float64))
    assert whitener(torch.zeros(2, 2, dtype=torch.float64))[1].tolist() == [True, True]


def test_noise_is_the_lower_bound_and_the_rest_is_inflated():
    turn = torch.linalg.qr(torch.randn(3, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64))[0]
    found = inflated(turn @ torch.diag(torch.tensor([0.5, 2.0, 5.0]).double()) @ turn.T, 2.0, 3.0)
    torch.testing.assert_close(torch.linalg.eigvalsh(found), torch.tensor([2.0, 2.0, 29.0], dtype=torch.float64))


def test_cells_are_places_of_the_surface_whichever_view_looks(room):
    views = room.two.prepared
    labels, count = surface_cells(views, 0.25)
    centers = room.frozen.surfels.centers - room.frozen.surfels.centers.mean(dim=0)
    places = views.operator @ centers / (views.operator @ torch.ones(len(centers), 1))
    assert count == int(labels.max()) + 1 < 150
    for label in range(count):
        own = places[labels == label]
        assert float((own.amax(dim=0) - own.amin(dim=0)).max()) <= 0.25 * room.frozen.size + 1e-6
    first = int((views.pixels < room.views[0].camera.pixel_count).sum())
    # The views look at the same box from two sides: they share cells.
    assert len(set(labels[:first].tolist()) & set(labels[first:].tolist())) > 10


def _covariances(room, light: PointLight, intensity: torch.Tensor):
    problem = LightProblem.create(room.one.prepared, room.one.prepared.stack_images(room.images(light)))
    emitter = Emitter.of(light)
    return light_covariances(problem, State((emitter,), (problem.evaluate(emitter),), intensity / problem.scale))


def test_a_light_that_is_off_has_no_place(room, point_light):
    light = point_light(VISIBLE)
    found = _covariances(room, light, torch.zeros(1, 3, dtype=torch.float64)).calibrated
    matrix = found[0]
    assert torch.isinf(matrix.diagonal()[:3]).all() and torch.isfinite(matrix.diagonal()[3:]).all()
    assert not torch.isnan(matrix).any() and float(matrix[:3, 3:].abs().max()) == 0.0
    assert doubts((light,), found, room.frozen.surfels, 1.0) == [Undetermined(1, 1, ("position",))]
    second = doubts((light, light), (torch.eye(6), matrix), room.frozen.surfels, 100.0)[-1]
    assert second == Undetermined(2, 2, ("position",))


@pytest.mark.parametrize("where", [VISIBLE, HIDDEN])
def test_errors_of_the_model_widen_the_region(room, point_light, where):
    """An albedo that is wrong over whole walls: the calibrated region is far wider than that of noise."""
    light = point_light(where)
    (image,) = room.images(light)
    spoiled = image * (1.0 + 0.05 * torch.sign(torch.linspace(-1.0, 1.0, 48) + 0.2))[:, None, None]
    problem = LightProblem.create(room.one.prepared, room.one.prepared.stack_images([spoiled]))
    emitter = Emitter.of(light)
    state = State((emitter,), (problem.evaluate(emitter),), light.intensity[None] / problem.scale)
    found = light_covariances(problem, state)
    wide, narrow = (float(part[0].diagonal()[:3].sum().sqrt()) for part in (found.calibrated, found.noise))
    assert wide > 3.0 * narrow > 0.0  # measured 59 and 44
    eigenvalues = torch.linalg.eigvalsh(found.calibrated[0] - found.noise[0])
    assert float(eigenvalues.min()) > -1e-9 * float(eigenvalues.max())
    assert math.isfinite(wide) and dataclasses.is_dataclass(found)


def test_the_design_effect_tells_noise_from_errors_that_neighbours_share(room):
    light, generator = PointLight(VISIBLE, 1.0), torch.Generator().manual_seed(2)
    views = room.one.prepared
    problem = LightProblem.create(views, views.stack_images(room.images(light)))
    emitter = Emitter.of(light)
    state = State((emitter,), (problem.evaluate(emitter),), light.intensity[None] / problem.scale)
    noise = 0.02 * torch.randn(problem.target.shape, generator=generator)
    for error, low, high in ((noise, 0.7, 1.3), (0.05 * problem.target, 10.0, math.inf)):
        wrong = dataclasses.replace(problem, target=problem.target + error)
        assert low < uncertainty.design_effect(wrong, state, 0.2) < high  # measured 0.94 and 44
