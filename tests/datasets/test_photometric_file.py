"""IES and EULUMDAT files: read as they are meant, written and read again, and refused in words."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import torch

from luminaire_files import COLUMNS, ies, ldt
from rgspipe.datasets.photometric_file import read_catalogue, read_photometry
from rgspipe.errors import InputError
from rgspipe.light_export.export import export_lights
from rgspipe.light_export.ies import ies as write_ies
from rgspipe.scene.lights import LedLight, Photometry, ProfileLight


def read(folder: Path, name: str, text: str) -> Photometry:
    (folder / name).write_bytes(text.encode("latin-1"))
    return read_photometry(folder / name)


def candela(table: Photometry) -> torch.Tensor:
    """(H, V)."""
    return table.candela * table.relative.T


def test_planes_of_half_a_turn_are_mirrored(tmp_path: Path) -> None:
    """Candela times multiplier and ballast factor; decimal commas, blank lines and capitals do no harm."""
    table = read(tmp_path, "a.IES", ies())
    assert torch.rad2deg(table.horizontal).tolist() == pytest.approx([0.0, 90.0, 180.0, 270.0])
    assert torch.rad2deg(table.vertical).tolist() == pytest.approx([0.0, 45.0, 90.0])
    expected = torch.tensor([COLUMNS[k] for k in (0, 1, 2, 1)], dtype=torch.float64)
    torch.testing.assert_close(candela(table), expected)


@pytest.mark.parametrize(
    ("planes", "count", "horizontal"),
    [("0", 1, [0]), ("0 45 90", 3, [0, 45, 90, 135, 180, 225, 270, 315]), ("0 120 360", 3, [0, 240])],
)
def test_the_last_plane_tells_the_symmetry(tmp_path: Path, planes: str, count: int, horizontal: list[float]) -> None:
    table = read(tmp_path, "a.ies", ies(planes, COLUMNS[:count]))
    assert torch.rad2deg(table.horizontal).tolist() == pytest.approx(horizontal)


@pytest.mark.parametrize("name", ["a.ies", "a.ldt"])
def test_planes_are_counted_anticlockwise_from_above(tmp_path: Path, name: str) -> None:
    """As LM-63-2002 defines horizontal angles, and Radiance's ies2rad reads them; written, they are what was read."""
    columns = [[1, 1, 0], [1, 9, 0], [1, 1, 0], [1, 2, 0], [1, 1, 0]]
    text = ies("0 90 180 270 360", columns) if name == "a.ies" else ldt(0, 4, columns[:4])
    table = read(tmp_path, name, text)
    light = ProfileLight([0.0, 0.0, 1.0], 1.0, [0.0, 0.0, -1.0], 0.0, table)
    below = torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], dtype=torch.float64)
    expected = torch.tensor([1.0, 9.0, 1.0, 2.0], dtype=torch.float64) / 9.0
    torch.testing.assert_close(light.relative_intensity_towards(below), expected)
    again = read(tmp_path, "again.ies", write_ies(light, "again")[0])
    torch.testing.assert_close(again.horizontal, table.horizontal)
    # Files have six digits: measured 3.3e-7.
    torch.testing.assert_close(again.relative, table.relative, rtol=0.0, atol=2e-6)


@pytest.mark.parametrize(
    ("first", "factor"),
    [
        ("IES:LM-63-2019", 1.0),
        ("IESNA:LM-63-2002", 1.0),
        ("IESNA:LM-63-1995", 1.10101),
        ("IESNA91", 1.10101),
        ("[MANUFAC] maker", 1.10101),
    ],
)
def test_how_a_file_was_made_is_no_factor(tmp_path: Path, first: str, factor: float) -> None:
    """The number that was one of ballast and lamp, until 2002: the light of a file of 2019 was 10 % too strong."""
    text = ies().replace("IESNA:LM-63-2002", first).replace("\n0.5 1 20", "\n0.5 1.10101 20")
    expected = torch.tensor([COLUMNS[k] for k in (0, 1, 2, 1)], dtype=torch.float64)
    torch.testing.assert_close(candela(read(tmp_path, "a.ies", text)), factor * expected)


@pytest.mark.parametrize(
    ("symmetry", "planes", "known"), [(0, 4, (0, 1, 2, 1)), (1, 4, (0,)), (2, 4, (0, 1, 2)), (4, 8, (0, 1, 2))]
)
def test_eulumdat_is_candela_per_1000_lumens(tmp_path: Path, symmetry: int, planes: int, known: tuple) -> None:
    table = read(tmp_path, "a.ldt", ldt(symmetry, planes, [COLUMNS[k] for k in known]))
    full = {0: (0, 1, 2, 1), 1: (0,), 2: (0, 1, 2, 1), 4: (0, 1, 2, 1, 0, 1, 2, 1)}[symmetry]
    torch.testing.assert_close(candela(table), 2.0 * torch.tensor([COLUMNS[k] for k in full], dtype=torch.float64))


def test_symmetry_about_the_other_plane(tmp_path: Path) -> None:
    """Of the planes 270°, 0° and 90°; 180° is the mirror image of 0°."""
    table = read(tmp_path, "a.ldt", ldt(3, 4, [*COLUMNS]))
    expected = torch.tensor([COLUMNS[k] for k in (1, 0, 1, 2)], dtype=torch.float64)
    torch.testing.assert_close(candela(table), 2.0 * expected)


def test_tilted_lamps_are_read_as_they_were_measured(tmp_path: Path) -> None:
    tilted = ies(tilt="TILT=INCLUDE\n1\n2\n0 90\n1 0.9")
    assert read(tmp_path, "a.ies", tilted) == read(tmp_path, "a.ies", ies())


def test_lights_above_the_horizon_begin_dark(tmp_path: Path) -> None:
    table = read(tmp_path, "a.ies", ies().replace("0 45 90\n0 90", "90 135 180\n0 90"))
    below = table.at(torch.tensor([0.0, 1.0, 1.5]).double(), torch.zeros(3).double())
    assert float(below.abs().max()) == 0.0 and float(table.relative.max()) == 1.0


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    """Absolute candela of an LED, and of a luminaire that is not round."""
    led = LedLight([0, 0, 0], [1.0, 2.0, 0.5], [0, 0, -1], 4.0)
    export_lights(led, tmp_path, ["ies"])
    found = read_photometry(tmp_path / "lamp_1.ies")
    angle = torch.linspace(0.0, math.pi, 200, dtype=torch.float64)
    torch.testing.assert_close(found.at(angle), led.relative_intensity_at(angle), rtol=0.0, atol=1e-4)
    lamp = ProfileLight([0, 0, 0], 3.0, [0, 0, -1], 0.3, read(tmp_path, "a.ies", ies()))
    export_lights(lamp, tmp_path, ["ies"])
    again = read_photometry(tmp_path / "lamp_1.ies")
    torch.testing.assert_close(again.relative, lamp.table.relative, rtol=0.0, atol=1e-5)
    assert again.candela == pytest.approx(3.0 * 683.0, rel=1e-5)


def test_a_catalogue_is_every_file_of_a_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="none"):
        read_catalogue(tmp_path)
    read(tmp_path, "b.ies", ies())
    read(tmp_path, "a.ldt", ldt(1, 4, [COLUMNS[0]]))
    (tmp_path / "notes.txt").write_text("nothing")
    assert list(read_catalogue(tmp_path)) == ["a.ldt", "b.ies"]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.ies", "", "TILT"),
        ("a.ies", ies(tilt="TILT=lamp.tlt"), "TILT=NONE or TILT=INCLUDE"),
        ("a.ies", ies(kind=2), "type C .* type B"),
        ("a.ies", ies(planes="0 90 170"), "0°, 90°, 180° or 360°"),
        ("a.ies", ies(planes="0 180 90"), "rise"),
        ("a.ies", ies(columns=([1, -2, 0], *COLUMNS[1:])), "candela from 0"),
        ("a.ies", ies(columns=([1, "x", 0], *COLUMNS[1:])), "a number for candela"),
        ("a.ies", ies(columns=([0, 0, 0],) * 3), "intensity above 0"),
        ("a.ies", ies(more="7"), "more"),
        ("a.ies", ies()[:-12], "end of the file"),
        ("a.ldt", ldt(7, 4, [*COLUMNS]), "symmetry from 0 to 4"),
        ("a.ldt", ldt(4, 6, [*COLUMNS]), "suit the symmetry"),
        ("a.ldt", ldt(2, 4, [*COLUMNS])[:-20], "end of the file|intensities"),
        ("a.txt", ies(), ".ies or .ldt"),
    ],
)
def test_what_is_no_such_file_is_refused_in_words(tmp_path: Path, name: str, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as refused:
        read(tmp_path, name, text)
    assert name in str(refused.value)
