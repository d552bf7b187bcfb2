"""JPEG whose codes were damaged, which their decoder reads without a word, and odd ones that are whole."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rgspipe.datasets.display_image import read_levels
from rgspipe.errors import InputError

ROWS, COLUMNS = np.mgrid[:240, :320]
SMOOTH = np.stack([128 + 100 * np.sin(COLUMNS / 37 + turn) * np.cos(ROWS / 23) for turn in range(3)], axis=-1)


def jpeg(image: np.ndarray, **options: object) -> bytes:
    file = io.BytesIO()
    Image.fromarray(np.clip(image, 0, 255).astype(np.uint8)).save(file, "JPEG", **options)
    return file.getvalue()


def read(folder: Path, content: bytes) -> np.ndarray:
    (folder / "a.jpg").write_bytes(content)
    return read_levels(folder / "a.jpg").levels


def zeroed(content: bytes, place: float, count: int) -> bytes:
    """With zeros in the place of some of its codes."""
    start = content.index(b"\xff\xda") + 14
    start += int(place * (len(content) - start))
    return content[:start] + bytes(count) + content[start + count :]


@pytest.mark.parametrize("place", [0.1, 0.5, 0.9])
@pytest.mark.parametrize(
    ("options", "words"),
    [({}, "end before"), ({"optimize": True}, "go on after"), ({"restart_marker_rows": 4}, "end before|restarts")],
)
def test_damage_that_the_decoder_hides_is_refused(tmp_path: Path, options: dict, words: str, place: float) -> None:
    content = zeroed(jpeg(SMOOTH, **options), place, 40)
    with Image.open(io.BytesIO(content)) as image:
        assert np.asarray(image).shape == SMOOTH.shape, "the decoder says nothing"
    with pytest.raises(InputError, match=rf"a\.jpg: expected a whole JPEG image, found .*({words})"):
        read(tmp_path, content)


def test_most_sectors_of_zeros_are_seen(tmp_path: Path) -> None:
    """The rest comes out even, or is a few bytes off."""
    seen, count = 0, 0
    for noise in (0.0, 4.0, 15.0):
        content = jpeg(SMOOTH + np.random.default_rng(1).normal(0.0, noise, SMOOTH.shape), quality=92)
        for place in np.linspace(0.05, 0.85, 12):
            count += 1
            try:
                read(tmp_path, zeroed(content, place, 512))
            except InputError:
                seen += 1
    assert seen >= 0.8 * count  # Measured: 35 of 36


def test_a_restart_that_is_missing_is_refused(tmp_path: Path) -> None:
    content = jpeg(SMOOTH, restart_marker_rows=2)
    start, end = content.index(b"\xff\xd2"), content.index(b"\xff\xd4")
    with pytest.raises(InputError, match=r"a\.jpg: .*found restarts that do not follow each other"):
        read(tmp_path, content[:start] + content[end:])


ODD = {
    "noise": np.random.default_rng(0).integers(0, 256, (97, 131, 3)),
    "grey": SMOOTH[..., 0],
    "flat": np.full((64, 64, 3), 128),
    "one pixel": SMOOTH[:1, :1],
    "dark below": SMOOTH * (ROWS < 120)[..., None],
    "clipped below": np.where((ROWS < 120)[..., None], SMOOTH, 300),
}


@pytest.mark.parametrize("name", ODD)
@pytest.mark.parametrize(
    "options",
    [{}, {"quality": 100, "subsampling": 0}, {"optimize": True}, {"progressive": True}, {"restart_marker_blocks": 3}],
)
def test_what_is_whole_is_read(tmp_path: Path, name: str, options: dict) -> None:
    content = jpeg(ODD[name], **options)
    with Image.open(io.BytesIO(content)) as image:
        np.testing.assert_array_equal(read(tmp_path, content).squeeze(), np.asarray(image).squeeze())


@pytest.mark.parametrize("more", [bytes(7), b"x" * 4000])
def test_what_follows_the_end_and_what_cameras_fill_up_with_do_no_harm(tmp_path: Path, more: bytes) -> None:
    content = jpeg(SMOOTH)
    read(tmp_path, content + more)
    read(tmp_path, content[:-2] + more[:3] + content[-2:])
