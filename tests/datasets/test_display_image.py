"""PNG and JPEG: each layout of pixels is read as what it shows, and what cannot be read whole is refused."""

from __future__ import annotations

import struct
import subprocess
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import ExifTags, Image, ImageCms

from rgspipe.datasets.display_image import read_colour_levels, read_levels, saturated_from
from rgspipe.datasets.images import read_colour, read_mask
from rgspipe.errors import InputError
from rgspipe.scene import Camera, look_at, srgb
from scan_layouts import write_wide_png

#: The left half of 6 × 4 pixels counts.
MASK = np.repeat([[255, 255, 255, 0, 0, 0]], 4, axis=0).astype(np.uint8)

COLOUR = np.random.default_rng(0).integers(0, 256, (4, 6, 3), dtype=np.uint8)


def _camera() -> Camera:
    return Camera(look_at([0.0, -2.0, 0.0], [0.0, 0.0, 0.0]), 5.0, 5.0, 3.0, 2.0, 6, 4)


def _png(path: Path, depth: int, kind: int, rows: list[bytes], width: int) -> Path:
    """A PNG as no library at hand writes it."""

    def chunk(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    header = struct.pack(">IIBBBBB", width, len(rows), depth, kind, 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows))
    parts = chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + parts)
    return path


def _palette() -> Image.Image:
    image = Image.fromarray(MASK // 255, mode="P")
    image.putpalette([0, 0, 0, 255, 255, 255])
    return image


@pytest.mark.parametrize(
    "image",
    [
        Image.fromarray(MASK),
        Image.fromarray(np.repeat(MASK[..., None], 3, axis=2)),
        _palette(),
        Image.fromarray(MASK > 0),
        Image.fromarray(257 * MASK.astype(np.uint16)),
        Image.fromarray(np.dstack([MASK, np.full_like(MASK, 255)])),
        Image.fromarray(np.dstack([np.full_like(MASK, 255), MASK])),
        Image.fromarray(np.dstack([COLOUR, MASK])),
    ],
    ids=["grey", "RGB", "palette", "1 bit", "16 bit", "grey, opaque", "white, alpha", "cut out"],
)
def test_a_mask_is_what_it_shows(tmp_path: Path, image: Image.Image) -> None:
    image.save(tmp_path / "mask.png")
    np.testing.assert_array_equal(read_mask(tmp_path / "mask.png", _camera()), MASK / np.float32(255))


def test_a_mask_in_colours_is_refused(tmp_path: Path) -> None:
    Image.fromarray(COLOUR).save(tmp_path / "mask.png")
    with pytest.raises(InputError, match=r"mask\.png.*grey levels, or an alpha channel"):
        read_mask(tmp_path / "mask.png", _camera())


def test_a_palette_is_read_as_its_colours(tmp_path: Path) -> None:
    image = Image.fromarray(COLOUR).quantize(8)
    image.save(tmp_path / "a.png")
    np.testing.assert_array_equal(
        read_colour_levels(tmp_path / "a.png").values, np.asarray(image.convert("RGB")) / np.float32(255)
    )


def test_8_bit_colours_are_their_levels_bit_for_bit(tmp_path: Path) -> None:
    Image.fromarray(np.dstack([COLOUR, MASK])).save(tmp_path / "a.png")
    stored = read_levels(tmp_path / "a.png")
    np.testing.assert_array_equal(stored.values, COLOUR.astype(np.float32) / 255.0)
    np.testing.assert_array_equal(stored.alpha, MASK.astype(np.float32) / 255.0)


def test_16_bit_grey_with_alpha_is_refused_as_half_would_be_lost(tmp_path: Path) -> None:
    path = _png(tmp_path / "deep.png", 16, 4, [bytes(range(4))], 1)
    with pytest.raises(InputError, match=r"deep\.png: expected 8 bits a channel.*found 16.*OpenEXR"):
        read_levels(path)


@pytest.mark.parametrize("channels", [3, 4])
def test_16_bit_colours_are_read_whole_and_clipped_at_their_brightest_level(tmp_path: Path, channels: int) -> None:
    levels = np.random.default_rng(0).integers(0, 65535, (5, 7, channels), dtype=np.uint16)
    levels[0, 0], levels[0, 1] = 65535, 65534
    write_wide_png(tmp_path / "a.png", levels)
    stored = read_levels(tmp_path / "a.png")
    np.testing.assert_array_equal(stored.levels, levels[..., :3])
    assert (stored.opaque is None) == (channels == 3) or np.array_equal(stored.opaque, levels[..., 3])
    assert stored.light[0, 0, 0] >= saturated_from(tmp_path / "a.png") > stored.light[0, 1, 0]


@pytest.mark.parametrize("channels", [1, 3])
def test_a_16_bit_level_or_colour_that_is_transparent_is(tmp_path: Path, channels: int) -> None:
    levels = np.random.default_rng(0).integers(0, 65535, (5, 7, channels), dtype=np.uint16)
    write_wide_png(tmp_path / "a.png", levels)
    _with_chunk(tmp_path / "a.png", b"tRNS", levels[2, 3].astype(">u2").tobytes())
    alpha = read_levels(tmp_path / "a.png").alpha
    assert alpha[2, 3] == 0.0 and alpha.sum() == 34.0


@pytest.mark.parametrize("name", ["a.jpg", "a.png"])
def test_pixels_that_are_to_be_turned_are_refused(tmp_path: Path, name: str) -> None:
    for orientation, refused in ((1, False), (6, True), (3, True)):
        exif = Image.Exif()
        exif[ExifTags.Base.Orientation] = orientation
        Image.fromarray(COLOUR).save(tmp_path / name, exif=exif)
        if not refused:
            assert read_colour_levels(tmp_path / name).levels.shape == (4, 6, 3)
            continue
        with pytest.raises(
            InputError, match=rf"{name}: expected pixels as they are shown.*orientation {orientation}\."
        ):
            read_colour_levels(tmp_path / name)


def test_16_bit_grey_keeps_its_levels(tmp_path: Path) -> None:
    path = _png(tmp_path / "deep.png", 16, 0, [struct.pack(">3H", 0, 258, 65535)], 3)
    expected = np.array([[[0.0], [258 / 65535], [1.0]]], np.float32)
    np.testing.assert_array_equal(read_levels(path).values, expected)


def test_cmyk_is_not_taken_for_rgba(tmp_path: Path) -> None:
    Image.fromarray(COLOUR).convert("CMYK").save(tmp_path / "print.jpg")
    with pytest.raises(InputError, match=r"print\.jpg.*RGB or RGBA.*CMYK"):
        read_colour(tmp_path / "print.jpg")


@pytest.mark.parametrize("kind", ["BMP", "JPEG", "GIF", "TIFF"])
def test_another_format_under_the_name_of_png_is_refused(tmp_path: Path, kind: str) -> None:
    Image.fromarray(COLOUR).save(tmp_path / "a.png", format=kind)
    with pytest.raises(InputError, match=r"a\.png.*a PNG image, as its name says"):
        read_levels(tmp_path / "a.png")


def test_another_suffix_is_refused(tmp_path: Path) -> None:
    Image.fromarray(COLOUR).save(tmp_path / "a.bmp")
    with pytest.raises(InputError, match=r"a\.bmp.*ending in \.exr, \.png, \.jpg"):
        read_levels(tmp_path / "a.bmp")


def test_an_eps_by_another_name_starts_no_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def started(*_: object, **__: object) -> None:
        raise AssertionError("a program was started")

    monkeypatch.setattr(subprocess, "check_call", started)
    monkeypatch.setattr(subprocess, "Popen", started)
    (tmp_path / "a.png").write_text("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 8 8\n%%EndComments\nshowpage\n%%EOF\n")
    with pytest.raises(InputError, match="another format"):
        read_levels(tmp_path / "a.png")


@pytest.mark.parametrize("side", [13_000, 60_000])
def test_a_small_file_of_a_huge_image_is_refused_before_it_is_decoded(tmp_path: Path, side: int) -> None:
    path = _png(tmp_path / "bomb.png", 8, 2, [b""], side)
    content = bytearray(path.read_bytes())
    content[20:24] = struct.pack(">I", side)
    content[29:33] = struct.pack(">I", zlib.crc32(content[12:29]))
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"bomb\.png"):
        read_levels(path)


def test_reading_takes_little_more_than_the_image_does(tmp_path: Path) -> None:
    """Colours take 12 bytes a pixel, alpha 4. Measured 27 in all; 80 while the curve was computed of each pixel."""
    Image.new("RGBA", (1000, 1000), (9, 99, 199, 99)).save(tmp_path / "a.png")
    tracemalloc.start()
    try:
        read_colour(tmp_path / "a.png")
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 40e6


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_levels_that_are_looked_up_are_those_of_the_curve(kind: type) -> None:
    levels = np.arange(np.iinfo(kind).max + 1, dtype=kind).reshape(-1, 2)[:, ::-1]
    wanted = srgb.decode(levels / np.iinfo(kind).max).astype(np.float32)
    np.testing.assert_array_equal(srgb.decode_levels(levels), wanted)


def _with_chunk(path: Path, name: bytes, content: bytes) -> None:
    """Put a chunk before the pixels of a PNG."""
    png = path.read_bytes()
    place = png.index(b"IDAT") - 4
    packed = struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
    path.write_bytes(png[:place] + packed + png[place:])


def _coloured(path: Path, bits: int) -> np.ndarray:
    """The levels of a PNG in colour of so many bits, which is written."""
    levels = COLOUR if bits == 8 else 257 * COLOUR.astype(np.uint16)
    Image.fromarray(levels).save(path) if bits == 8 else write_wide_png(path, levels)
    return levels


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize(("gamma", "good"), [(45455, True), (43000, True), (100000, False), (55556, False), (0, False)])
def test_colours_by_another_curve_are_refused(tmp_path: Path, gamma: int, good: bool, bits: int) -> None:
    """Of linear levels (a gamma of 1) those of sRGB were made a second time."""
    levels = _coloured(tmp_path / "a.png", bits)
    _with_chunk(tmp_path / "a.png", b"gAMA", struct.pack(">I", gamma))
    np.testing.assert_array_equal(read_levels(tmp_path / "a.png").levels, levels)
    if good:
        read_colour(tmp_path / "a.png")
        return
    with pytest.raises(InputError, match=r"a\.png: expected colours as of sRGB, found a gamma of"):
        read_colour(tmp_path / "a.png")


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize(
    ("code", "good"),
    [((1, 13, 0, 1), True), ((9, 13, 0, 1), True), ((1, 2, 0, 1), True), ((1,), True)]
    + [((1, transfer, 0, 1), False) for transfer in (1, 8, 16, 18)]
    + [((1, 13, 0, 0), False)],
)
def test_colours_by_another_curve_of_cicp_are_refused(
    tmp_path: Path, code: tuple[int, ...], good: bool, bits: int
) -> None:
    """Of film (BT.709), of linear light, of HDR (PQ, HLG), and of levels that do not begin at 0."""
    _coloured(tmp_path / "a.png", bits)
    _with_chunk(tmp_path / "a.png", b"cICP", bytes(code))
    if good:
        read_colour(tmp_path / "a.png")
        return
    with pytest.raises(InputError, match=r"a\.png: .*found transfer characteristics \d+ of .* the chunk cICP"):
        read_colour(tmp_path / "a.png")


def test_what_cicp_says_stands_above_a_gamma(tmp_path: Path) -> None:
    _coloured(tmp_path / "a.png", 8)
    for name, content in ((b"cICP", bytes([1, 13, 0, 1])), (b"gAMA", struct.pack(">I", 100000))):
        _with_chunk(tmp_path / "a.png", name, content)
    read_colour(tmp_path / "a.png")


@pytest.mark.parametrize(("space", "named", "good"), [(65535, "R03", False), (1, "R98", True), (65535, "R98", True)])
def test_photographs_that_exif_says_to_be_in_adobe_rgb_are_refused(
    tmp_path: Path, space: int, named: str, good: bool
) -> None:
    """Cameras write no profile of it, but a name in EXIF (DCF 2.0)."""
    exif = Image.Exif()
    exif.get_ifd(ExifTags.IFD.Exif).update({0xA001: space, ExifTags.IFD.Interop: {1: named}})
    Image.fromarray(COLOUR).save(tmp_path / "a.jpg", exif=exif)
    if good:
        read_colour(tmp_path / "a.jpg")
        return
    with pytest.raises(InputError, match=r"a\.jpg: expected colours as of sRGB, found AdobeRGB.* remove its EXIF"):
        read_colour(tmp_path / "a.jpg")


def test_16_bit_pixels_that_are_to_be_turned_are_refused(tmp_path: Path) -> None:
    _coloured(tmp_path / "a.png", 16)
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = 6
    _with_chunk(tmp_path / "a.png", b"eXIf", exif.tobytes().removeprefix(b"Exif\0\0"))
    with pytest.raises(InputError, match=r"a\.png: expected pixels as they are shown.*orientation 6\."):
        read_levels(tmp_path / "a.png")


@pytest.mark.parametrize(
    ("gamma", "good"),
    [("00026666", True), ("00023333", False), ("0001cccd", False)],  # 2.4, as sRGB has it with its toe, 2.2, 1.8
)
@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_colours_by_the_curve_of_another_profile_are_refused(
    tmp_path: Path, suffix: str, gamma: str, good: bool
) -> None:
    """Photographs in AdobeRGB or ProPhoto were taken for sRGB."""
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    assert profile.count(bytes.fromhex("00026666")) == 1
    profile = profile.replace(bytes.fromhex("00026666"), bytes.fromhex(gamma))
    path = tmp_path / f"a{suffix}"
    Image.fromarray(COLOUR).save(path, icc_profile=profile)
    assert read_levels(path).levels.shape == COLOUR.shape
    if good:
        read_colour(path)
        return
    with pytest.raises(InputError, match=r"expected colours as of sRGB, found the profile .* levels off"):
        read_colour(path)


@pytest.mark.parametrize("profile", [b"x", b"\0" * 500])
def test_a_damaged_profile_says_nothing(tmp_path: Path, profile: bytes) -> None:
    Image.fromarray(COLOUR).save(tmp_path / "a.png", icc_profile=profile)
    read_colour(tmp_path / "a.png")


@pytest.mark.parametrize("levels", [90, 0])
def test_colours_without_any_alpha_are_refused(tmp_path: Path, levels: int) -> None:
    """As programs write them that have no use for alpha: the photograph counted as one of nothing."""
    Image.fromarray(np.array([[[levels] * 3 + [0]] * 2], np.uint8)).save(tmp_path / "a.png")
    if levels == 0:  # nothing is in sight
        assert not read_colour(tmp_path / "a.png")[1].any()
        return
    with pytest.raises(InputError, match=r"a\.png.*opaque.*alpha 0 everywhere, beside colours up to 0\.10"):
        read_colour(tmp_path / "a.png")


def test_a_mask_of_levels_0_and_1_is_one_of_false_and_true(tmp_path: Path) -> None:
    """As libraries store it; it left 1/255 of all pixels."""
    Image.fromarray((MASK > 0).astype(np.uint8)).save(tmp_path / "mask.png")
    np.testing.assert_array_equal(read_mask(tmp_path / "mask.png", _camera()), (MASK > 0).astype(np.float32))
