"""EXR files: what is written is read back, and what is broken is refused by name."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from rgspipe.datasets.exr import (
    read_array,
    read_channels,
    read_depth_channel,
    read_image,
    write_channels,
    write_image,
)
from rgspipe.datasets.reading_limits import ReadingLimits, reading_within
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
    write_channels(tmp_path / "grey.exr", {"V": _noise(4, 4)})
    with pytest.raises(InputError, match=r"grey\.exr.*4 channels R, G, B, A.*found 1: V"):
        read_image(tmp_path / "grey.exr")
    with pytest.raises(InputError, match="1 channel Z"):
        read_array(tmp_path / "grey.exr", ("Z",))


@pytest.mark.parametrize("layer", ["", "ViewLayer.Combined.", "beauty."])
@pytest.mark.parametrize("beside", [(), ("ViewLayer.Depth.Z", "ViewLayer.Normal.X", "ViewLayer.DiffCol.R"), ("Z",)])
def test_colours_are_told_from_what_stands_beside_them(tmp_path: Path, layer: str, beside: tuple[str, ...]) -> None:
    image, alpha = np.arange(24, dtype=np.float32).reshape(2, 4, 3), _noise(2, 4)
    stored = {f"{layer}{name}": image[..., index] for index, name in enumerate("RGB")} | {f"{layer}A": alpha}
    write_channels(tmp_path / "a.exr", stored | {name: _noise(2, 4) for name in beside})
    if layer == "beauty." and beside:
        with pytest.raises(InputError, match="4 channels R, G, B, A"):
            read_image(tmp_path / "a.exr")
        return
    read, read_alpha = read_image(tmp_path / "a.exr")
    np.testing.assert_array_equal(read, image)
    np.testing.assert_array_equal(read_alpha, alpha)


def test_two_layers_of_colours_are_not_guessed_between(tmp_path: Path) -> None:
    layers = ("ViewLayer.Combined", "Composite.Combined")
    write_channels(tmp_path / "a.exr", {f"{layer}.{name}": _noise(2, 4) for layer in layers for name in "RGBA"})
    with pytest.raises(InputError, match=r"in one layer.*ViewLayer\.Combined"):
        read_image(tmp_path / "a.exr")


def test_luminance_alone_is_grey(tmp_path: Path) -> None:
    write_channels(tmp_path / "a.exr", {"Y": _noise(2, 4)})
    np.testing.assert_array_equal(read_image(tmp_path / "a.exr")[0], np.repeat(_noise(2, 4)[..., None], 3, axis=2))


@pytest.mark.parametrize("names", ["Z", "V", "RGB", "RGBA", "Z R G B A", "s.Depth.Z s.Combined.R s.Normal.Z"])
def test_depth_is_told_from_what_stands_beside_it(tmp_path: Path, names: str) -> None:
    listed = names.split() if " " in names else list(names)
    depth = [name for name in listed if name.endswith("Depth.Z") or name in ("Z", "V")] or list("RGB")
    stored = {name: _noise(2, 4) if name in depth else np.ones((2, 4), np.float32) for name in listed}
    write_channels(tmp_path / "a.exr", stored)
    np.testing.assert_array_equal(read_depth_channel(tmp_path / "a.exr"), _noise(2, 4))


def test_vectors_and_colours_are_no_depth(tmp_path: Path) -> None:
    for names in ("XYZ", "RGB"):
        write_channels(tmp_path / "a.exr", {name: index * _noise(2, 4) for index, name in enumerate(names)})
        with pytest.raises(InputError, match="one channel of depth"):
            read_depth_channel(tmp_path / "a.exr")


def _write_windows(path: Path, values: np.ndarray, data: tuple, display: tuple, names: str = "RGB") -> None:
    """An EXR file with windows of its own: ((left, top), (right, bottom)) each."""
    corners = {"dataWindow": data, "displayWindow": display}
    header = {name: tuple(np.array(corner, np.int32) for corner in pair) for name, pair in corners.items()}
    channels = {name: np.ascontiguousarray(values) for name in names}
    OpenEXR.File({"type": OpenEXR.scanlineimage, **header}, channels).write(str(path))


def test_a_cropped_data_window_is_placed_in_the_display_window(tmp_path: Path) -> None:
    values = _noise(3, 4)
    _write_windows(tmp_path / "cropped.exr", values, ((12, 21), (15, 23)), ((10, 20), (19, 27)))
    image, _ = read_image(tmp_path / "cropped.exr")
    expected = np.zeros((8, 10), np.float32)
    expected[1:4, 2:6] = values
    np.testing.assert_array_equal(image, np.repeat(expected[..., None], 3, axis=2))


def test_what_lies_outside_of_the_data_window_is_not_seen(tmp_path: Path) -> None:
    """Without alpha it was black and opaque."""
    _write_windows(tmp_path / "cropped.exr", _noise(3, 4), ((12, 21), (15, 23)), ((10, 20), (19, 27)))
    expected = np.zeros((8, 10), np.float32)
    expected[1:4, 2:6] = 1.0
    image, alpha = read_image(tmp_path / "cropped.exr")
    np.testing.assert_array_equal(alpha, expected)
    assert (image[expected == 0.0] == 0.0).all() and (image[expected == 1.0] > 0.0).all()


@pytest.mark.parametrize("data", [((-1, 0), (8, 7)), ((1, 0), (10, 7)), ((0, 1), (9, 8))])
def test_pixels_outside_of_the_display_window_are_refused(tmp_path: Path, data: tuple) -> None:
    _write_windows(tmp_path / "over.exr", _noise(8, 10), data, ((0, 0), (9, 7)))
    with pytest.raises(InputError, match=r"over\.exr.*display window.*data window"):
        read_image(tmp_path / "over.exr")


def test_parts_with_the_same_channels_are_refused_and_others_joined(tmp_path: Path) -> None:
    def write(name: str, *parts: dict[str, np.ndarray]) -> Path:
        header = {"type": OpenEXR.scanlineimage}
        made = [OpenEXR.Part(header | {"name": str(index)}, part) for index, part in enumerate(parts)]
        OpenEXR.File(made).write(str(tmp_path / name))
        return tmp_path / name

    colour = {name: _noise(4, 6) for name in "RGB"}
    with pytest.raises(InputError, match=r"stereo\.exr.*each channel once.*B, G, R in several of its 2 parts"):
        read_channels(write("stereo.exr", colour, {name: 2 * values for name, values in colour.items()}))
    joined = read_channels(write("joined.exr", colour, {"Z": _noise(4, 6)}))
    assert set(joined) == set("RGBZ")


def test_a_size_that_no_image_has_is_refused_by_the_header(tmp_path: Path) -> None:
    write_image(tmp_path / "large.exr", _noise(8, 8, 3))
    with (
        reading_within(ReadingLimits(pixels=63)),
        pytest.raises(InputError, match=r"large\.exr.*1 to 63 pixels.*8 × 8.*limits"),
    ):
        read_channels(tmp_path / "large.exr")


def test_pipes_folders_and_endless_names_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.exr")
    for name, words in (("pipe.exr", "pipe or a device"), ("", "folder"), ("n" * 5000, "too long"), ("\0", "null")):
        with pytest.raises(InputError, match=words):
            read_channels(tmp_path / name)


def test_a_few_pixels_do_not_claim_a_huge_image(tmp_path: Path) -> None:
    _write_windows(tmp_path / "claims.exr", _noise(2, 2), ((0, 0), (1, 1)), ((0, 0), (9000, 9000)))
    with pytest.raises(InputError, match=r"claims\.exr.*16777216 pixels.*9001 × 9001"):
        read_image(tmp_path / "claims.exr")


@pytest.mark.parametrize(("ratio", "good"), [(1.0, True), (1.0001, True), (2.0, False), (0.9, False)])
def test_pixels_that_are_no_squares_are_refused(tmp_path: Path, ratio: float, good: bool) -> None:
    header = {"pixelAspectRatio": ratio, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"Z": np.ones((4, 4), np.float32)}).write(str(tmp_path / "a.exr"))
    if good:
        assert read_channels(tmp_path / "a.exr")["Z"].shape == (4, 4)
        return
    with pytest.raises(InputError, match=rf"a\.exr: expected square pixels, found pixelAspectRatio {ratio:g}\."):
        read_channels(tmp_path / "a.exr")
