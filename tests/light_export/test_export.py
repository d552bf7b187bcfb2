"""Lights in the formats of other programs say what ours do, in their units and axes."""

from __future__ import annotations

import ast
import json
import math
import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
import torch

import rgspipe as rg
from rgspipe.datasets.light_file import read_lights
from rgspipe.datasets.photometric_file import read_photometry
from rgspipe.errors import InputError
from rgspipe.light_export.export import FORMATS, NAMES, export_lights
from rgspipe.light_export.world import World, candela, lumens
from rgspipe.scene import Light
from rgspipe.scene.lights import KINDS

AXIS = torch.nn.functional.normalize(torch.tensor([0.5, 0.3, -0.8], dtype=torch.float64), dim=0)
RIG = tuple(
    kind.shaped().at(torch.tensor([0.1 * k, 0.2, 0.3]).double(), AXIS, torch.tensor([1.0, 2.0, 0.5]).double())
    for k, kind in enumerate(KINDS.values())
)
BY_KIND = {light.kind: light for light in RIG}


def text(folder: Path, name: str, *lights: Light, **options: object) -> str:
    export_lights(lights, folder, [name], **options)
    return (folder / NAMES[name]).read_text()


def test_every_format_is_written_for_every_kind(tmp_path: Path) -> None:
    done = export_lights(RIG, tmp_path, metres=2.0, covariances=[1e-4 * torch.eye(6).double()] * len(RIG))
    finite = [number for number, light in enumerate(RIG, start=1) if not light.distant]
    assert {path.name for path in done.files} == {*NAMES.values(), *(f"lamp_{n}.ies" for n in finite)}
    assert all(path.stat().st_size > 0 for path in done.files)
    # What a format does not hold is said of each light.
    assert any("the panel is left out" in line for line in done.lines)
    assert any("LM-63 has no suns" in line for line in done.lines)
    assert "lumens" not in (tmp_path / "lamps.txt").read_text() and "683" in (tmp_path / "lamps.txt").read_text()


def test_light_from_all_around_is_in_json_and_said_of_the_others(tmp_path: Path) -> None:
    """Radiance is the same in every unit of length."""
    around = torch.tensor([0.5, 0.25, 1.0]).double()
    done = export_lights(BY_KIND["point"], tmp_path, ["json", "blend"], metres=2.0, ambient=around)
    assert rg.read_ambient(tmp_path / "lamps.json").tolist() == around.tolist()
    said = "light from all around, (0.5, 0.25, 1) W/(sr·m²), which JSON alone holds"
    assert any(said in line for line in done.lines) and said in (tmp_path / "lamps.txt").read_text()
    alone = export_lights(BY_KIND["point"], tmp_path, ["json"], ambient=around, notes=["As it was."])
    assert "As it was." in alone.lines and not any("all around" in line for line in alone.lines)


@pytest.mark.parametrize("metres", [0.1, 1.0, 10.0])
def test_a_light_file_in_metres_gives_the_same_irradiance(tmp_path: Path, metres: float) -> None:
    """I/d² is the same in both units, and so is a sun's irradiance."""
    text(tmp_path, "json", *RIG, metres=metres)
    for light, exported in zip(RIG, rg.read_lights(tmp_path / "lamps.json", any_world=True), strict=True):
        torch.testing.assert_close(exported.position, metres * light.position)
        factor = 1.0 if light.distant else metres**2
        torch.testing.assert_close(exported.intensity / factor, light.intensity)
    sphere = rg.read_lights(tmp_path / "lamps.json", any_world=True)[[*BY_KIND].index("sphere")]
    assert sphere.radius == pytest.approx(metres * BY_KIND["sphere"].radius)
    if metres == 1.0:
        assert len(rg.read_lights(tmp_path / "lamps.json")) == len(RIG)
    else:
        with pytest.raises(InputError, match="expected lights in the scene's units"):
            rg.read_lights(tmp_path / "lamps.json")


def test_scaling_and_offset_of_a_scene_are_undone() -> None:
    """scene = (file + offset) · rescale, and a lamp of so many watts has them again."""
    there, watts = torch.tensor([3.0, -2.0, 5.0]).double(), 100.0
    world = World(1.0, 0.125, (-1.0, 0.5, -2.0))
    in_scene = (there + torch.tensor(world.offset).double()) * world.rescale
    found = rg.PointLight(in_scene, watts / (4.0 * math.pi) * world.rescale**2)
    (light,) = world.lights((found,))
    torch.testing.assert_close(light.position, there)
    torch.testing.assert_close(light.power(), torch.full((3,), watts).double())


def test_photometric_units_are_683_lumens_a_watt_of_luminance() -> None:
    white = rg.PointLight([0.0, 0.0, 0.0], 1.0)
    assert candela(white) == pytest.approx(683.0) and lumens(white) == pytest.approx(4.0 * math.pi * 683.0)


def test_gltf_is_y_up_and_its_lights_shine_along_minus_z(tmp_path: Path) -> None:
    content = json.loads(text(tmp_path, "gltf", BY_KIND["point"], BY_KIND["spot"]))
    lights = content["extensions"]["KHR_lights_punctual"]["lights"]
    assert [light["type"] for light in lights] == ["point", "spot"]
    assert lights[0]["intensity"] == pytest.approx(2.0 * 683.0) and lights[0]["color"] == [0.5, 1.0, 0.25]
    for node, light in zip(content["nodes"], (BY_KIND["point"], BY_KIND["spot"]), strict=True):
        matrix = np.array(node["matrix"]).reshape(4, 4).T
        x, y, z = light.position.tolist()
        np.testing.assert_allclose(matrix[:3, 3], [x, z, -y])
        np.testing.assert_allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=1e-12)
    x, y, z = AXIS.tolist()
    np.testing.assert_allclose(matrix[:3, :3] @ [0, 0, -1], [x, z, -y], atol=1e-12)


def test_mitsuba_s_emitters_have_our_radiance_and_axes(tmp_path: Path) -> None:
    root = ElementTree.fromstring(text(tmp_path, "mitsuba", *RIG))
    values = [[float(x) for x in rgb.get("value").split(",")] for rgb in root.iter("rgb")]
    sphere, panel = BY_KIND["sphere"], BY_KIND["panel"]
    np.testing.assert_allclose(values[0], [1.0, 2.0, 0.5])
    np.testing.assert_allclose(values[3], sphere.intensity / (math.pi * sphere.radius**2))
    np.testing.assert_allclose(values[4], panel.intensity / (panel.width * panel.height))
    matrices = [np.array(m.get("value").split(), dtype=float).reshape(4, 4) for m in root.iter("matrix")]
    (sun,) = (one for one in root.iter("emitter") if one.get("type") == "directional")
    np.testing.assert_allclose([float(sun.find("vector").get(axis)) for axis in "xyz"], AXIS)
    np.testing.assert_allclose(values[5], BY_KIND["sun"].intensity)
    for matrix in matrices:  # spots and rectangles look along +z
        direction = matrix[:3, :3] @ [0, 0, 1]
        np.testing.assert_allclose(direction / np.linalg.norm(direction), AXIS, atol=1e-12)
        assert np.linalg.det(matrix[:3, :3]) > 0.0
    rectangle = np.array(root.find("shape[@type='rectangle']//matrix").get("value").split(), dtype=float).reshape(4, 4)
    area = 4.0 * np.linalg.norm(np.cross(rectangle[:3, 0], rectangle[:3, 1]))
    assert area == pytest.approx(panel.width * panel.height)


def luminaire(folder: Path, *candela: float) -> Light:
    """One that hangs at height 2 and sends these towards 0, 30, …, 180 degrees from straight down."""
    shown = " ".join(map(str, candela))
    header = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 7 1 1 2 0 0 0\n1 1 10\n"
    (folder / "made.ies").write_text(f"{header}0 30 60 90 120 150 180\n0\n{shown}\n")
    down = torch.tensor([0.0, 0.0, -1.0], dtype=torch.float64)
    return rg.ProfileLight([0.0, 0.0, 2.0], 5.0, down, 0.0, read_photometry(folder / "made.ies"))


@pytest.mark.parametrize(
    ("candela", "up", "peak", "lost"),
    [
        ((1000, 800, 400, 0, 0, 0, 0), False, 1.0, None),
        ((0, 0, 0, 0, 400, 800, 1000), True, 1.0, None),
        ((100, 80, 40, 0, 500, 900, 1000), True, 1.0, "8"),
        ((1000, 900, 500, 0, 40, 80, 100), False, 1.0, "8"),
    ],
)
def test_a_cone_looks_where_most_of_the_light_goes(
    tmp_path: Path, candela: tuple[float, ...], up: bool, peak: float, lost: str | None
) -> None:
    """Up where it does, with the peak that is there; what goes the other way is said."""
    light, way = luminaire(tmp_path, *candela), 1.0 if up else -1.0
    done = export_lights(light, tmp_path, ["gltf", "three", "mitsuba", "usda"])
    content = json.loads((tmp_path / NAMES["gltf"]).read_text())
    matrix = np.array(content["nodes"][0]["matrix"]).reshape(4, 4).T
    assert -matrix[:3, 2] == pytest.approx([0.0, way, 0.0])  # Y is up, and −z is where it shines
    [spot] = content["extensions"]["KHR_lights_punctual"]["lights"]
    assert spot["intensity"] == pytest.approx(683.0 * 5.0 * peak)
    lamp, target = json.loads((tmp_path / NAMES["three"]).read_text())["object"]["children"]
    assert target["matrix"][12:15] == pytest.approx([0.0, 0.0, 2.0 + way])
    assert lamp["intensity"] == pytest.approx(683.0 * 5.0 * peak)
    emitter = ElementTree.parse(tmp_path / NAMES["mitsuba"]).getroot()[0]
    to_world = np.array(emitter.find("transform/matrix").get("value").split(), dtype=float).reshape(4, 4)
    assert to_world[:3, 2] == pytest.approx([0.0, 0.0, way])
    [rows] = re.findall(r"xformOp:transform = (.*)", (tmp_path / NAMES["usda"]).read_text())
    assert np.array(ast.literal_eval(rows))[2, :3] == pytest.approx([0.0, 0.0, -way])
    said = [line for line in done.lines if "beyond 90°" in line]
    assert len(said) == (0 if lost is None else 4) and all(f"{lost}" in line for line in said)


def test_a_cone_that_is_too_wide_is_cut_with_a_word(tmp_path: Path) -> None:
    spot = rg.SpotLight([0.0, 0.0, 1.0], 1.0, [0.0, 0.0, -1.0], "smoothstep", math.radians(120.0), 0.5)
    done = export_lights(spot, tmp_path, ["gltf", "three", "blend"])
    [shown] = json.loads((tmp_path / NAMES["gltf"]).read_text())["extensions"]["KHR_lights_punctual"]["lights"]
    assert shown["spot"]["outerConeAngle"] == pytest.approx(0.5 * math.pi)
    assert sum("beyond 90°" in line for line in done.lines) == 2
    # Blender's own spots end there, too: its shader does not.
    assert "spot_size=" not in (tmp_path / NAMES["blend"]).read_text()


def test_a_place_that_is_not_known_has_no_ellipsoid_and_says_so(tmp_path: Path) -> None:
    light = rg.PointLight([0.0, 0.0, 1.0], 1.0)
    done = export_lights(light, tmp_path, ["blend"], covariances=[torch.tensor([math.inf, 1e-4, 1e-4]).diag()])
    assert any("light 1" in line and "no ellipsoid" in line for line in done.lines)
    assert 'region("light' not in (tmp_path / NAMES["blend"]).read_text()


def test_blender_s_script_says_that_it_is_in_metres(tmp_path: Path) -> None:
    light = rg.PointLight([0.0, 0.0, 1.0], 1.0)
    for metres, said in ((0.01, True), (1.0, False)):
        lines = export_lights(light, tmp_path, ["blend"], metres=metres).lines
        assert any("metres=1" in line for line in lines) is said


def test_blender_s_script_runs_where_nothing_falls_off_softly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blender 3.4 and its like have no such switch; the script ended with an AttributeError."""

    class Data(SimpleNamespace):
        bl_rna = SimpleNamespace(properties=("energy", "color", "shadow_soft_size"))

        def __setattr__(self, name: str, value: object) -> None:
            assert name in self.bl_rna.properties
            super().__setattr__(name, value)

    made: list[Data] = []

    def new(*_: object) -> Data:
        made.append(Data())
        return made[-1]

    blender = MagicMock()
    blender.data.lights.new = new
    monkeypatch.setitem(sys.modules, "bpy", blender)
    monkeypatch.setitem(sys.modules, "mathutils", MagicMock())
    monkeypatch.setattr(sys, "argv", ["blender"])
    exec(text(tmp_path, "blend", BY_KIND["point"]), {})
    assert made[0].shadow_soft_size == 0.0 and made[0].energy == pytest.approx(8.0 * math.pi)


def test_ies_files_have_the_candela_of_every_angle(tmp_path: Path) -> None:
    led = BY_KIND["led"]
    export_lights(led, tmp_path, ["ies"])
    raw = (tmp_path / "lamp_1.ies").read_bytes().decode("ascii")
    lines = raw.split("\r\n")
    assert lines[0] == "IESNA:LM-63-2002" and max(map(len, lines)) < 256
    numbers = [float(x) for x in " ".join(lines[lines.index("TILT=NONE") + 1 :]).split()]
    count = int(numbers[3])
    angles, values = numbers[13 : 13 + count], numbers[14 + count :]
    assert angles[0] == 0.0 and angles[-1] == 180.0 and len(values) == count
    np.testing.assert_allclose(values[0], candela(led), rtol=1e-5)
    at_60 = values[angles.index(60.0)]
    assert at_60 == pytest.approx(candela(led) * 0.5**led.exponent, rel=1e-5)


def test_the_same_lights_give_the_same_files(tmp_path: Path) -> None:
    one, other = (export_lights(RIG, tmp_path / name).files for name in "ab")
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in other]


@pytest.mark.parametrize("metres", [1e9, 1e-9])
def test_what_is_refused_is_what_cannot_be_read_back(tmp_path: Path, metres: float) -> None:
    """Candela and W/sr go with the square of a unit: 1 W/sr in units of 10⁹ m is 6.8·10²⁰ cd."""
    lamp = rg.PointLight([0.0, 0.0, 1.0], 1.0)
    if metres > 1.0:
        with pytest.raises(InputError, match=r"lamp_1\.ies: expected at most 1e\+15 cd"):
            export_lights(lamp, tmp_path, ["usda", "ies"], metres=metres)
        assert list(tmp_path.iterdir()) == []
    lamp = rg.PointLight([0.0, 0.0, 1.0], 1.0 / metres**2)
    export_lights(lamp, tmp_path, ["ies", "json"], metres=metres)
    assert read_photometry(tmp_path / "lamp_1.ies").relative.max() == 1.0
    (back,) = read_lights(tmp_path / "lamps.json", any_world=True)
    # The square of a unit is taken twice, in double precision.
    torch.testing.assert_close(back.intensity, torch.ones(3).double())


@pytest.mark.parametrize(
    ("light", "metres", "said"),
    [
        (
            rg.PointLight([0.0, 0.0, 20.0], 1.0),
            1e9,
            r"lights\[0\]\.position: expected at most 1e\+10 m, found 2e\+10 m",
        ),
        (rg.PointLight([0.0, 0.0, 1.0], 1e3), 1e8, r"lights\[0\]\.intensity: expected at most 1e\+18 W/sr"),
        (rg.SphereLight([0.0, 0.0, 1.0], 1.0, 20.0), 1e9, r"lights\[0\]\.radius: expected at most 1e\+10 m"),
        (rg.SphereLight([0.0, 0.0, 1.0], 1.0, 1e-30), 1.0, "radiance: expected at most"),
        (rg.PanelLight([0.0, 0.0, 1.0], 1.0, [0.0, 0.0, -1.0], 0.0, 1.0), 1.0, "radiance: expected .* found inf"),
        (rg.PointLight([0.0, 0.0, 1.0], 1.0), 1e200, "metres: expected 1e-09 to 1e"),
        (rg.PointLight([0.0, 0.0, 1.0], 1.0), 1e-200, "metres: expected 1e-09 to 1e"),
    ],
)
def test_lights_that_no_format_can_hold_are_refused(tmp_path: Path, light: Light, metres: float, said: str) -> None:
    with pytest.raises(InputError, match=said):
        export_lights(light, tmp_path / "lamps", metres=metres)
    assert not (tmp_path / "lamps").exists()


def test_wrong_requests_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="formats"):
        export_lights(RIG, tmp_path, ["fbx"])
    with pytest.raises(InputError, match="metres"):
        export_lights(RIG, tmp_path, FORMATS, metres=0.0)
