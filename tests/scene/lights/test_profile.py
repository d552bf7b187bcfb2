"""Measured luminaires: their surface of intensities, its derivatives, and hard tables."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from luminaire_files import angles, jump
from rgspipe.renderer.point_sets import fibonacci_directions
from rgspipe.scene.lights import Photometry, ProfileLight

AXIS = torch.nn.functional.normalize(torch.tensor([0.5, 0.3, -0.8], dtype=torch.float64), dim=0)
PLACE = torch.tensor([0.1, 0.2, 0.3], dtype=torch.float64)


def batwing(step: float = 10.0) -> Photometry:
    """Brighter to two sides than below, and a little upwards."""
    vertical, horizontal = angles(step, 180.0), angles(45.0, 315.0)
    wings = 1.2 + torch.cos(2.0 * horizontal)[None] * torch.sin(vertical)[:, None] ** 2
    return Photometry.measured(vertical, horizontal, 100.0 * (1.1 + torch.cos(vertical)[:, None]) * wings)


def lamp(table: Photometry) -> ProfileLight:
    return ProfileLight(PLACE, [1.0, 2.0, 0.5], AXIS, 0.7, table)


TABLES = {"batwing": batwing(), "jump": jump()}
every_table = pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)


def points() -> Tensor:
    generator = torch.Generator().manual_seed(0)
    return PLACE + torch.randn(500, 3, generator=generator, dtype=torch.float64)


@every_table
def test_it_goes_through_the_table_and_never_beyond(table: Photometry) -> None:
    down, around = torch.meshgrid(table.vertical, table.horizontal, indexing="ij")
    torch.testing.assert_close(table.at(down, around), table.relative, rtol=0.0, atol=1e-12)
    generator = torch.Generator().manual_seed(1)
    drawn = torch.rand(2, 20_000, generator=generator, dtype=torch.float64)
    found = table.at(math.pi * drawn[0], 20.0 * drawn[1] - 10.0)
    assert float(found.min()) >= 0.0 and float(found.max()) <= 1.0


@every_table
def test_all_derivatives_are_those_of_finite_differences(table: Photometry) -> None:
    light, h = lamp(table), 1e-6
    relative = light.relative_intensity(points())
    # Measured 4e-7.
    torch.testing.assert_close(relative.value.double(), light.relative_intensity_towards(points()), rtol=0, atol=1e-5)
    ways = {"turn": [1.0], "position": [*torch.eye(3).double()]}
    ways["direction"] = [way - (way @ AXIS) * AXIS for way in torch.eye(3).double()]
    for name, directions in ways.items():
        for way in directions:
            moved = [replace(light, **{name: getattr(light, name) + sign * h * way}) for sign in (1.0, -1.0)]
            ahead, behind = (one.relative_intensity_towards(points()) for one in moved)
            slope = relative.by[name].double()
            slope = slope * way if name == "turn" else slope @ way
            # Measured 1e-6 of the largest for the batwing, 3e-5 at the jump, whose slopes are 20 times as steep.
            expected = (ahead - behind) / (2.0 * h)
            assert float((slope - expected).abs().max()) < 2e-4 * float(expected.abs().max()), name


@every_table
def test_first_derivatives_are_continuous(table: Photometry) -> None:
    """Across the table's angles, where one piece ends and the next begins."""
    for angle in table.vertical.tolist()[1:-1]:
        sides = []
        for offset in (-1e-7, 1e-7):
            at = torch.tensor([angle + offset], dtype=torch.float64, requires_grad=True)
            around = torch.tensor([1.1], dtype=torch.float64, requires_grad=True)
            sides.append(torch.stack(torch.autograd.grad(table.at(at, around).sum(), (at, around))))
        assert float((sides[0] - sides[1]).abs().max()) < 1e-4, math.degrees(angle)


def test_its_power_is_the_integral_over_all_directions() -> None:
    light = lamp(batwing())
    mean = light.relative_intensity_towards(PLACE + fibonacci_directions(100_000).double()).mean()
    # Measured 3e-6.
    torch.testing.assert_close(light.power(), 4.0 * math.pi * mean * light.intensity.double(), rtol=1e-4, atol=0.0)


def test_it_is_finite_along_its_axis_against_it_and_at_itself() -> None:
    for table in TABLES.values():
        light = lamp(table)
        found = light.relative_intensity(torch.stack([PLACE + AXIS, PLACE, PLACE - AXIS, PLACE + 1e-12 * AXIS]))
        assert all(bool(torch.isfinite(part).all()) for part in (found.value, *found.by.values()))
        assert float(found.value[0]) == pytest.approx(float(table.relative[0, 0]), abs=1e-6)


def test_a_coarse_table_is_near_a_fine_one() -> None:
    """What interpolation costs: of a smooth luminaire with 10° between its angles."""
    generator = torch.Generator().manual_seed(2)
    drawn = torch.rand(2, 5000, generator=generator, dtype=torch.float64)
    at = math.pi * drawn[0], 2.0 * math.pi * drawn[1]
    fine, coarse = (table.candela * table.at(*at) for table in (batwing(1.0), batwing(10.0)))
    error = (fine - coarse).abs() / fine.max()
    assert float(error.max()) < 0.008 and float(error.mean()) < 0.001  # measured 0.0041 and 0.0005


def test_how_often_it_repeats_itself_is_told() -> None:
    assert math.degrees(batwing().period) == pytest.approx(180.0) and math.degrees(jump().period) == pytest.approx(360)
    alike = Photometry.measured(angles(10.0, 90.0), angles(90.0, 270.0), torch.ones(10, 4))
    assert alike.round and lamp(alike).coordinates().keys() == {"position", "direction"}


@pytest.mark.parametrize(
    ("vertical", "table"),
    [
        (angles(10.0, 90.0), torch.zeros(10, 1)),
        (angles(10.0, 90.0), -torch.ones(10, 1)),
        (angles(10.0, 90.0), torch.full((10, 1), math.nan)),
        (angles(10.0, 90.0), torch.ones(9, 1)),
        (angles(10.0, 90.0).flip(0), torch.ones(10, 1)),
    ],
)
def test_impossible_tables_are_refused(vertical: Tensor, table: Tensor) -> None:
    with pytest.raises(ValueError):
        Photometry.measured(vertical, torch.zeros(1).double(), table)
