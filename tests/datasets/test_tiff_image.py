"""TIFF images of floats, and those that would be read wrongly."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from rgspipe.datasets.gs3 import load_dataset
from rgspipe.datasets.images import read_colour
from rgspipe.errors import InputError
from scan_layouts import write_hdr
from tiny_dataset import HEIGHT, WIDTH, dataset

__all__ = ["dataset"]

LIGHT = np.random.default_rng(0).random((HEIGHT, WIDTH, 3), dtype=np.float32)
ALPHA = np.linspace(0.0, 1.0, HEIGHT * WIDTH, dtype=np.float32).reshape(HEIGHT, WIDTH, 1)
WITH_ALPHA = np.concatenate([LIGHT, ALPHA], axis=2)

#: What a file says of its channels.
RGB = {"photometric": "rgb"}

#: What is written with which tags, and what the image and its alpha are.
READ: dict[str, tuple[np.ndarray, dict, np.ndarray, np.ndarray]] = {
    "colours": (LIGHT, RGB, LIGHT, np.ones_like(ALPHA)),
    "half floats": (LIGHT.astype(np.float16), RGB, LIGHT.astype(np.float16), np.ones_like(ALPHA)),
    "doubles in planes": (
        np.moveaxis(LIGHT, 2, 0).astype(np.float64),
        {"photometric": "rgb", "planarconfig": "separate"},
        LIGHT,
        np.ones_like(ALPHA),
    ),
    "grey": (LIGHT[..., 0], {}, np.repeat(LIGHT[..., :1], 3, axis=2), np.ones_like(ALPHA)),
    "premultiplied": (WITH_ALPHA, {"photometric": "rgb", "extrasamples": ["assocalpha"]}, LIGHT, ALPHA),
    "straight": (WITH_ALPHA, {"photometric": "rgb", "extrasamples": ["unassalpha"]}, LIGHT * ALPHA, ALPHA),
}


@pytest.mark.parametrize("case", READ)
def test_floats_come_back_as_they_were(tmp_path: Path, case: str) -> None:
    stored, tags, light, alpha = READ[case]
    tifffile.imwrite(tmp_path / "a.tif", stored, **tags)
    image, opaque = read_colour(tmp_path / "a.tif")
    np.testing.assert_array_equal(image.numpy(), light.astype(np.float32))
    np.testing.assert_array_equal(opaque.numpy(), alpha[..., 0])


REFUSED: dict[str, tuple[Callable[[Path], object], str]] = {
    "whole numbers": (
        lambda path: tifffile.imwrite(path, (65535 * LIGHT).astype(np.uint16)),
        "whole numbers of 16 bits",
    ),
    "8 bits": (lambda path: Image.fromarray((255 * LIGHT).astype(np.uint8)).save(path), "sRGB as PNG, and linear ones"),
    "packed": (lambda path: tifffile.imwrite(path, LIGHT, **RGB, compression="zlib"), "found compression 8"),
    "a fourth channel": (
        lambda path: tifffile.imwrite(path, WITH_ALPHA, photometric="rgb", extrasamples=["unspecified"]),
        "4 channels of which nothing says what they are",
    ),
    "two channels": (lambda path: tifffile.imwrite(path, WITH_ALPHA[..., :2], planarconfig="contig"), "2 channels"),
    "several": (
        lambda path: tifffile.imwrite(path, np.stack([LIGHT, LIGHT]), photometric="rgb"),
        "2 images in one file",
    ),
    "not finite": (lambda path: tifffile.imwrite(path, LIGHT / 0.0, **RGB), "NaN or infinity"),
    "on its side": (
        lambda path: tifffile.imwrite(path, LIGHT, **RGB, extratags=[(274, "H", 1, 6, True)]),
        r"turned \(orientation 6\)",
    ),
    "half of one": (lambda path: _cut(path), "half of one|cannot be read"),
    "a damaged tag": (lambda path: _damaged(path), "invalid data type"),
    "another format": (lambda path: path.write_text("no image"), "cannot be read"),
    "below black": (lambda path: tifffile.imwrite(path, LIGHT - 2.0, **RGB), "expected radiance"),
}


def _damaged(path: Path) -> None:
    """A TIFF whose tag of its orientation is of no type."""
    tifffile.imwrite(path, LIGHT, **RGB, extratags=[(274, "H", 1, 6, True)])
    content = path.read_bytes()
    path.write_bytes(content.replace(b"\x12\x01\x03\x00", b"\x12\x01\x63\x00", 1))


def _cut(path: Path) -> None:
    tifffile.imwrite(path, LIGHT, **RGB)
    path.write_bytes(path.read_bytes()[:-40])


@pytest.mark.filterwarnings("ignore:divide by zero")
@pytest.mark.parametrize("case", REFUSED)
def test_what_would_be_read_wrongly_is_refused(tmp_path: Path, case: str) -> None:
    write, words = REFUSED[case]
    write(tmp_path / "a.tiff")
    with pytest.raises(InputError, match=rf"a\.tiff: .*({words})"):
        read_colour(tmp_path / "a.tiff")


@pytest.mark.parametrize("suffix", [".tif", ".TIFF", ".hdr"])
def test_a_dataset_may_have_them(dataset: Path, suffix: str) -> None:
    """Named without a suffix, too; they were refused."""
    (dataset / "train/r_0000.exr").unlink()
    path = dataset / f"train/r_0000{suffix}"
    write_hdr(path, LIGHT, packed=False) if suffix == ".hdr" else tifffile.imwrite(path, LIGHT, **RGB)
    text = (dataset / "transforms_train.json").read_text()
    (dataset / "transforms_train.json").write_text(text.replace('"file_ext": ".exr",', ""))
    (view,) = load_dataset(dataset).train
    # A shared exponent leaves eight bits of the brightest channel.
    np.testing.assert_allclose(view.image.numpy(), LIGHT, atol=0.0 if suffix != ".hdr" else LIGHT.max() / 256)
    assert bool((view.alpha == 1.0).all()) and view.saturated_from is None
