"""Measures against closed forms, and what must hold for every image."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from rgspipe.evaluation import metrics


def _images(seed: int, size: int = 16) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    target = generator.uniform(0.0, 2.0, (size, size, 3))
    return target + generator.normal(0.0, 0.05, target.shape), target


def test_psnr_of_a_constant_offset_is_twenty_decibels_a_tenth_of_the_peak():
    target = np.full((8, 8, 3), 2.0)
    assert metrics.psnr(target + 0.2, target) == pytest.approx(20.0, abs=1e-12)  # measured 20.0 exactly
    assert metrics.psnr(target + 0.02, target) == pytest.approx(40.0, abs=1e-9)


def test_psnr_peak_is_the_targets_percentile_and_not_its_maximum():
    target = np.ones((100, 100, 3))
    target[0, 0] = 1000.0  # one firefly in ten thousand pixels
    assert metrics.peak(target) == pytest.approx(1.0)
    render = target.copy()
    render[5, :] += 0.1
    assert metrics.psnr(render, target) == pytest.approx(40.0, abs=1e-9)


def test_psnr_mask_counts_only_its_pixels_and_keeps_the_peak():
    image, target = _images(0)
    mask = np.zeros((16, 16), dtype=bool)
    mask[4:8, 4:8] = True
    error = np.mean((image[mask] - target[mask]) ** 2)
    expected = 10.0 * math.log10(metrics.peak(target) ** 2 / error)
    assert metrics.psnr(image, target, mask) == pytest.approx(expected, abs=1e-10)
    broken = image.copy()
    broken[0, 0] = 99.0
    assert metrics.psnr(broken, target, mask) == metrics.psnr(image, target, mask)


def test_psnr_edge_cases_are_as_stated():
    image, target = _images(1)
    assert metrics.psnr(target, target) == math.inf
    assert math.isnan(metrics.psnr(image, np.zeros_like(target)))
    assert math.isnan(metrics.psnr(np.zeros_like(target), np.zeros_like(target)))
    assert math.isnan(metrics.psnr(image, target, np.zeros((16, 16), dtype=bool)))
    image[0, 0, 0] = np.nan
    assert math.isnan(metrics.psnr(image, target))


def test_psnr_refuses_what_cannot_be_compared():
    image, target = _images(2)
    with pytest.raises(ValueError, match="shape"):
        metrics.psnr(image[:-1], target)
    with pytest.raises(ValueError, match="mask must have shape"):
        metrics.psnr(image, target, np.ones((3, 3), dtype=bool))
    with pytest.raises(ValueError, match="boolean"):
        metrics.psnr(image, target, np.ones((16, 16)))
    target[0, 0, 0] = np.inf
    with pytest.raises(ValueError, match="finite target"):
        metrics.psnr(image, target)


def test_psnr_takes_tensors_that_need_gradients():
    image, target = (torch.tensor(part, dtype=torch.float32) for part in _images(3))
    assert metrics.psnr(image.requires_grad_(), target) == pytest.approx(metrics.psnr(*_images(3)), abs=1e-3)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 1000), scale=st.floats(1e-30, 1e30))
def test_psnr_does_not_depend_on_the_unit_of_radiance(seed, scale):
    image, target = _images(seed)
    assert metrics.psnr(scale * image, scale * target) == pytest.approx(metrics.psnr(image, target), abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 1000), factor=st.floats(1.5, 100.0))
def test_psnr_falls_by_the_square_of_the_error(seed, factor):
    image, target = _images(seed)
    worse = target + factor * (image - target)
    loss = metrics.psnr(image, target) - metrics.psnr(worse, target)
    assert loss == pytest.approx(20.0 * math.log10(factor), abs=1e-8)


def test_position_error_is_a_fraction_of_the_longest_side():
    size = metrics.longest_side([[0.0, 0.0, -1.0], [1.0, 4.0, 1.0]])
    assert size == 4.0
    assert metrics.position_error([1.0, 2.0, 3.0], [1.0, 5.0, 7.0], size) == pytest.approx(1.25)
    assert metrics.position_error([np.nan, 0.0, 0.0], [0.0, 0.0, 0.0], size) == math.inf


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-10.0, 10.0), min_size=6, max_size=6), st.floats(0.01, 100.0), st.floats(-5.0, 5.0))
def test_position_error_is_symmetric_and_moves_and_scales_with_the_scene(values, scale, shift):
    a, b = np.array(values[:3]), np.array(values[3:])
    error = metrics.position_error(a, b, 2.0)
    assert metrics.position_error(b, a, 2.0) == error
    assert metrics.position_error(scale * (a + shift), scale * (b + shift), 2.0 * scale) == pytest.approx(
        error, abs=1e-9
    )


@pytest.mark.parametrize(
    "bounds", [[[0, 0, 0], [0, 0, 0]], [[0, 0, 0]], [[1, 1, 1], [0, 0, 0]], [[0, 0, 0], [1, 1, np.inf]]]
)
def test_a_box_without_extent_is_refused(bounds):
    with pytest.raises(ValueError):
        metrics.longest_side(bounds)


def test_intensity_error_is_the_mean_over_lit_channels():
    assert metrics.intensity_error([1.1, 1.8, 4.0], [1.0, 2.0, 4.0]) == pytest.approx(0.2 / 3.0)
    assert metrics.intensity_error([1.1, 0.3, 9.0], [1.0, 0.0, 0.0]) == pytest.approx(0.1)
    assert math.isnan(metrics.intensity_error([1.0, 1.0, 1.0], [0.0, 0.0, 0.0]))
    assert metrics.intensity_error([np.nan, 1.0, 1.0], [1.0, 1.0, 1.0]) == math.inf
    with pytest.raises(ValueError, match="not negative"):
        metrics.intensity_error([1.0, 1.0, 1.0], [-1.0, 1.0, 1.0])


def test_success_includes_the_limit_and_excludes_the_unknown():
    assert metrics.success(0.01) and not metrics.success(0.0101)
    assert not metrics.success(math.nan) and not metrics.success(math.inf)


def test_bootstrap_interval_is_seeded_and_holds_the_median():
    values = np.random.default_rng(4).lognormal(size=31)
    first = metrics.bootstrap_median(values, np.random.default_rng(7))
    assert first == metrics.bootstrap_median(values, np.random.default_rng(7))
    assert first[0] <= np.median(values) <= first[1]


def test_bootstrap_interval_covers_the_true_median_as_often_as_it_says():
    generator = np.random.default_rng(5)
    covered = 0
    for _ in range(300):
        low, high = metrics.bootstrap_median(generator.normal(size=25), generator, resamples=400)
        covered += low <= 0.0 <= high
    assert 0.88 <= covered / 300 <= 0.99  # measured 0.91 for a nominal 0.95


def test_bootstrap_interval_of_little_or_failed_data():
    generator = np.random.default_rng(6)
    assert all(math.isnan(bound) for bound in metrics.bootstrap_median([], generator))
    assert metrics.bootstrap_median([0.3], generator) == (0.3, 0.3)
    low, high = metrics.bootstrap_median([0.1, 0.2, 0.3, math.inf, math.inf], generator)
    assert low == 0.1 and high == math.inf
    with pytest.raises(ValueError, match="NaN"):
        metrics.bootstrap_median([0.1, math.nan], generator)


def _floor_and_box() -> tuple[np.ndarray, np.ndarray]:
    """A floor at a grazing angle in the lower half, a wall behind, and a nearer square before the wall."""
    rows = np.arange(64.0)[:, None] + 0.5
    depth = np.where(rows > 32.0, 20.0 / np.maximum(rows - 30.0, 1.0), 10.0) * np.ones((64, 64))
    normal = np.where(rows[..., None] > 32.0, [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]) * np.ones((64, 64, 1))
    depth[8:20, 8:20] = 5.0
    return depth, normal


def test_edge_mask_marks_jumps_and_creases_and_no_grazing_floor():
    depth, normal = _floor_and_box()
    edge = metrics.edge_mask(depth, normal, dilation=0)
    assert edge[8, 12] and edge[12, 8] and edge[12, 20] and edge[20, 12]  # the square's outline
    assert edge[31, 40] and edge[32, 40]  # where floor and wall meet
    assert not edge[36:, :].any() and not edge[10:18, 10:18].any()
    grown = metrics.edge_mask(depth, normal, dilation=2)
    assert grown[6, 12] and not grown[14, 14] and (grown | edge == grown).all()


def test_edge_mask_marks_the_outline_of_an_object_in_the_void_and_nothing_else():
    depth = np.full((16, 16), np.inf)
    normal = np.zeros((16, 16, 3))
    depth[4:12, 4:12], normal[4:12, 4:12] = 3.0, [0.0, 0.0, 1.0]
    edge = metrics.edge_mask(depth, normal, dilation=0)
    inside = np.zeros_like(edge)
    inside[5:11, 5:11] = True
    assert edge[4, 5] and edge[3, 5] and not edge[inside].any() and not edge[0].any()


def test_edge_mask_is_the_same_on_its_side():
    depth, normal = _floor_and_box()
    turned = metrics.edge_mask(depth.T, normal.swapaxes(0, 1))
    assert (turned == metrics.edge_mask(depth, normal).T).all()


def test_edge_mask_refuses_impossible_depth():
    depth, normal = _floor_and_box()
    with pytest.raises(ValueError, match="depth"):
        metrics.edge_mask(-depth, normal)
    with pytest.raises(ValueError, match="normal"):
        metrics.edge_mask(depth, normal[..., 0])
