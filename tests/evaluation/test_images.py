"""Pictures: gain, colours of differences, sizes and files."""

import io

import numpy as np
import pytest
from PIL import Image

from rgspipe.evaluation import images


def test_the_gain_brings_the_percentile_to_white_and_black_stays_black():
    image = np.full((10, 10, 3), 4.0)
    assert images.display_gain(image) == pytest.approx(0.25)
    assert (images.tone_map(image) == 255).all()
    black = np.zeros((4, 4, 3))
    assert images.display_gain(black) == 1.0 and (images.tone_map(black, 1.0) == 0).all()


def test_tone_mapping_is_the_srgb_curve_and_shows_broken_pixels():
    image = np.array([[[0.001, 0.2140, 0.5]], [[np.nan, 0.0, 0.0]], [[np.inf, -1.0, 0.0]]])
    mapped = images.tone_map(image, 1.0)
    assert mapped[0, 0].tolist() == [3, 127, 188]
    assert mapped[1, 0].tolist() == [255, 0, 255] and mapped[2, 0].tolist() == [255, 0, 0]


def test_differences_are_red_where_too_bright_and_blue_where_too_dark():
    target = np.ones((1, 3, 3))
    render = target + np.array([1.0, 0.0, -1.0])[None, :, None]
    bright, equal, dark = images.signed_difference(target, render, 1.0)[0].astype(int)
    assert bright[0] > bright[2] + 50 and dark[2] > dark[0] + 50
    assert equal.tolist() == [247, 247, 247]


def test_strips_have_one_panel_each_and_white_gaps():
    image = np.random.default_rng(0).uniform(size=(12, 10, 3))
    strip = images.comparison_strip(image, image)
    assert strip.shape == (12, 3 * 10 + 2 * images.GAP, 3) and strip.dtype == np.uint8
    assert (strip[:, 10 : 10 + images.GAP] == 255).all() and (strip[:, -10:] == 247).all()
    longer = images.progress_strip(image, [image, image, image])
    assert longer.shape == (12, 5 * 10 + 4 * images.GAP, 3)
    assert images.stack([longer, strip]).shape == (24 + images.GAP, longer.shape[1], 3)


def test_strips_refuse_images_of_two_sizes():
    with pytest.raises(ValueError, match="one size"):
        images.comparison_strip(np.zeros((4, 4, 3)), np.zeros((4, 5, 3)))
    with pytest.raises(ValueError, match="at least one"):
        images.progress_strip(np.zeros((4, 4, 3)), [])


def test_png_files_are_whole_and_reproducible(tmp_path):
    pixels = np.random.default_rng(1).integers(0, 256, (5, 7, 3), dtype=np.uint8)
    images.save_png(tmp_path / "a.png", pixels)
    assert (tmp_path / "a.png").read_bytes() == images.png_bytes(pixels)
    assert (np.asarray(Image.open(tmp_path / "a.png")) == pixels).all()
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]


def test_large_pictures_are_made_to_fit_and_small_ones_left_alone():
    noise = images.png_bytes(np.random.default_rng(2).integers(0, 256, (300, 600, 3), dtype=np.uint8))
    assert images.fit_within(noise, len(noise)) == noise
    smaller = images.fit_within(noise, 200_000)
    with Image.open(io.BytesIO(smaller)) as picture:
        assert len(smaller) <= 200_000 and picture.width == pytest.approx(2 * picture.height, abs=2)
