"""What every kind of light keeps: files, tables, derivatives, and what other programs are told of it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from double_precision import irradiance
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.errors import InputError
from rgspipe.fitting.result_text import light_line
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.rig import rig_irradiance
from rgspipe.scene import Light
from rgspipe.scene.lights import KINDS, AxialLight, SpotLight
from rgspipe.scene.lights.angles import angle_from_axis
from rooms import closed_box

#: No surfel of the box lies across the axis, where an LED has a kink.
PLACE = torch.tensor([0.13, -0.21, 0.28], dtype=torch.float64)
AXIS = torch.nn.functional.normalize(torch.tensor([0.5, 0.3, -0.8], dtype=torch.float64), dim=0)
COLOUR = torch.tensor([1.0, 2.0, 0.5], dtype=torch.float64)

#: Each kind in every shape that a search tries.
LIGHTS = [shape.at(PLACE, AXIS, COLOUR) for kind in KINDS.values() for shape in kind.shaped().variants()]

#: Fields that are tensors, of lights that have them.
VECTORS = ("position", "intensity", "direction")


def name_of(light: Light) -> str:
    numbers = [f"{float(getattr(light, number.name)):.3g}" for number in light.shape]
    return " ".join([light.kind, *numbers])


every_light = pytest.mark.parametrize("light", LIGHTS, ids=name_of)


def points(count: int = 400) -> Tensor:
    """All around, none nearer to the light than a fifth of the room."""
    generator = torch.Generator().manual_seed(0)
    drawn = 2.0 * torch.rand(count, 3, generator=generator, dtype=torch.float64) - 1.0
    return drawn[(drawn - PLACE).norm(dim=1) > 0.2]


def same(one: Light, other: Light) -> bool:
    pairs = ((getattr(one, field.name), getattr(other, field.name)) for field in fields(one))
    return type(one) is type(other) and all(
        torch.allclose(a, b, rtol=0.0, atol=1e-15) if isinstance(a, Tensor) else a == b for a, b in pairs
    )


@every_light
def test_a_light_file_gives_it_back(light: Light, tmp_path: Path) -> None:
    write_lights(tmp_path / "lights.json", (light,))
    (read,) = read_lights(tmp_path / "lights.json")
    assert same(read, light)


@every_light
def test_a_light_file_that_lacks_a_field_of_it_is_refused_by_name(light: Light, tmp_path: Path) -> None:
    write_lights(tmp_path / "lights.json", (light,))
    content = json.loads((tmp_path / "lights.json").read_text())
    for name in content["lights"][0]:
        rest = {key: value for key, value in content["lights"][0].items() if key != name}
        (tmp_path / "other.json").write_text(json.dumps(content | {"lights": [rest]}))
        with pytest.raises(InputError, match=name):
            read_lights(tmp_path / "other.json")


@every_light
def test_a_table_gives_it_back(light: Light) -> None:
    columns = light.columns()
    assert [columns[name] for name in "xyzrgb"] == [*PLACE.tolist(), *COLOUR.tolist()]
    assert same(replace(light, position=PLACE + 1.0).with_columns(columns), light)
    for name in columns:
        assert light.with_columns({**columns, name: math.nan}) is None
        assert light.with_columns({key: value for key, value in columns.items() if key != name}) is None


@every_light
def test_it_is_taken_along_and_turned(light: Light) -> None:
    there, across = PLACE + 1.0, torch.nn.functional.normalize(AXIS.roll(1), dim=0)
    moved = light.at(there, across, 3.0 * COLOUR)
    assert torch.equal(moved.position, there) and torch.equal(moved.intensity, 3.0 * COLOUR)
    assert light.axis is None or torch.equal(moved.axis, across)
    assert same(moved.at(PLACE, AXIS, COLOUR), light)
    # A light at infinity has no simpler one in its place.
    assert (light.plain.axis is None) != light.distant and torch.equal(light.plain.position, PLACE)


@every_light
def test_lists_arrays_and_single_numbers_are_taken_for_tensors(light: Light) -> None:
    vectors = {name: getattr(light, name) for name in VECTORS if hasattr(light, name)}
    for convert in (Tensor.tolist, Tensor.numpy, Tensor.float):
        given = replace(light, **{name: convert(value) for name, value in vectors.items()})
        for name, value in vectors.items():
            torch.testing.assert_close(getattr(given, name).double(), value, rtol=0, atol=1e-7)
    assert replace(light, intensity=2).intensity.tolist() == [2.0, 2.0, 2.0]
    for name, value in vectors.items():
        for wrong in (value[:2], value[None], "here", None):
            with pytest.raises(InputError, match=f"{name}: expected numbers of shape"):
                replace(light, **{name: wrong})


@every_light
def test_it_moves_between_precisions_and_leaves_its_graph(light: Light) -> None:
    number = {item.name: torch.tensor(float(getattr(light, item.name)), requires_grad=True) for item in light.shape}
    attached = replace(light, position=PLACE.clone().requires_grad_(), **number)
    assert (
        attached.to(torch.float32).position.dtype == torch.float32 == attached.to("cpu", torch.float32).position.dtype
    )
    assert attached.to(torch.float32).position.requires_grad
    left = attached.detached()
    values = [getattr(left, field.name) for field in fields(left)]
    assert not any(isinstance(value, Tensor) and value.requires_grad for value in values)
    assert left.position.dtype == torch.float64 and left.columns() == pytest.approx(light.columns(), rel=1e-6)


@every_light
def test_no_relative_intensity_is_above_one_or_below_the_least(light: Light) -> None:
    relative = light.relative_intensity(points())
    if relative is None:
        assert light.least_relative_intensity == 1.0 and (light.axis is None or light.distant)
        torch.testing.assert_close(light.power(), (math.inf if light.distant else 4.0 * math.pi) * COLOUR)
    else:
        assert (
            light.least_relative_intensity - 1e-6 <= float(relative.value.min()) and float(relative.value.max()) <= 1.0
        )
        assert bool((light.power() < 4.0 * math.pi * COLOUR).all())


@every_light
@pytest.mark.parametrize("softness", [0.0, 0.15])
def test_derivatives_of_its_relative_intensity_are_those_of_finite_differences(light: Light, softness: float) -> None:
    relative = light.relative_intensity(points(), softness=softness, shape_free=True)
    if relative is None:
        return
    assert {*relative.by} == {"position", "direction", *(number.name for number in light.shape)}
    # Measured 2.9e-6.
    torch.testing.assert_close(relative.value.double(), exact_intensity(light, softness), rtol=0.0, atol=1e-5)
    for name, slopes in relative.by.items():
        for slope, way in ways(light, name, slopes):
            ends = [replace(light, **{name: getattr(light, name) + sign * 1e-6 * way}) for sign in (1.0, -1.0)]
            expected = (exact_intensity(ends[0], softness) - exact_intensity(ends[1], softness)) / 2e-6
            # Measured at most 1.9e-5, of a cone of 15°.
            assert float((slope - expected).abs().max()) <= 1e-4 * float(expected.abs().max()), name


def test_a_kind_may_have_an_axis_and_no_numbers() -> None:
    """None of those that are there is like that: derivatives and what is printed must not ask for a first number."""

    class Bowl(AxialLight):
        kind = "bowl"
        shape = ()

        def profile_at(self, angle: Tensor, numbers: Mapping[str, Tensor], softness: float = 0.0) -> tuple:
            return 0.5 * (1.0 + torch.cos(angle)), -0.5 * torch.sin(angle)

    Bowl.__abstractmethods__ = frozenset()
    light = Bowl(PLACE, COLOUR, AXIS)
    relative = light.relative_intensity(points(), shape_free=True)
    assert {*relative.by} == {"position", "direction"}
    assert light_line(light).startswith("bowl at (") and "axis (" in light_line(light)


def exact_intensity(light: Light, softness: float = 0.0) -> Tensor:
    """In float64."""
    angle = angle_from_axis(light.axis, points() - light.position)
    return light.profile_at(angle, light.numbers(angle), softness)[0]


def ways(light: Light, name: str, slopes: Tensor) -> Iterator[tuple[Tensor, Tensor | float]]:
    """A field's derivatives (N,) along each way in which it may change, and that way; an axis turns."""
    if slopes.ndim == 1:
        yield slopes, 1.0
        return
    for way in torch.eye(3, dtype=torch.float64):
        along = way - (way @ AXIS) * AXIS if name == "direction" else way
        yield slopes @ along.float(), along


class Arithmetic:
    """What `Light.emission` makes expressions with, on arrays."""

    add, subtract, multiply, divide = np.add, np.subtract, np.multiply, np.divide
    power, minimum, maximum, greater_than = np.power, np.minimum, np.maximum, np.greater
    exponential = np.exp

    @staticmethod
    def arccosine(value: np.ndarray) -> np.ndarray:
        return np.arccos(np.clip(value, -1.0, 1.0))

    @staticmethod
    def linear(value: np.ndarray, zero: float, one: float) -> np.ndarray:
        return np.clip((value - zero) / (one - zero), 0.0, 1.0)

    @staticmethod
    def smoothstep(value: np.ndarray, zero: float, one: float) -> np.ndarray:
        y = Arithmetic.linear(value, zero, one)
        return y * y * (3.0 - 2.0 * y)


@every_light
def test_other_programs_are_told_its_profile(light: Light) -> None:
    towards = torch.nn.functional.normalize(points() - PLACE, dim=1)
    told = light.emission(Arithmetic, (towards @ AXIS).numpy())
    if light.relative_intensity(points()) is None:
        assert told is None
    else:
        # Measured 2e-15.
        np.testing.assert_allclose(told, light.relative_intensity_towards(points()), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("falloff", [0.0, 1e-12])
@pytest.mark.parametrize("profile", ["gaussian", "smoothstep", "linear"])
def test_other_programs_divide_by_no_hard_edge(profile: str, falloff: float) -> None:
    """Blender's nodes give 0 for a division by 0: a Gaussian shone everywhere, the others nowhere."""
    cone = math.radians(40.0)
    # A linear profile has a hard edge where its two angles are one.
    light = SpotLight(PLACE, 1.0, AXIS, profile, cone, cone - falloff if profile == "linear" else falloff)
    towards = torch.nn.functional.normalize(points() - PLACE, dim=1)
    with np.errstate(all="raise", under="ignore"):
        told = light.emission(Arithmetic, (towards @ AXIS).numpy())
    expected = light.relative_intensity_towards(points())
    assert 0.0 < float(expected.mean()) < 1.0
    np.testing.assert_array_equal(told, expected)


@every_light
def test_light_on_surfels_knows_how_it_changes_with_every_tensor(light: Light) -> None:
    """Numbers of the shape as well, where they are given as tensors."""
    surfels = closed_box(1 / 8)
    bvh = SurfelBvh(surfels.to(torch.float32))
    names = [*(name for name in VECTORS if hasattr(light, name)), *(number.name for number in light.shape)]
    values = {name: torch.as_tensor(getattr(light, name), dtype=torch.float64) for name in names}
    weights = torch.rand(len(surfels), 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)

    def exact(**changed: Tensor) -> float:
        total = 0.0
        for one in replace(light, **changed).parts():
            relative = 1.0 if one.axis is None else one.relative_intensity_towards(surfels.centers)
            lit = irradiance(surfels, one.place, shadows=False) * relative
            total += float((lit[:, None] * one.intensity * weights).sum())
        return total

    leaves = {name: value.clone().requires_grad_() for name, value in values.items()}
    (rig_irradiance(bvh, (replace(light, **leaves),), Effects(shadows=False)) * weights).sum().backward()
    for name, value in values.items():
        steps = 1e-6 * torch.eye(value.numel(), dtype=torch.float64).reshape(-1, *value.shape)
        expected = (
            torch.tensor([exact(**{name: value + h}) - exact(**{name: value - h}) for h in steps]).double() / 2e-6
        )
        # Where a light at infinity is drawn changes nothing.
        unseen = light.distant and name == "position"
        found = torch.zeros_like(expected) if unseen else leaves[name].grad.reshape(-1)
        # Measured at most 1e-5, of the falloff of a cone of 15°; of twelve or sixteen points 1e-4.
        assert float((found - expected).norm()) <= (5e-5 if light.seed is light else 3e-4) * float(expected.norm()), (
            name
        )
