"""stage=export export.lights: lights for other programs, where they are in the scene's own file."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
import torch

from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.errors import InputError
from rgspipe.graph.pipeline import run
from rgspipe.graph.resolver import resolve
from rgspipe.scene import PointLight
from rgspipe.stages import load_stage
from rgspipe.stages.scene.export import world_of
from rgspipe.stages.scene.light_origin import elsewhere_line

LIGHT = PointLight(torch.tensor([0.1, -0.25, 0.3]).double(), torch.tensor([1.0, 2.0, 0.5]).double())


def configured(root: Path, *overrides: str) -> RgspipeConfig:
    return compose_config(["stage=export", "scene=cornell", f"outputs={root / 'out'}", *overrides])


def test_lights_are_exported_without_the_scene_being_made(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    write_lights(tmp_path / "light.json", (LIGHT,), {"lights": [{"covariance": (1e-4 * torch.eye(6)).tolist()}]})
    wanted = [f"export.light={tmp_path / 'light.json'}", "export.lights=[json,blend,gltf]", "export.metres=2.5"]
    artifact = run(configured(tmp_path, *wanted), load_stage)
    assert {path.name for path in (tmp_path / "out" / "cornell").iterdir()} == {"export"}
    (light,) = read_lights(artifact.file("lamps.json"), any_world=True)
    torch.testing.assert_close(light.position, 2.5 * LIGHT.position)
    torch.testing.assert_close(light.intensity, 2.5**2 * LIGHT.intensity)
    assert 'region("light 1 (95 %)"' in artifact.file("lamps_blender.py").read_text()
    assert "a scene unit is 2.5 m" in capsys.readouterr().out


def test_lights_without_a_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"export\.light"):
        resolve(configured(tmp_path, "export.lights=[json]"), load_stage)
    with pytest.raises(InputError, match=r"export\.lights"):
        configured(tmp_path, "export.lights=[fbx]")


def test_a_blend_s_own_coordinates_come_back(tmp_path: Path) -> None:
    """dataset_info.json says how they became the scene's: (x + offset) · rescale."""
    info = tmp_path / "dataset_info.json"
    info.write_text(json.dumps({"version": 1, "rescale": 0.2, "offset": [1.0, 2.0, -3.0]}))
    world = world_of(1.0, info)
    there = torch.tensor([4.0, -1.0, 2.5]).double()
    scene = PointLight((there + torch.tensor([1.0, 2.0, -3.0]).double()) * 0.2, 100.0 / (4.0 * math.pi) * 0.2**2)
    (light,) = world.lights((scene,))
    torch.testing.assert_close(light.position, there)
    assert float(light.power()[0]) == pytest.approx(100.0)
    assert world_of(2.0, None).unit == 2.0


def test_lights_of_a_fit_are_put_where_its_own_dataset_says(tmp_path: Path) -> None:
    """Also where the configuration is of another dataset, or of another scene: neither is made."""
    scene = tmp_path / "room"
    made(scene / "generate_dataset" / ("a" * 16), {})
    (scene / "generate_dataset" / ("a" * 16) / "dataset_info.json").write_text(
        json.dumps({"version": 1, "rescale": 0.2, "offset": [1.0, 2.0, -3.0]})
    )
    made(scene / "freeze" / ("b" * 16), {"generate_dataset": ["a" * 16]})
    made(scene / "track" / ("c" * 16), {"freeze": ["b" * 16], "generate_targets": ["d" * 16]})
    (scene / "track" / "latest").symlink_to("c" * 16)
    write_lights(scene / "track" / ("c" * 16) / "lights.json", LIGHT)
    light = scene / "track" / "latest" / "lights.json"
    blend = ["scene=blend", f"scene.path={tmp_path / 'room.blend'}"]
    (tmp_path / "room.blend").write_bytes(b"")
    for other in (blend, []):
        artifact = run(configured(tmp_path, *other, f"export.light={light}", "export.lights=[json]"), load_stage)
        (found,) = read_lights(artifact.file("lamps.json"), any_world=True)
        torch.testing.assert_close(found.position, LIGHT.position / 0.2 - torch.tensor([1.0, 2.0, -3.0]).double())


def test_what_a_fit_doubts_and_what_nothing_measured_is_said(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    """Watts of a lamp that may not be there, or that only photographs tell, are not handed on without a word."""
    scene = tmp_path / "room"
    made(scene / "capture_surfels" / ("a" * 16), {})
    made(scene / "freeze" / ("b" * 16), {"capture_surfels": ["a" * 16]})
    made(scene / "fit_light" / ("c" * 16), {"freeze": ["b" * 16]})
    light = scene / "fit_light" / ("c" * 16) / "lights.json"
    write_lights(light, LIGHT, {"result": "ambiguous", "reason": "Light 1 may not be there."})
    artifact = run(configured(tmp_path, f"export.light={light}", "export.lights=[blend]"), load_stage)
    for told in (artifact.file("lamps.txt").read_text(), capsys.readouterr().out):
        assert "The fit that found these lights is ambiguous: Light 1 may not be there." in told
        assert "under lamps that nobody measured" in told
    certain = tmp_path / "lights.json"
    write_lights(certain, LIGHT, {"result": "converged", "reason": "The loss has a minimum here."})
    artifact = run(configured(tmp_path, f"export.light={certain}", "export.lights=[blend]"), load_stage)
    told = artifact.file("lamps.txt").read_text()
    assert "The fit" not in told and "nobody measured" not in told


def test_lights_of_another_scene_are_told(tmp_path: Path) -> None:
    """Their coordinates are those of another file: the picture would be one of lamps that stand anywhere."""
    for scene in ("hall", "room"):
        made(tmp_path / scene / "freeze" / ("b" * 16), {})
    own, other = (tmp_path / scene / "freeze" / ("b" * 16) / "lights.json" for scene in ("room", "hall"))
    assert elsewhere_line(own, own) == elsewhere_line(tmp_path / "mine.json", own) == ""
    assert "its lights are those of the scene hall; here they stand" in elsewhere_line(other, own)


def made(folder: Path, inputs: dict) -> None:
    """A folder of a store with nothing but its manifest."""
    folder.mkdir(parents=True)
    manifest = {"schema": 1, "stage": folder.parent.name, "fingerprint": folder.name, "inputs": inputs}
    (folder / "manifest.json").write_text(json.dumps({**manifest, "files": {}, "facts": {}}))
