"""Scenes that call for different parts of light transport, with a camera each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import torch

from rgspipe.benchmark.rooms import GREY, RED, ROOMS, WHITE
from rgspipe.scene import Camera, Coverage, Surfels, look_at
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.lights import SpotLight
from rgspipe.scene.rectangles import Rectangles, inside_of_box, rectangle, solid_box, surfels_on
from rgspipe.scene.surfels import NO_CLIP, quaternion_from_normal


@dataclass(frozen=True)
class EffectScene:
    """A scene, where it is seen from, and the rig that lights it.

    Attributes:
        name: of its rows.
        build: gives about so many surfels.
        eye, aim: where the camera stands and what it looks at.
        points: number of point lights of its rigs.
        spots: spots of the shapes that its rigs have.
    """

    name: str
    build: Callable[[int], Surfels]
    eye: tuple[float, float, float]
    aim: tuple[float, float, float]
    points: int = 1
    spots: tuple[SpotLight, ...] = ()

    def camera(self, resolution: int) -> Camera:
        """A square image of the scene."""
        pose = look_at(torch.tensor(self.eye), torch.tensor(self.aim))
        return Camera.from_field_of_view(pose, 0.9, resolution, resolution)


def ball(count: int, albedo: float) -> Surfels:
    """The outside of a sphere of diameter 1, surfels on a Fibonacci lattice."""
    k = torch.arange(count, dtype=torch.float64) + 0.5
    height, angle = 1.0 - 2.0 * k / count, math.pi * (1.0 + math.sqrt(5.0)) * k
    ring = (1.0 - height * height).sqrt()
    normals = torch.stack([ring * angle.cos(), ring * angle.sin(), height], dim=1)
    spacing = 0.5 * math.sqrt(4.0 * math.pi / count)
    return Surfels(
        centers=0.5 * normals,
        rotations=quaternion_from_normal(normals),
        scales=torch.full((count, 2), 0.6 * spacing, dtype=torch.float64),
        opacities=torch.full((count,), 0.95, dtype=torch.float64),
        albedo=torch.full((count, 3), albedo, dtype=torch.float64),
        clip_offsets=torch.full((count, 2), NO_CLIP, dtype=torch.float64),
        clip_angles=torch.zeros((count, 2), dtype=torch.float64),
        coverage=Coverage(0.3, 0.8, layer_thickness=0.6 * spacing, clip_softness=0.05 * spacing),
    )


def _room(albedo: Sequence[float]) -> Rectangles:
    """Open towards −y, with a box on the floor."""
    walls = inside_of_box([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], albedo)
    closed = walls.origins, walls.sides_a, walls.sides_b, walls.albedo
    towards = torch.linalg.cross(walls.sides_a, walls.sides_b)
    kept = ~(towards[:, 1] > 0.5)
    return Rectangles(*(part[kept] for part in closed)) + solid_box([0.1, 0.1, -0.35], [0.3, 0.3, 0.3], albedo, 0.4)


def _floor_and_screen() -> Rectangles:
    """A black floor below a small screen: shadows, but no light that bounces."""
    floor = rectangle([-0.5, -0.5, 0.0], [1, 0, 0], [0, 1, 0], GREY)
    return floor + rectangle([-0.1, -0.1, 0.3], [0.2, 0, 0], [0, 0.2, 0], GREY)


def _valley() -> Rectangles:
    """Two squares that rise by 3 degrees to both sides of the line where they meet."""
    rise = math.tan(math.radians(3.0)) * 0.5
    left = rectangle([-0.5, -0.5, rise], [0.5, 0, -rise], [0, 1, 0], GREY)
    return left + rectangle([0, -0.5, 0], [0.5, 0, rise], [0, 1, 0], GREY)


def _faintly_glossy_ball(count: int) -> Surfels:
    """A ball whose lobes peak at 0.04 % of its diffuse radiance."""
    surfels = ball(count, 0.5)
    faint = torch.full((count, 3), 2e-5, dtype=torch.float64)
    return replace(surfels, gloss=Gloss(faint, torch.full((count,), 20.0, dtype=torch.float64)))


def _on_rectangles(surfaces: Rectangles) -> Callable[[int], Surfels]:
    return lambda count: surfels_on(surfaces, count)


def _glossy(count: int) -> Surfels:
    """A grey room whose box is glossy."""
    surfels = surfels_on(_room(GREY), count)
    inner = surfels.centers[:, :2].abs().amax(dim=1) < 0.45
    box = inner & (surfels.centers[:, 2] > -0.499) & (surfels.centers[:, 2] < 0.499)
    reflectance = torch.where(box[:, None], 0.3, 0.0).expand(-1, 3).to(surfels.albedo)
    return replace(surfels, gloss=Gloss(reflectance.contiguous(), torch.full((len(surfels),), 20.0).to(surfels.albedo)))


_OUTSIDE, _MIDDLE = (0.0, -1.7, 0.1), (0.0, 0.0, 0.0)


def _room_scene(name: str) -> EffectScene:
    room = ROOMS[name]()
    eye, aim = (tuple(map(float, point)) for point in room.viewpoints[0])
    return EffectScene(name, _on_rectangles(room.surfaces), eye, aim)


def _scenes() -> dict[str, EffectScene]:
    outside = {
        "dark ball": EffectScene("dark ball", lambda n: ball(n, 0.04), _OUTSIDE, _MIDDLE),
        "white ball, two lights": EffectScene("white ball, two lights", lambda n: ball(n, 0.8), _OUTSIDE, _MIDDLE, 2),
        "flat picture": EffectScene(
            "flat picture",
            _on_rectangles(rectangle([-0.5, 0, -0.5], [1, 0, 0], [0, 0, 1], RED)),
            _OUTSIDE,
            _MIDDLE,
        ),
        "screen over a floor": EffectScene(
            "screen over a floor", _on_rectangles(_floor_and_screen()), (0.9, -0.9, 0.9), (0.0, 0.0, 0.1)
        ),
        "box in space": EffectScene(
            "box in space", _on_rectangles(solid_box([0, 0, 0], [0.6, 0.5, 0.4], GREY, 0.5)), _OUTSIDE, _MIDDLE
        ),
        "shallow valley": EffectScene("shallow valley", _on_rectangles(_valley()), (0.9, -0.9, 0.9), _MIDDLE),
        "black walls": EffectScene("black walls", _on_rectangles(_room([2e-4] * 3)), _OUTSIDE, _MIDDLE),
        "dark walls": EffectScene("dark walls", _on_rectangles(_room([0.05] * 3)), _OUTSIDE, _MIDDLE),
        "white walls": EffectScene("white walls", _on_rectangles(_room([0.9] * 3)), _OUTSIDE, _MIDDLE),
    }
    spots = {
        "cornell": (SpotLight.shaped("gaussian", 0.5, 0.2), SpotLight.shaped("smoothstep", 0.6, 0.3)),
        "ball": (SpotLight.shaped("linear", 0.5, 0.3),),
        "flood": (SpotLight.shaped("gaussian", 3.1, 1.0),),
    }
    lit_by_spots = {
        "cornell, two spots": replace(
            _room_scene("cornell"), name="cornell, two spots", points=0, spots=spots["cornell"]
        ),
        "ball, spot": EffectScene("ball, spot", lambda n: ball(n, 0.5), _OUTSIDE, _MIDDLE, 0, spots["ball"]),
        "ball, flood": EffectScene("ball, flood", lambda n: ball(n, 0.5), _OUTSIDE, _MIDDLE, 0, spots["flood"]),
        "white walls, point and spot": EffectScene(
            "white walls, point and spot", _on_rectangles(_room(WHITE)), _OUTSIDE, _MIDDLE, 1, spots["ball"]
        ),
    }
    glossy = {
        "glossy box": EffectScene("glossy box", _glossy, _OUTSIDE, _MIDDLE),
        "faint gloss": EffectScene("faint gloss", _faintly_glossy_ball, _OUTSIDE, _MIDDLE),
    }
    return outside | {name: _room_scene(name) for name in ROOMS} | lit_by_spots | glossy


#: The scenes by name.
EFFECT_SCENES: dict[str, EffectScene] = _scenes()
