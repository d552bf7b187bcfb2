"""Where images were clipped: known of 8 bits, with what a JPEG blurs, and seen in piled-up values of other images."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from scipy.ndimage import gaussian_filter

from rgspipe.datasets.display_image import saturated_from
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.images import read_colour
from rgspipe.datasets.saturation import common_maximum
from rgspipe.datasets.views import View
from rgspipe.scene import Camera, look_at, srgb


def _radiance(seed: int = 0) -> np.ndarray:
    """(96, 96, 3) smooth radiance, a quarter of which is above 1."""
    rng = np.random.default_rng(seed)
    image = gaussian_filter(rng.standard_normal((96, 96, 3)), (6, 6, 0))
    image = image - image.min()
    return image / np.quantile(image, 0.75)


def _levels(image: np.ndarray) -> np.ndarray:
    return np.round(255.0 * srgb.encode(image.clip(0.0, 1.0))).astype(np.uint8)


def _view(image: np.ndarray, saturated: float | None = None) -> View:
    camera = Camera.from_field_of_view(look_at([0.0, -2.0, 0.0], [0.0, 0.0, 0.0]), 1.0, *image.shape[1::-1])
    pixels = torch.from_numpy(image).float()
    return View("train/0", camera, pixels, torch.ones(image.shape[:2]), saturated_from=saturated)


def test_a_png_is_saturated_at_its_brightest_level_alone(tmp_path: Path) -> None:
    levels = _levels(_radiance())
    Image.fromarray(levels).save(tmp_path / "a.png")
    image, _ = read_colour(tmp_path / "a.png")
    np.testing.assert_array_equal(image.numpy() >= saturated_from(tmp_path / "a.png"), levels == 255)


@pytest.mark.parametrize(
    ("quality", "chroma", "missed"), [(75, 2, 0.0003), (85, 2, 0.0015), (95, 0, 0.0003), (95, 2, 0.0025)]
)
def test_what_a_jpeg_makes_of_saturated_values_counts_as_saturated(
    tmp_path: Path, quality: int, chroma: int, missed: float
) -> None:
    radiance = _radiance()
    Image.fromarray(_levels(radiance)).save(tmp_path / "a.jpg", quality=quality, subsampling=chroma)
    image, _ = read_colour(tmp_path / "a.jpg")
    found = image.numpy() >= saturated_from(tmp_path / "a.jpg")
    # Measured: 0.00014 and 0.0007 are missed at qualities 75 and 85, 0.00014 and 0.0012 at 95.
    assert (radiance >= 1.0)[~found].sum() < missed * (radiance >= 1.0).sum()
    # The brightest level alone misses 0.25 to 0.43.
    assert (image.numpy()[radiance >= 1.0] < 1.0).mean() > 0.2
    # Levels that were well below stay: at quality 75 those up to 231.
    assert not found[_levels(radiance) < 220].any()


def test_a_finer_table_has_a_smaller_margin(tmp_path: Path) -> None:
    limits = []
    for quality in (60, 85, 100):
        Image.fromarray(_levels(_radiance())).save(tmp_path / f"{quality}.jpg", quality=quality)
        limits.append(float(255 * srgb.encode(np.array(saturated_from(tmp_path / f"{quality}.jpg")))))
    assert limits == pytest.approx([222.0, 241.4, 252.4], abs=0.5)


def test_linear_images_that_were_clipped_show_it() -> None:
    images = [_radiance(seed) for seed in range(3)]
    assert common_maximum([_view(image.clip(max=1.0)) for image in images]) == 1.0
    assert common_maximum([_view(image) for image in images]) is None
    assert common_maximum([_view(image.astype(np.float16)) for image in images]) is None
    assert common_maximum([_view(np.ones((8, 8, 3)))]) is None and common_maximum([_view(np.zeros((8, 8, 3)))]) is None


def test_each_view_of_a_dataset_knows_where_it_is_saturated(
    dataset: Path, change: Callable[[str, Callable[[dict], object]], None]
) -> None:
    assert load_dataset(dataset).train[0].saturated_from is None
    Image.fromarray(np.full((4, 6, 3), 255, np.uint8)).save(dataset / "train/r_0000.png")
    change("transforms_train.json", lambda content: content["frames"][0].update(file_ext=".png"))
    ramp = np.linspace(0.5, 2.0, 72, dtype=np.float32).reshape(4, 6, 3).clip(max=1.0)
    write_image(dataset / "targets/one/view_0.exr", ramp)
    loaded = load_dataset(dataset)
    assert bool(loaded.train[0].saturated.all())
    assert loaded.test[0].saturated_from is None and not bool(loaded.test[0].saturated.any())
    assert loaded.targets[0].views[0].saturated_from == 1.0


def test_a_render_is_compared_as_it_would_have_been_photographed() -> None:
    view = _view(np.array([[[1.0, 1.0, 0.5]]]), saturated=1.0)
    rendered = torch.tensor([[[3.0, 0.9, 0.7]]])
    torch.testing.assert_close(view.as_photographed(rendered), torch.tensor([[[1.0, 0.9, 0.7]]]), rtol=0, atol=0)
