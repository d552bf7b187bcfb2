"""Gather operators compared: the closed forms, and that the table tells good ones from bad ones."""

from __future__ import annotations

import math

import pytest
import torch

from rgspipe.benchmark.form_factors import unoccluded_form_factors, with_sampled_visibility
from rgspipe.benchmark.gather_quality import GatherVariant, compare_gathers
from rgspipe.benchmark.rooms import ROOMS
from rgspipe.scene import Surfels
from rgspipe.scene.rectangles import inside_of_box, rectangle, surfels_on


def box(count: int) -> Surfels:
    return surfels_on(inside_of_box([0, 0, 0], [1, 1, 1], [0.5] * 3), count)


@pytest.mark.parametrize("distance", [0.01, 0.3, 5.0])
def test_form_factor_of_a_disc_on_the_axis(distance: float) -> None:
    """r²/(d² + r²) for a disc of radius r."""
    grey = [0.5, 0.5, 0.5]
    pair = rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0], grey) + rectangle([0, 0, distance], [0, 1, 0], [1, 0, 0], grey)
    surfels = surfels_on(pair, 8)
    radius = 0.2
    factors = unoccluded_form_factors(surfels, torch.full((len(surfels),), math.pi * radius**2))
    facing = (surfels.centers[:, None, :2] - surfels.centers[None, :, :2]).norm(dim=-1) < 1e-9
    facing &= (surfels.normals[:, None] * surfels.normals[None]).sum(dim=-1) < 0
    expected = radius**2 / (distance**2 + radius**2)
    # Measured 1e-6.
    torch.testing.assert_close(factors[facing], torch.full((8,), expected), rtol=1e-5, atol=0)
    assert float(factors[(surfels.normals[:, None] * surfels.normals[None]).sum(dim=-1) > 0].max()) == 0.0


def test_unoccluded_rows_fill_a_hemisphere() -> None:
    surfels = box(1500)
    rows = unoccluded_form_factors(surfels, torch.full((len(surfels),), 6.0 / len(surfels))).sum(dim=1)
    # Measured mean 0.990, from 0.963 to 1.000: a centre's form factor stands for the disc, which fails near edges.
    assert float(rows.mean()) == pytest.approx(1.0, abs=0.02)


def test_visibility_takes_away_what_is_not_seen() -> None:
    factors = torch.tensor([[0.0, 0.2, 0.2, 0.1]])
    sampled = torch.tensor([[0.0, 0.3, 0.1, 0.0]])
    found = with_sampled_visibility(factors, sampled, torch.tensor([0, 1, 1, 2]))
    torch.testing.assert_close(found, torch.tensor([[0.0, 0.2, 0.2, 0.0]]))


def test_the_table_tells_good_operators_from_bad() -> None:
    room = ROOMS["corridor"]()
    golden, random = GatherVariant("golden", True), GatherVariant("random", False)
    variants = [golden, random, GatherVariant("golden", True, analytic=True)]
    table = compare_gathers(
        room, surfels_on(room.surfaces, 500), rays=(128,), variants=variants, reference_rays=1024, resolution=24
    )
    best, worst, analytic = (table.iloc[k] for k in range(3))
    assert (table.select_dtypes("number") >= 0).all().all()
    # Measured 0.015, 0.111 and, analytic, 0.038.
    assert best["spot_0.1_error"] < 0.4 * worst["spot_0.1_error"]
    assert best["spot_0.1_error"] < 0.7 * analytic["spot_0.1_error"] < worst["spot_0.1_error"]
    assert best["smooth_error"] < worst["smooth_error"]
    # Measured 0.0037 and 0.0228 in a coarse room.
    assert max(best["open_bias"], best["near_bias"]) < 0.5 * max(worst["open_bias"], worst["near_bias"])
