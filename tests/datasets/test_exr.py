"""EXR files: what is written is read back, and what is broken is refused by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rgspipe.datasets.exr import read_array, read_channels, read_image, write_channels, write_image
from rgspipe.errors import InputError


def _noise(*shape: int) -> np.ndarray:
    return np.random.default_rng(0).exponential(size=shape).astype(np.float32)


def test_colour_and_alpha_come_back_bit_for_bit(tmp_path: Path) -> None:
    image, alpha = _noise(5, 7, 3) * 1e4, _noise(5, 7)
    write_image(tmp_path / "a.exr", image, alpha)
    read, read_alpha = read_image(tmp_path / "a.exr")
    np.testing.assert_array_equal(read, image)
    np.testing.assert_array_equal(read_alpha, alpha)


def test_an_image_without_alpha_is_opaque(tmp_path: Path) -> None:
    write_image(tmp_path / "a.exr", _noise(4, 3, 3))
    assert (read_image(tmp_path / "a.exr")[1] == 1).all()


def test_half_stays_half_and_all_else_is_float(tmp_path: Path) -> None:
    values = _noise(4, 6)
    write_channels(tmp_path / "a.exr", {"Z": values, "V": values.astype(np.float16)})
    read = read_channels(tmp_path / "a.exr")
    np.testing.assert_array_equal(read["Z"], values)
    np.testing.assert_array_equal(read["V"], values.astype(np.float16).astype(np.float32))


def test_writing_twice_gives_the_same_bytes_and_leaves_nothing_else(tmp_path: Path) -> None:
    image = _noise(8, 8, 3)
    write_image(tmp_path / "a.exr", image)
    first = (tmp_path / "a.exr").read_bytes()
    write_image(tmp_path / "a.exr", image)
    assert (tmp_path / "a.exr").read_bytes() == first
    assert [path.name for path in tmp_path.iterdir()] == ["a.exr"]


def test_a_wrong_shape_is_refused_when_writing(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"\(H, W, 3\)"):
        write_image(tmp_path / "a.exr", _noise(4, 4))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gone\.exr.*no such file"):
        read_channels(tmp_path / "gone.exr")


@pytest.mark.parametrize("kept", [0.0, 0.1, 0.5, 0.99])
def test_a_truncated_file_is_named(tmp_path: Path, kept: float) -> None:
    path = tmp_path / "cut.exr"
    write_image(path, _noise(64, 64, 3))
    content = path.read_bytes()
    path.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(InputError, match=r"cut\.exr.*whole OpenEXR"):
        read_image(path)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_pixels_that_are_no_numbers_are_counted_and_placed(tmp_path: Path, value: float) -> None:
    image = _noise(4, 4, 3)
    image[2, 1, 0] = value
    write_image(tmp_path / "bad.exr", image)
    with pytest.raises(InputError, match=r"bad\.exr.*1 with NaN or infinity.*row 2, column 1"):
        read_image(tmp_path / "bad.exr")


def test_other_channels_are_listed(tmp_path: Path) -> None:
    write_channels(tmp_path / "grey.exr", {"Y": _noise(4, 4)})
    with pytest.raises(InputError, match=r"grey\.exr.*4 channels R, G, B, A.*found 1: Y"):
        read_image(tmp_path / "grey.exr")
    with pytest.raises(InputError, match="1 channel Z"):
        read_array(tmp_path / "grey.exr", ("Z",))
