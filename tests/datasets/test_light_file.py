"""Light files: rigs come back as they were, other fields are left alone, impossible values are refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch

from rgspipe.datasets.light_file import read_ambient, read_lights, write_lights
from rgspipe.errors import InputError
from rgspipe.scene import PointLight, SpotLight


def _vector(*values: float) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float64)


def _point() -> PointLight:
    return PointLight(_vector(0.1, -0.2, 0.3), _vector(1.0, 2.0, 0.5))


def _write(path: Path, **changes: object) -> Path:
    light = {"type": "point", "position": [0, 0, 0], "intensity": [1, 1, 1]} | changes
    path.write_text(json.dumps({"version": 1, "lights": [{k: v for k, v in light.items() if v is not ...}]}))
    return path


@pytest.mark.parametrize("profile", ["gaussian", "smoothstep", "linear"])
def test_a_mixed_rig_comes_back_exactly(tmp_path: Path, profile: str) -> None:
    spot = SpotLight(_vector(0, 0, 1), _vector(3, 3, 3), _vector(0, 0.6, -0.8), profile, 0.5, 0.1)
    write_lights(tmp_path / "lights.json", (_point(), spot))
    point, read = read_lights(tmp_path / "lights.json")
    torch.testing.assert_close(point.position, _point().position, rtol=0, atol=0)
    torch.testing.assert_close(point.intensity, _point().intensity, rtol=0, atol=0)
    torch.testing.assert_close(read.direction, spot.direction, rtol=0, atol=1e-16)  # normalised on reading: 1.1e-16
    assert (read.profile, read.cone_angle, read.falloff) == (profile, 0.5, 0.1)


def test_one_light_is_a_list_of_it(tmp_path: Path) -> None:
    write_lights(tmp_path / "lights.json", PointLight([0.1, 0.2, 0.3], 2.0))
    (light,) = read_lights(tmp_path / "lights.json")
    assert light.position.tolist() == [0.1, 0.2, 0.3]


def test_further_fields_are_written_and_ignored_by_the_reader(tmp_path: Path) -> None:
    path = tmp_path / "lights.json"
    write_lights(path, (_point(),), {"loss": 0.5, "lights": [{"covariance": [[1.0]]}]})
    content = json.loads(path.read_text())
    assert content["loss"] == 0.5
    assert content["lights"][0]["covariance"] == [[1.0]]
    assert len(read_lights(path)) == 1


def test_further_fields_cannot_replace_the_format_s_own(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="version"):
        write_lights(tmp_path / "lights.json", (_point(),), {"version": 2})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"type": "moon"}, r"lights\[0\]\.type.*point or spot or led"),
        ({"type": "sun"}, r'lights\[0\]: expected the key "direction", found intensity'),
        ({"type": ...}, '"type"'),
        ({"position": [0, 0]}, '3 finite numbers under "position"'),
        ({"position": [0, 0, float("nan")]}, '3 finite numbers under "position"'),
        ({"intensity": ...}, '"intensity"'),
        ({"intensity": [1, -1, 1]}, r"lights\[0\]\.intensity"),
        ({"type": "spot", "direction": [0, 0, 0]}, "direction.*longer than 0"),
        ({"type": "led", "direction": [0, 0, 1e300], "exponent": 1}, "direction.*longer than 0"),
        ({"type": "led", "direction": [0, 0, 1], "exponent": -1}, r"lights\[0\].*exponent: .*0 or more"),
        (
            {"type": "spot", "direction": [0, 0, 1], "profile": "gaussian", "cone_angle": 3.5, "falloff": 0.1},
            r"lights\[0\].*cone_angle: .*0 to π",
        ),
        ({"position": [0, 0, 1e308]}, r"lights\[0\]\.position.*within"),
        ({"intensity": [1, 1e308, 1]}, r"lights\[0\]\.intensity.*up to|from 0 to"),
        ({"type": "sphere", "radius": 1e308}, r"lights\[0\]\.radius.*within"),
        ({"type": "panel", "direction": [0, 0, 1], "width": 1e11, "height": 1, "turn": 0}, r"\.width.*within"),
        ({"type": "led", "direction": [0, 0, 1], "exponent": 1e200}, r"\.exponent.*within"),
        ({"type": "spot", "direction": [0, 0, 1], "profile": "cosine"}, "profile.*gaussian or smoothstep or linear"),
        ({"type": "spot", "direction": [0, 0, 1], "profile": "gaussian", "cone_angle": 1}, '"falloff"'),
    ],
)
def test_what_is_wrong_with_a_light_is_named(tmp_path: Path, changes: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_lights(_write(tmp_path / "lights.json", **changes))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "invalid JSON"),
        ("[]", "JSON object, found list"),
        ('{"lights": []}', '"version"'),
        ('{"frames": [], "w": 3}', "a light file, with .*found frames, w. Name a light file"),
        ("{}", "found nothing"),
        ('{"version": 9, "lights": []}', '"version": 1, found 9'),
        ('{"version": 1, "lights": 3}', "list of objects"),
    ],
)
def test_what_is_wrong_with_the_file_is_named(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "lights.json").write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_lights(tmp_path / "lights.json")
    assert "lights.json" in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gone\.json.*no such file"):
        read_lights(tmp_path / "gone.json")


def test_a_tiny_direction_keeps_its_way(tmp_path: Path) -> None:
    (light,) = read_lights(_write(tmp_path / "lights.json", type="led", direction=[0, 3e-300, 4e-300], exponent=1))
    torch.testing.assert_close(light.direction, _vector(0.0, 0.6, 0.8), rtol=0, atol=1e-15)  # measured: 1.1e-16


@pytest.mark.parametrize("ambient", [7, [1, 2, 3], None, "radiance", {}, {"radiance": [1, 1e30, 1]}])
def test_what_is_wrong_with_ambient_light_is_named(tmp_path: Path, ambient: object) -> None:
    path = tmp_path / "lights.json"
    path.write_text(json.dumps({"version": 1, "lights": [], "ambient": ambient}))
    with pytest.raises(InputError, match="ambient"):
        read_ambient(path)


@pytest.mark.parametrize("intensity", [-1.0, 1e19])
def test_what_the_reader_refuses_is_not_written(tmp_path: Path, intensity: float) -> None:
    path = tmp_path / "lights.json"
    with pytest.raises(InputError, match="intensity"):
        write_lights(path, PointLight(_vector(0, 0, 0), _vector(intensity, 1, 1)))
    assert not path.exists()
