"""Errors of albedo images in closed form."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rgspipe.evaluation.albedo import albedo_errors


def _views(count: int = 3, size: int = 6) -> tuple[list[np.ndarray], list[np.ndarray]]:
    generator = np.random.default_rng(0)
    truth = [generator.uniform(0.1, 0.9, (size, size, 3)) for _ in range(count)]
    return truth, [np.ones((size, size), dtype=bool) for _ in range(count)]


def test_a_constant_offset_has_the_errors_of_a_constant_offset() -> None:
    truth, masks = [np.full((4, 4, 3), 0.5)], [np.ones((4, 4), dtype=bool)]
    errors = albedo_errors([truth[0] + 0.05], truth, masks)
    assert errors.relative_l1 == pytest.approx(0.1) and errors.psnr == pytest.approx(-20.0 * math.log10(0.05))
    assert errors.per_view == pytest.approx((0.1,))


@given(factors=st.tuples(*[st.floats(0.2, 5.0)] * 3))
def test_one_factor_a_channel_for_all_views_does_not_count_when_scaled(factors) -> None:
    truth, masks = _views()
    errors = albedo_errors([image * factors for image in truth], truth, masks)
    assert errors.scale == pytest.approx([1.0 / factor for factor in factors])
    assert errors.relative_l1_scaled < 1e-12  # measured 2e-16


def test_factors_that_differ_between_views_do_count() -> None:
    truth, masks = _views(2)
    errors = albedo_errors([1.2 * truth[0], 0.8 * truth[1]], truth, masks)
    assert errors.relative_l1_scaled > 0.15


def test_pixels_that_do_not_count_change_nothing() -> None:
    truth, masks = _views()
    rendered = [image + 0.01 for image in truth]
    for image, mask in zip(rendered, masks, strict=True):
        mask[0], image[0] = False, 99.0
    errors = albedo_errors(rendered, truth, masks)
    assert errors.psnr == pytest.approx(40.0, abs=1e-9)
    masks[1][:] = False
    assert math.isnan(albedo_errors(rendered, truth, masks).per_view[1])


def test_the_summary_is_json_without_views() -> None:
    truth, masks = _views()
    summary = albedo_errors([0.9 * image for image in truth], truth, masks).summary()
    assert set(summary) == {"relative_l1", "psnr", "scale", "relative_l1_scaled", "psnr_scaled"}
    assert isinstance(summary["scale"], list)


def test_without_counted_pixels_or_with_black_truth_there_is_no_error() -> None:
    truth, masks = _views()
    assert albedo_errors([], [], []) is None
    assert albedo_errors(truth, truth, [~mask for mask in masks]) is None
    assert albedo_errors(truth, [0.0 * image for image in truth], masks) is None


def test_what_does_not_fit_together_is_refused() -> None:
    truth, masks = _views()
    with pytest.raises(ValueError, match="as many"):
        albedo_errors(truth[:2], truth, masks)
    with pytest.raises(ValueError, match="mask"):
        albedo_errors([image[:-1] for image in truth], truth, masks)
