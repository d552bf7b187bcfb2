"""Models that are wrong by a stated amount."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from lit_room import room_surfels
from rgspipe.degradation.model_error import smooth_field, with_error
from rgspipe.degradation.options import ModelError
from rgspipe.errors import InputError
from rgspipe.scene import Gloss, Surfels


@pytest.fixture(scope="module")
def surfels() -> Surfels:
    return room_surfels()


def test_no_error_changes_nothing(surfels: Surfels) -> None:
    assert with_error(surfels, ModelError(seed=5)) is surfels


def test_the_albedo_s_error_has_the_stated_size_and_is_smooth(surfels: Surfels) -> None:
    wrong = with_error(surfels, ModelError(albedo=0.1))
    error = (wrong.albedo / surfels.albedo).double().log()
    # One room holds some ten correlation lengths: measured 0.091.
    assert 0.07 < float(error.std()) < 0.13
    nearest = torch.cdist(surfels.centers, surfels.centers).fill_diagonal_(9.0).argmin(dim=1)
    assert float((error - error[nearest]).std()) < 0.6 * float(error.std())  # measured 0.43
    torch.testing.assert_close(wrong.centers, surfels.centers)


def test_a_factor_is_the_same_everywhere_and_keeps_energy(surfels: Surfels) -> None:
    wrong = with_error(surfels, ModelError(albedo_factor=1.2))
    torch.testing.assert_close(wrong.albedo, 1.2 * surfels.albedo)
    gloss = Gloss(torch.full_like(surfels.albedo, 0.3), torch.full_like(surfels.opacities, 5.0))
    bright = with_error(replace(surfels, gloss=gloss), ModelError(albedo_factor=3.0))
    assert float((bright.albedo + gloss.reflectance).max()) <= 0.99 + 1e-6


def test_positions_move_along_normals_and_normals_turn_by_the_stated_amounts(surfels: Surfels) -> None:
    wrong = with_error(surfels, ModelError(position=0.01, tilt=3.0))
    shift = wrong.centers - surfels.centers
    along = (shift * surfels.normals).sum(dim=1)
    torch.testing.assert_close(along[:, None] * surfels.normals, shift, rtol=1e-6, atol=1e-9)
    size = float((surfels.centers.amax(dim=0) - surfels.centers.amin(dim=0)).amax())
    assert float(along.std()) == pytest.approx(0.01 * size, rel=0.1)
    cosine = (wrong.normals * surfels.normals).sum(dim=1).clamp(max=1.0)
    # Two axes of 3° each: a mean angle of 3° √(π/2).
    assert float(torch.rad2deg(cosine.acos()).mean()) == pytest.approx(3.0 * 1.2533, rel=0.05)


def test_draws_of_one_error_do_not_depend_on_the_others(surfels: Surfels) -> None:
    alone, both = (
        with_error(surfels, ModelError(albedo=0.1)),
        with_error(surfels, ModelError(albedo=0.1, position=0.01)),
    )
    torch.testing.assert_close(alone.albedo, both.albedo)
    other = with_error(surfels, ModelError(albedo=0.1, seed=1))
    assert not torch.allclose(alone.albedo, other.albedo)


def test_a_box_of_surfels_is_missing_and_an_empty_box_is_refused(surfels: Surfels) -> None:
    fewer = with_error(surfels, ModelError(missing=[-0.15, -0.15, -0.4, 0.25, 0.25, 0.0]))
    lower, upper = torch.tensor([-0.15, -0.15, -0.4]), torch.tensor([0.25, 0.25, 0.0])
    inside = ((fewer.centers > lower) & (fewer.centers < upper)).all(dim=1)
    assert len(fewer) < len(surfels) and not bool(inside.any())
    with pytest.raises(InputError, match=r"ModelError\.missing"):
        with_error(surfels, ModelError(missing=[5.0, 5.0, 5.0, 6.0, 6.0, 6.0]))


def test_a_smooth_field_has_unit_variance_and_the_stated_correlation() -> None:
    generator = torch.Generator().manual_seed(0)
    points = torch.rand(200, 3, generator=generator, dtype=torch.float64)
    fields = smooth_field(torch.cat([points, points + torch.tensor([0.2, 0.0, 0.0])]), 0.2, 200, generator)
    here, there = fields[:200], fields[200:]
    # 200 fields of 64 waves: measured 0.98 and 0.60.
    assert float(here.var()) == pytest.approx(1.0, rel=0.1)
    assert float((here * there).mean()) == pytest.approx(0.6065, abs=0.08)
