"""Kinds of light that no format knows are written as what they are like, or left out; what is lost is said."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor

import rgspipe as rg
from rgspipe.light_export.export import FORMATS, NAMES, export_lights
from rgspipe.scene import Light
from rgspipe.scene.lights import Nodes, PanelLight, RelativeIntensity, SphereLight
from rgspipe.scene.lights.reader import Reader
from rgspipe.scene.shapes import Given

OTHERS = sorted({*FORMATS} - {"json"})
LOST = "light 2: the {} is written without its extent; JSON holds all of it."
LEFT_OUT = "light 2: where a halo shines no other program is told; JSON alone holds it."


@dataclass(frozen=True)
class Tube(Light):
    """Four points in a row."""

    kind = "tube"

    @classmethod
    def shaped(cls) -> Tube:
        return cls([0.0, 0.0, 0.0], 1.0)

    def nodes(self, values: Mapping[str, Tensor], few: bool = False) -> Nodes:
        along = torch.linspace(-0.5, 0.5, 4, dtype=torch.float64)[:, None] * torch.eye(3, dtype=torch.float64)[:1]
        return Nodes(values["position"] + along)

    def power(self) -> Tensor:
        return 12.566 * self.intensity

    @classmethod
    def from_fields(cls, position: Tensor, intensity: Tensor, reader: Reader) -> Tube:
        return cls(position, intensity)


@dataclass(frozen=True)
class Halo(Tube):
    """Shines across its axis only."""

    kind = "halo"

    direction: Given

    @classmethod
    def shaped(cls) -> Halo:
        return cls([0.0, 0.0, 0.0], 1.0, [0.0, 0.0, 1.0])

    @property
    def axis(self) -> Tensor:
        return self.direction

    def relative_intensity(self, points: Tensor, **options: Any) -> RelativeIntensity:
        return RelativeIntensity(torch.zeros(len(points)), {})


@dataclass(frozen=True)
class Egg(SphereLight):
    """A sphere that is twice as high."""

    kind = "egg"

    def nodes(self, values: Mapping[str, Tensor], few: bool = False) -> Nodes:
        upright = torch.tensor([1.0, 1.0, 2.0], dtype=torch.float64)
        return Nodes(values["position"] + upright * (super().nodes(values, few).positions - values["position"]))


@dataclass(frozen=True)
class Ring(PanelLight):
    """Its points lie around a square."""

    kind = "ring"

    def nodes(self, values: Mapping[str, Tensor], few: bool = False) -> Nodes:
        return Nodes(super().nodes(values, few).positions[[0, 3, 12, 15]], values["direction"])


@dataclass(frozen=True)
class Globe(SphereLight):
    """A sphere by another name."""

    kind = "globe"


def written(light: Light, name: str, folder: Path) -> tuple[str, list[str]]:
    """The text of a format, or of its last file, and what was said of the light, which is the second of two."""
    done = export_lights([rg.PointLight([0.0, 0.0, 0.0], 1.0), light], folder, [name])
    return done.files[-1].read_text(), [line for line in done.lines if line.startswith("light 2")]


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("light", [Tube.shaped(), Egg.shaped(), Ring.shaped()], ids=lambda light: light.kind)
def test_an_extent_of_another_shape_is_said_to_be_lost(light: Light, name: str, tmp_path: Path) -> None:
    text, said = written(light, name, tmp_path)
    plain, _ = written(light.seed, name, tmp_path)
    assert said[-1] == LOST.format(light.kind)
    assert text.replace(light.kind, light.seed.kind) == plain


@pytest.mark.parametrize("name", OTHERS)
def test_what_shines_as_no_format_can_tell_is_left_out(name: str, tmp_path: Path) -> None:
    text, said = written(Halo.shaped(), name, tmp_path)
    alone = export_lights(rg.PointLight([0.0, 0.0, 0.0], 1.0), tmp_path, [name])
    assert said == [LEFT_OUT] and text == alone.files[-1].read_text()


@pytest.mark.parametrize("name", sorted(NAMES))
def test_a_sphere_by_another_name_is_a_sphere(name: str, tmp_path: Path) -> None:
    globe, _ = written(Globe.shaped(), name, tmp_path)
    sphere, _ = written(SphereLight.shaped(), name, tmp_path)
    assert globe.replace("globe", "sphere") == sphere


def test_a_light_file_loses_nothing(tmp_path: Path) -> None:
    assert written(Halo.shaped(), "json", tmp_path)[1] == written(Egg.shaped(), "json", tmp_path)[1] == []
