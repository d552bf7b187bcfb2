"""Contact sheets, videos and comparisons."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from rgspipe.evaluation.images import GAP
from rgspipe.evaluation.plots import png_of
from rgspipe.relighting.pictures import Relit, comparison_figure, contact_sheet, developed, grid, video
from rgspipe.relighting.table import MEASURES, compared, relight_summary, typical_rows

RNG = np.random.default_rng(0)


def images(count: int, height: int = 12, width: int = 16) -> list[np.ndarray]:
    return [RNG.uniform(size=(height, width, 3)).astype(np.float32) for _ in range(count)]


def test_pictures_that_stand_together_are_exposed_alike() -> None:
    dim, bright = developed([np.full((4, 4, 3), 0.25), np.full((4, 4, 3), 1.0)])
    assert bright.min() == 255 and 130 < dim.max() < 142  # sRGB of a quarter is 137
    alone = developed([np.full((4, 4, 3), 0.25)])
    assert alone[0].min() == 255


def test_a_sheet_has_rows_of_six() -> None:
    sheet = contact_sheet(images(8))
    assert sheet.shape == (2 * 12 + GAP, 6 * 16 + 5 * GAP, 3)
    assert grid(developed(images(2))).shape == (12, 2 * 16 + GAP, 3)


def test_a_video_shows_every_frame_as_long_as_was_asked_and_repeats() -> None:
    shades = [np.full((8, 128, 3), value, dtype=np.uint8) for value in (0, 60, 120, 180, 240)]
    with Image.open(io.BytesIO(video(shades, seconds=1.0))) as opened:
        assert opened.format == "WEBP" and opened.n_frames == 5 and opened.info["loop"] == 0
        assert opened.size == (384, 24), "single pixels are enlarged"
        for frame, shade in enumerate((0, 60, 120, 180, 240)):
            opened.seek(frame)
            opened.load()
            assert opened.info["duration"] == 200
            assert abs(np.asarray(opened.convert("RGB")).astype(int) - shade).max() <= 3  # measured 1
    with pytest.raises(ValueError, match="two frames"):
        video(shades[:1], 1.0)


def test_a_comparison_has_a_column_for_each_number_of_lights() -> None:
    truths = images(3)
    columns = [
        Relit(lights, truth, 0.9 * truth, 20.0 + lights) for lights, truth in zip((1, 2, 8), truths, strict=True)
    ]
    figure = comparison_figure(columns)
    assert [axis.get_ylabel() for axis in figure.axes[::3]] == ["path traced", "frozen scene", "difference"]
    assert comparison_figure(columns, "target").axes[0].get_ylabel() == "target"
    titles = [axis.get_title(loc="left") for axis in figure.axes[:3]]
    assert titles == ["1 light", "2 lights", "8 lights"]
    assert [axis.get_xlabel() for axis in figure.axes[6:]] == ["21.0 dB", "22.0 dB", "28.0 dB"]
    assert png_of(figure).startswith(b"\x89PNG")
    with pytest.raises(ValueError, match="nothing to compare"):
        comparison_figure([])


def test_an_image_is_measured_against_its_truth() -> None:
    (truth,) = images(1, 16, 16)
    same, worse = compared(truth, truth), compared(truth + 0.1, truth)
    assert same["psnr"] == np.inf and same["ssim"] == 1.0 and same["flip"] == 0.0
    assert list(worse) == list(MEASURES) and 15.0 < worse["psnr"] < 25.0 and worse["flip"] > 0.01


def test_images_are_summed_up_over_numbers_of_lights_and_the_median_one_is_shown() -> None:
    table = pd.DataFrame({"rig": ["a", "a", "b", "c"], "lights": [1, 1, 1, 2], "psnr": [30.0, 34.0, 32.0, 40.0]})
    table = table.assign(ssim=0.9, flip=0.1, milliseconds=[5.0, 5.0, 7.0, 9.0])
    summary = relight_summary(table)
    assert summary["lights"].tolist() == [1, 2] and summary["rigs"].tolist() == [2, 1]
    assert summary["images"].tolist() == [3, 1] and summary["psnr"].tolist() == [32.0, 40.0]
    assert summary["psnr_min"].tolist() == [30.0, 40.0] and summary["milliseconds"].tolist() == [5.0, 9.0]
    assert typical_rows(table) == [2, 3]
    assert typical_rows(table.assign(psnr=[np.nan, 34.0, 32.0, np.inf])) == [2]
