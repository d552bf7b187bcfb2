"""A room of the zoo in bpy, photographed as people do: from among the furniture, or all from one side."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from rgspipe.blender.cameras import MAX_DRAWS, RoomLayout, aimed, free_place, no_room
from rgspipe.blender.geometry import FreeSpace
from rgspipe.blender.materials import checker_material, diffuse_material, mottled_material, striped_material
from rgspipe.blender.meshes import add, ball, box, drum, new_scene, polygon, revolved
from rgspipe.blender.options import ZooParameters
from rgspipe.blender.targets import classify
from rgspipe.scene import Camera
from rgspipe.scene.models.zoo import STREAMS, Finish, ZooRoom, draw_room, inside

#: Faces around whatever is round.
SEGMENTS = 128

#: How far views from one side may stand from it, in depths of the room; in front of an open one, outside.
SIDE, IN_FRONT = 0.15, (0.15, 0.6)

#: How much lenses of a room differ, and the least distance to what a camera looks at, scene units.
LENSES, SIGHT = 0.1, 0.3

#: Target cameras: how near they are to each other, how many places are tried for them before another focus, how many
#: threes are looked at, and at how many lights, scene units.
TOGETHER, ATTEMPTS, TRIPLES, PROBES = 0.35, 60, 40, 200


def build(parameters: ZooParameters) -> bpy.types.Scene:
    """A new scene with the room and all that stands in it."""
    scene, room = new_scene(), _room(parameters)
    materials = [_material(f"finish_{index}", finish) for index, finish in enumerate(room.finishes)]
    walls = room.plan.wall_rectangles().corners.tolist()
    faces = [*walls, room.plan.floor_corners(), room.plan.ceiling_corners()]
    for index, corners in enumerate(faces):
        if index != room.open_wall:
            add(scene, polygon(f"face_{index}", corners), materials[index])
    rest = iter(materials[len(faces) :])
    for index, item in enumerate(room.boxes):
        add(scene, box(f"box_{index}", item.size), next(rest), place=item.center, turn=item.turn)
    for index, item in enumerate(room.round_things):
        outline = ball(item.radius) if item.kind == "ball" else drum(item.radius, item.height)
        add(scene, revolved(f"round_{index}", outline, SEGMENTS), next(rest), place=item.center)
    bpy.context.view_layer.update()
    return scene


def layout(parameters: ZooParameters, space: FreeSpace, resolution: int) -> ZooLayout:
    """Views as the seed has it, from among the furniture or all from one side."""
    room = _room(parameters)
    rng = np.random.default_rng([parameters.seed, STREAMS["views"]])
    drawn = str(rng.choice(["standing", "one_side"]))
    degrees = rng.uniform(30.0, 75.0) if parameters.lens is None else parameters.lens
    one_side = (drawn if parameters.views == "any" else parameters.views) == "one_side"
    return ZooLayout(space, resolution, room=room, one_side=one_side, degrees=degrees)


@dataclass(frozen=True)
class ZooLayout(RoomLayout):
    """Cameras as people stand, or all along one side; lights anywhere in the room.

    Attributes:
        room: what they stand in.
        one_side: whether all cameras stand along the first wall, or in front of it where it is missing.
        degrees: field of view, about the same for all.
    """

    room: ZooRoom | None = None
    one_side: bool = False
    degrees: float = 60.0

    def camera(self, rng: np.random.Generator, index: int) -> Camera:
        for _ in range(MAX_DRAWS):
            origin = self._origin(rng)
            focus = self.light(rng, 0.02)
            length = float(np.linalg.norm(focus - origin))
            direction = (focus - origin) / max(length, 1e-9)
            distance, is_front = self.space.geometry.cast(origin, direction)
            if abs(direction[2]) < 0.7 and is_front and np.isfinite(distance) and distance > SIGHT:
                lens = self.degrees * rng.uniform(1.0 - LENSES, 1.0 + LENSES)
                return aimed(origin, focus, lens, self.resolution)
        raise no_room(f"a camera with a view of {SIGHT:g} or more")

    def target_cameras(self) -> list[Camera]:
        """Three that stand together and look at one place; of some such, those with lights of most classes."""
        rng = np.random.default_rng([self.room.seed, STREAMS["targets"]])
        lights = [self.light(rng, 0.05) for _ in range(PROBES)]
        best: tuple[int, list[Camera]] = (-1, [])
        for _ in range(TRIPLES):
            cameras = self._together(rng)
            found = {classify(light, cameras, self.space.geometry.blocked) for light in lights} - {None}
            if len(found) > best[0]:
                best = (len(found), cameras)
            if len(found) == len(self.classes):
                break
        return best[1]

    def _together(self, rng: np.random.Generator) -> list[Camera]:
        """Three cameras near each other with one focus that all of them see."""
        geometry, chosen = self.space.geometry, []
        for attempt in range(MAX_DRAWS):
            if attempt % ATTEMPTS == 0:
                chosen, first, focus = [], self._origin(rng), self.light(rng, 0.05)
            origin = self._origin(rng) if chosen else first
            near = np.linalg.norm(origin - first) < TOGETHER
            far = np.linalg.norm(focus - origin) > SIGHT
            if near and far and not geometry.blocked(origin, focus):
                chosen.append(aimed(origin, focus, self.degrees, self.resolution))
            if len(chosen) == 3:
                return chosen
        raise no_room("three target cameras")

    def _origin(self, rng: np.random.Generator) -> np.ndarray:
        """(3,) where a camera stands."""
        if not self.one_side:
            return self.light(rng, 0.04)
        plan = self.room.plan
        (left, front), (right, _) = plan.outline[:2]
        depth = max(y for _, y in plan.outline) - front
        top = 0.5 * plan.height - 0.04

        def draw() -> np.ndarray:
            step = rng.uniform(0.02, SIDE) if self.room.open_wall is None else -rng.uniform(*IN_FRONT)
            return np.array([rng.uniform(left + 0.04, right - 0.04), front + step * depth, rng.uniform(-top, top)])

        def stands(point: np.ndarray) -> bool:
            return self.room.open_wall is not None or inside(plan.outline, point[0], point[1])

        return free_place(self.space, 0.02, draw, stands)


def _room(parameters: ZooParameters) -> ZooRoom:
    return draw_room(parameters.seed, parameters.plan, parameters.tone, parameters.fronts)


def _material(name: str, finish: Finish) -> bpy.types.Material:
    if finish.pattern == "checker":
        return checker_material(name, finish.albedo, finish.other, finish.size)
    if finish.pattern == "stripes":
        return striped_material(name, finish.albedo, finish.other, finish.size)
    if finish.pattern == "mottled":
        return mottled_material(name, finish.albedo, finish.other, finish.size)
    return diffuse_material(name, finish.albedo)
