"""OpenEXR images, read with every check that keeps a broken file from going further, written whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR

from rgspipe.datasets.input_file import check_pixel_count, input_file
from rgspipe.datasets.reading_limits import reading_limits, timed
from rgspipe.errors import InputError
from rgspipe.store.files import replacing

#: How much pixels may differ from squares: an image of 4000 pixels would be one off.
SQUARE = 1.0 / 4000.0

COLOURS = ("R", "G", "B")

RENDER_AGAIN = "Export or render this image again."


@timed
def read_channels(path: str | Path) -> dict[str, np.ndarray]:
    """All channels of an EXR file over its display window: {name: (H, W) float32}, 0 outside of its data window.

    Raises:
        InputError: no such file, not an EXR file, truncated, a channel that is not a plain image or that two parts
            have, pixels outside of the display window or that are no squares.
    """
    path = input_file(path, "an OpenEXR image")
    _check_pixels(path)
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            parts = [_placed(path, part) for part in file.parts]
    except InputError:
        raise
    except Exception as error:  # the binding raises bare RuntimeError, ValueError or MemoryError for bad files
        raise _broken(path, str(error)) from error
    return _joined(path, parts)


def _check_pixels(path: Path) -> None:
    """Refuse sizes that no image has, by the header alone: decoding would take all memory first."""
    try:
        with OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
            for part in file.parts:
                _check_squares(path, part)
                for window in ("displayWindow", "dataWindow"):
                    _, size = _window(part.header[window])
                    check_pixel_count(path, *size)
    except InputError:
        raise
    except Exception as error:  # as in `read_channels`
        raise _broken(path, str(error)) from error


def _check_squares(path: Path, part: OpenEXR.Part) -> None:
    """Refuse pixels that are no squares, as of anamorphic lenses: the camera of a view has one scale in both."""
    ratio = float(part.header.get("pixelAspectRatio", 1.0))
    if not abs(ratio - 1.0) <= SQUARE:
        remedy = "Resample the image to square pixels, or correct pixelAspectRatio in its header where they are."
        raise InputError(path, expected="square pixels", found=f"pixelAspectRatio {ratio:g}", remedy=remedy)


def _window(corners: tuple[np.ndarray, np.ndarray]) -> tuple[tuple[int, int], tuple[int, int]]:
    """The first column and row of a window, and its width and height."""
    (left, top), (right, bottom) = ([int(value) for value in corner] for corner in corners)
    return (left, top), (right - left + 1, bottom - top + 1)


def _placed(path: Path, part: OpenEXR.Part) -> dict[str, np.ndarray]:
    """The channels of a part in its display window, which is what the camera saw."""
    pixels = {name: channel.pixels for name, channel in part.channels.items()}
    data, display = part.header["dataWindow"], part.header["displayWindow"]
    (left, top), (width, height) = _window(data)
    # Pixels that it cannot read, it leaves out without raising.
    if not pixels or any(values is None or values.shape != (height, width) for values in pixels.values()):
        raise _broken(path, "its pixels are cut off or damaged, or channels have sizes of their own")
    (first, upper), (columns, rows) = _window(display)
    if left < first or top < upper or left + width > first + columns or top + height > upper + rows:
        raise InputError(
            path,
            expected=f"pixels within the display window, {_corners(display)}",
            found=f"a data window {_corners(data)}",
            remedy="Crop the image to its display window, which is what the camera sees.",
        )
    stored = {name: np.asarray(values, dtype=np.float32) for name, values in pixels.items()}
    if (width, height) == (columns, rows):
        return stored
    check_pixel_count(path, columns, rows, reading_limits().cropped_pixels)
    place = _place(part)
    whole = {name: np.zeros((rows, columns), np.float32) for name in stored}
    for name, values in stored.items():
        whole[name][place] = values
    return whole


def _place(part: OpenEXR.Part) -> tuple[slice, slice]:
    """Rows and columns of the display window that the data window takes."""
    (left, top), (width, height) = _window(part.header["dataWindow"])
    (first, upper), _ = _window(part.header["displayWindow"])
    return np.s_[top - upper : top - upper + height, left - first : left - first + width]


def _corners(window: tuple[np.ndarray, np.ndarray]) -> str:
    return " to ".join(f"({int(corner[0])}, {int(corner[1])})" for corner in window)


def _joined(path: Path, parts: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """The channels of all parts, none of them twice; parts share the display window, so their sizes agree."""
    names = [name for part in parts for name in part]
    if not names:  # a part of which nothing can be read is left out without raising
        raise _broken(path, "its pixels are cut off or damaged")
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(
            path,
            expected="each channel once",
            found=f"{', '.join(twice)} in several of its {len(parts)} parts",
            remedy="Export the part that is meant into a file of its own.",
        )
    return {name: values for part in parts for name, values in part.items()}


def _broken(path: Path, why: str) -> InputError:
    return InputError(
        path, expected="a whole OpenEXR image", found=f"a file that cannot be read ({why})", remedy=RENDER_AGAIN
    )


def read_array(path: str | Path, names: tuple[str, ...]) -> np.ndarray:
    """The named channels of an EXR file as (H, W, len(names)) float32, all finite.

    Raises:
        InputError: as `read_channels`; also when the file has other channels, or NaN or infinite pixels.
    """
    return _stacked(path, read_channels(path), names)


def _stacked(path: str | Path, channels: dict[str, np.ndarray], names: tuple[str, ...]) -> np.ndarray:
    """`read_array` of the channels that a file was found to have."""
    if set(channels) != set(names):
        raise InputError(
            path,
            expected=f"{len(names)} channel{'s' * (len(names) > 1)} {', '.join(names)}",
            found=f"{len(channels)}: {', '.join(sorted(channels))}",
            remedy="Export the image with exactly these channels.",
        )
    array = np.stack([channels[name] for name in names], axis=-1)
    bad = ~np.isfinite(array)
    if bad.any():
        row, column, channel = (int(index) for index in np.argwhere(bad)[0])
        raise InputError(
            path,
            expected="finite pixels",
            found=f"{int(bad.any(axis=-1).sum())} with NaN or infinity, the first in row {row}, column {column} "
            f"(channel {names[channel]})",
            remedy=RENDER_AGAIN,
        )
    return array


def read_image(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Colour (H, W, 3) and alpha (H, W) of a file, float32, linear, premultiplied as stored.

    Colours are R, G and B, or Y, which is grey; beside other channels those without a layer, or of the layer Combined.
    Alpha is that of the data window for a file without it: 1 within, and 0 outside, where nothing was stored.

    Raises:
        InputError: as `read_array`; or it is not told which of several layers are the colours.
    """
    channels = read_channels(path)
    found = _of_layer(path, channels, COLOURS, "Combined")
    if not found and "Y" in channels and channels.keys() <= {"Y", "A"}:
        found = channels | dict.fromkeys(COLOURS, channels["Y"])
    if found and "A" not in found:
        image = _stacked(path, {name: found[name] for name in COLOURS}, COLOURS)
        return image, _stored(path, image.shape[:2])
    wanted = (*COLOURS, "A")
    image = _stacked(path, {name: found[name] for name in wanted} if found else channels, wanted)
    return np.ascontiguousarray(image[..., :3]), np.ascontiguousarray(image[..., 3])


def read_depth_channel(path: str | Path) -> np.ndarray:
    """(H, W) float32 as stored: Z without a layer or of the layer Depth, the only channel, or levels of grey.

    Raises:
        InputError: as `read_channels`; also where it is not told which channel is the depth.
    """
    channels = read_channels(path)
    found = _of_layer(path, channels, ("Z",), "Depth")
    if found and "X" not in found:  # a vector's
        return found["Z"]
    grey = [values for name, values in channels.items() if len(channels) == 1 or name != "A"]
    levels = len(channels) == 1 or channels.keys() <= {*COLOURS, "A"}
    if not (levels and all(np.array_equal(grey[0], other, equal_nan=True) for other in grey)):
        listed = ", ".join(sorted(channels))
        raise InputError(path, expected="one channel of depth", found=listed, remedy="Export only the depth.")
    return grey[0]


def _of_layer(
    path: str | Path, channels: dict[str, np.ndarray], names: tuple[str, ...], called: str
) -> dict[str, np.ndarray]:
    """Channels by their names within the layer that has `names`; empty if none is told to be the one that is meant.

    That is the nameless one, or else the only one called so (Blender has scene.Combined.R), or the only one there is.

    Raises:
        InputError: several are called so.
    """
    layers: dict[str, dict[str, np.ndarray]] = {}
    for name, values in channels.items():
        layer, _, own = name.rpartition(".")
        layers.setdefault(layer, {})[own] = values
    having = [layer for layer, own in layers.items() if all(name in own for name in names)]
    meant = [layer for layer in having if layer == "" or len(layers) == 1]
    meant = meant or [layer for layer in having if layer.rpartition(".")[2] == called]
    if len(meant) > 1:
        expected, found = f"channels {', '.join(names)} in one layer", f"them in {' and '.join(meant)}"
        remedy = "Export the layer that is meant into a file of its own."
        raise InputError(path, expected=expected, found=found, remedy=remedy)
    return layers[meant[0]] if meant else {}


def _stored(path: str | Path, shape: tuple[int, ...]) -> np.ndarray:
    """(H, W) float32 of a file that was found whole: 1 where all of its parts have pixels, else 0."""
    alpha = np.ones(shape, np.float32)
    with OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
        for part in file.parts:
            inside = np.zeros(shape, np.float32)
            inside[_place(part)] = 1.0
            alpha *= inside
    return alpha


def write_channels(path: str | Path, channels: dict[str, np.ndarray]) -> None:
    """Write {name: (H, W)} as one EXR file, losslessly; float16 stays half, all else becomes float32.

    The file appears under its name only when it is whole.
    """
    stored = {}
    for name, values in channels.items():
        values = np.asarray(values)
        stored[name] = np.ascontiguousarray(values if values.dtype == np.float16 else values.astype(np.float32))
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with replacing(path) as temporary:
        OpenEXR.File(header, stored).write(str(temporary))


def write_image(path: str | Path, image: np.ndarray, alpha: np.ndarray | None = None) -> None:
    """Write colour (H, W, 3), with `alpha` (H, W) if given, as an EXR file; a CPU tensor will do, too.

    Raises:
        ValueError: `image` is not (H, W, 3).
    """
    image = np.asarray(image)
    if image.ndim != 3 or image.shape[2] != 3:
        raise ValueError(f"image must have shape (H, W, 3), got {image.shape}")
    channels = {name: image[..., index] for index, name in enumerate("RGB")}
    if alpha is not None:
        channels["A"] = np.asarray(alpha)
    write_channels(path, channels)
