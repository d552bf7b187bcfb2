"""The points that lights with an extent are made of stand for them: in closed form."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from rgspipe.scene import Light
from rgspipe.scene.lights import PanelLight, PointLight, SphereLight
from rgspipe.scene.lights.nodes import ball_nodes, square_nodes
from rgspipe.scene.lights.panel import SIDE, sides

MIDDLE = torch.tensor([0.2, -0.1, 0.4], dtype=torch.float64)


def irradiance(light: Light, points: Tensor, normals: Tensor) -> Tensor:
    """(N,) on surfaces that nothing stands before, of a light of 1 W/sr."""
    total = torch.zeros(len(points), dtype=torch.float64)
    for part in light.parts():
        to_light = part.position - points
        cosine = (to_light * normals).sum(dim=1).clamp(min=0.0)
        relative = 1.0 if part.axis is None else part.relative_intensity_towards(points)
        total += part.intensity[0] * relative * cosine / to_light.norm(dim=1) ** 3
    return total


@pytest.mark.parametrize(("distance", "error"), [(2.0, 0.05), (4.0, 1e-3), (10.0, 4e-6)])
def test_a_sphere_that_is_seen_whole_is_a_point(distance: float, error: float) -> None:
    """Newton's shell theorem, at `distance` radii."""
    radius = 0.1
    normals = torch.nn.functional.normalize(torch.randn(500, 3, generator=torch.Generator().manual_seed(0)), dim=1)
    normals = normals.double()
    points = MIDDLE - distance * radius * normals
    sphere, point = SphereLight(MIDDLE, 1.0, radius), PointLight(MIDDLE, 1.0)
    whole = irradiance(sphere, points, normals) / irradiance(point, points, normals)
    # Measured 0.021, 3.2e-4 and 1.3e-6: it falls with the sixth power of the distance.
    assert float((whole - 1.0).abs().max()) < error


def test_a_sphere_that_is_half_hidden_looks_like_a_disc() -> None:
    """A straight edge before it hides what it hides of an even disc, but for the steps of twelve points."""
    edges = torch.linspace(-1.0, 1.0, 201, dtype=torch.float64)
    disc = 0.5 + (edges * (1.0 - edges**2).sqrt() + torch.asin(edges)) / math.pi
    ways = torch.nn.functional.normalize(torch.randn(200, 3, generator=torch.Generator().manual_seed(1)), dim=1)
    hidden = ((ball_nodes() @ ways.double().T)[None] < edges[:, None, None]).double().mean(dim=1)
    # Measured 0.036 and 0.21, where an edge has just passed four of the twelve.
    assert float((hidden - disc[:, None]).abs().mean()) < 0.05 and float((hidden - disc[:, None]).abs().max()) < 0.3
    # The second moments along any way are those of the disc, r²/4.
    torch.testing.assert_close((ball_nodes() @ ways.double().T).square().mean(dim=0), torch.full((200,), 0.25).double())


@pytest.mark.parametrize("height", [0.1, 0.2, 0.5])
def test_a_panel_has_the_form_factor_of_a_rectangle(height: float) -> None:
    """From a parallel surface below its corner: (1/2π)(A/√(1+A²) atan(B/√(1+A²)) + B/√(1+B²) atan(A/√(1+B²)))."""
    width, depth = 0.3, 0.2
    panel = PanelLight(MIDDLE, 1.0, [0.0, 0.0, -1.0], width, depth)
    corner = MIDDLE + torch.tensor([0.5 * width, 0.5 * depth, -height], dtype=torch.float64)
    found = float(irradiance(panel, corner[None], torch.tensor([[0.0, 0.0, 1.0]], dtype=torch.float64)))
    a, b = width / height, depth / height
    factor = a / math.hypot(1, a) * math.atan(b / math.hypot(1, a)) + b / math.hypot(1, b) * math.atan(
        a / math.hypot(1, b)
    )
    # E = L π F with the radiance L = 1/(width · depth). Measured 2e-4, 3.6e-3 and 2.9e-3.
    expected = math.pi * factor / (2.0 * math.pi) / (width * depth)
    assert abs(found / expected - 1.0) < 0.01


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(-4.0, 4.0))
def test_the_sides_of_a_panel_and_its_axis_are_right_handed(axis: tuple[float, ...], turn: float) -> None:
    direction = torch.tensor(axis, dtype=torch.float64)
    if float(direction.norm()) < 1e-3:
        return
    direction = torch.nn.functional.normalize(direction, dim=0)
    across, up = sides(direction, torch.tensor(turn, dtype=torch.float64))
    assert torch.isfinite(across).all() and torch.isfinite(up).all()
    if float(direction[2]) < 1.0 - 1e-6:
        frame = torch.stack([across, up, direction])
        # Measured 4e-10, close to straight up.
        torch.testing.assert_close(frame @ frame.T, torch.eye(3).double(), rtol=0.0, atol=1e-8)
        assert float(torch.linalg.det(frame)) == pytest.approx(1.0, abs=1e-8)


def test_straight_down_the_width_is_along_x() -> None:
    down = torch.tensor([0.0, 0.0, -1.0], dtype=torch.float64)
    assert sides(down, torch.tensor(0.0).double())[0].tolist() == [1.0, 0.0, 0.0]
    quarter = sides(down, torch.tensor(0.5 * math.pi).double())[0]
    torch.testing.assert_close(quarter, torch.tensor([0.0, -1.0, 0.0]).double())


@pytest.mark.parametrize("light", [SphereLight(MIDDLE, [1.0, 2.0, 3.0], 0.1), PanelLight.shaped()])
def test_its_points_share_its_intensity(light: Light) -> None:
    parts = light.parts()
    torch.testing.assert_close(sum(part.intensity for part in parts), light.intensity)
    torch.testing.assert_close(sum(part.power() for part in parts), light.power())


@pytest.mark.parametrize(("kind", "values"), [(SphereLight, (-0.1,)), (PanelLight, ([0.0, 0.0, 1.0], 0.1, -0.1))])
def test_sizes_below_zero_are_refused(kind: type[Light], values: tuple) -> None:
    with pytest.raises(ValueError, match="0 or more"):
        kind(MIDDLE, 1.0, *values)


def test_few_points_have_the_moments_of_what_they_stand_for() -> None:
    """Along any way a disc of radius 1 has the variance 1/4, and a square of side 1 has 1/12."""
    ways = torch.nn.functional.normalize(torch.randn(200, 3, generator=torch.Generator().manual_seed(1)), dim=1)
    for nodes, variance in ((ball_nodes(few=True), 0.25), (square_nodes(SIDE, few=True), 1.0 / 12.0)):
        along = nodes @ torch.nn.functional.normalize(ways[:, : nodes.shape[1]], dim=1).double().T
        torch.testing.assert_close(along.mean(dim=0), torch.zeros(200).double())
        torch.testing.assert_close(along.square().mean(dim=0), torch.full((200,), variance).double())
