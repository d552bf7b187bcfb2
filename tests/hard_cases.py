"""Hard scenes, lights, spots and cameras by name: what a renderer meets when it is used."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from lit_room import solid_box
from rgspipe.fitting.baselines.paper_adam_start import SCENE_REACH
from rgspipe.scene import Camera, SpotLight, Surfels, look_at
from rooms import closed_box, rectangle, surfels_on

SPACING = 1 / 8

#: A place in the open, for a scene of size 1 around the origin.
INSIDE = torch.tensor([0.05, -0.1, 0.15], dtype=torch.float64)

#: The wall x = −0.5 has a surfel here, its normal is +x.
WALL = torch.tensor([-0.5, 0.0625, 0.0625], dtype=torch.float64)

#: The middle of the solid in the scene "a solid", and a point that surfels lie along each axis from, exactly.
SOLID = torch.tensor([0.1, 0.1, -0.25], dtype=torch.float64)
ON_AXES = torch.tensor([0.0625, 0.0625, 0.0625], dtype=torch.float64)


@dataclass(frozen=True)
class HardScene:
    """Surfels by a function, and where their room is: its side, and the place of its middle; scene units."""

    build: Callable[[], Surfels]
    size: float = 1.0
    middle: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def at(self, point: Tensor) -> Tensor:
        """Where the point (…, 3) float64 of a room of side 1 around the origin lies in this one."""
        return self.size * point.double() + torch.tensor(self.middle, dtype=torch.float64)


def join(*parts: Surfels) -> Surfels:
    """All surfels, composed as the first part's are."""
    tensors = [part.tensors() for part in parts]
    return replace(parts[0], **{name: torch.cat([part[name] for part in tensors]) for name in tensors[0]})


def room() -> Surfels:
    """A closed box of 384 surfels with a screen of 64 in the middle, so that there are shadows; a third are clipped."""
    box = closed_box(SPACING)
    screen = surfels_on(*rectangle([-0.2, -0.2, -0.1], [0.4, 0, 0], [0, 0.4, 0], 0.05), 0.05)
    surfels = join(box, screen)
    offsets, angles = surfels.clip_offsets.clone(), surfels.clip_angles.clone()
    offsets[::3, 0] = surfels.scales[::3, 0]
    angles[::3, 0] = 0.5 * math.pi * torch.arange(len(angles[::3]), dtype=torch.float64)
    return replace(surfels, clip_offsets=offsets, clip_angles=angles)


def room_with_solid() -> Surfels:
    """A closed box and a cube of side 0.3 that stands free in it, seen from its outside."""
    points, normals = solid_box(tuple(SOLID.tolist()), 0.3, 0.075)
    return join(closed_box(SPACING), surfels_on(points, normals, 0.075))


def changed(**changes: Callable[[Surfels], Tensor]) -> Surfels:
    surfels = room()
    return replace(surfels, **{name: change(surfels) for name, change in changes.items()})


def scaled(factor: float) -> Surfels:
    """The room with every length multiplied."""
    surfels, coverage = room(), room().coverage
    return replace(
        surfels,
        centers=factor * surfels.centers,
        scales=factor * surfels.scales,
        clip_offsets=factor * surfels.clip_offsets,
        coverage=replace(
            coverage,
            layer_thickness=factor * coverage.layer_thickness,
            clip_softness=factor * coverage.clip_softness,
        ),
    )


def a_few(count: int) -> Surfels:
    """At most two surfels that face each other."""
    points = torch.tensor([[0.0, 0.0, -0.2], [0.0, 0.0, 0.6]], dtype=torch.float64)
    normals = torch.tensor([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], dtype=torch.float64)
    return surfels_on(points[:count], normals[:count], 0.4)


def sheets(opacity: float) -> Surfels:
    """A thousand sheets, one behind the other, that face up."""
    points = torch.stack([torch.zeros(1000), torch.zeros(1000), torch.linspace(-0.45, 0.05, 1000)], dim=1)
    stack = surfels_on(points, torch.tensor([[0.0, 0.0, 1.0]]).expand(1000, 3), 0.2)
    return replace(stack, opacities=torch.full_like(stack.opacities, opacity))


def faint_sheets() -> Surfels:
    """A thousand sheets that are a layer each and stop a little: a ray meets them all."""
    stack = sheets(0.05)
    return replace(stack, coverage=replace(stack.coverage, low=0.0, high=1.0, layer_thickness=1e-4))


def graded_albedo() -> Surfels:
    """Albedo from 1 down to 1e-16, so that one image spans as many orders of magnitude."""
    return changed(albedo=lambda s: torch.logspace(0.0, -16.0, len(s)).double()[:, None].expand(-1, 3).clone())


FAR = (1e4, -1e4, 1e4)

SCENES: dict[str, HardScene] = {
    "plain": HardScene(room),
    "a solid": HardScene(room_with_solid),
    "zero area": HardScene(lambda: changed(scales=lambda s: s.scales * (torch.arange(len(s)) % 2)[:, None])),
    "zero width": HardScene(lambda: changed(scales=lambda s: s.scales * torch.tensor([1.0, 0.0]))),
    "anisotropy of 1e4": HardScene(lambda: changed(scales=lambda s: s.scales * torch.tensor([1e2, 1e-2]))),
    "coincident duplicates": HardScene(lambda: join(room(), room())),
    "opacity 0": HardScene(lambda: changed(opacities=lambda s: torch.zeros_like(s.opacities))),
    "opacity 1": HardScene(lambda: changed(opacities=lambda s: torch.ones_like(s.opacities))),
    "albedo 0": HardScene(lambda: changed(albedo=lambda s: torch.zeros_like(s.albedo))),
    "albedo 1": HardScene(lambda: changed(albedo=lambda s: torch.ones_like(s.albedo))),
    "albedo over 16 orders": HardScene(graded_albedo),
    "one surfel": HardScene(lambda: a_few(1)),
    "no surfel": HardScene(lambda: a_few(0)),
    "a thousand opaque layers": HardScene(lambda: sheets(0.95)),
    "a thousand faint layers": HardScene(faint_sheets),
    "size 1e-3": HardScene(lambda: scaled(1e-3), size=1e-3),
    "size 1e3": HardScene(lambda: scaled(1e3), size=1e3),
    "1e4 from the origin": HardScene(
        lambda: changed(centers=lambda s: s.centers + torch.tensor(FAR, dtype=torch.float64)), middle=FAR
    ),
}

#: Scenes that differ in more than their materials.
GEOMETRIES = [name for name in SCENES if not name.startswith("albedo")]

#: Scenes whose dense reference is slow, and how many rays are cast there.
DEEP, FEW = ("a thousand opaque layers", "a thousand faint layers"), 12


def beyond(reach: float) -> Tensor:
    """A place above the room, `reach` of its radii from the mean of its surfels."""
    centers = room().centers
    middle = centers.mean(dim=0)
    return middle + reach * (centers - middle).norm(dim=1).amax() * torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)


#: Where the light is, in a room of size 1. The published method keeps it in a ball of four radii.
LIGHTS: dict[str, Tensor] = {
    "in the open": INSIDE,
    "on a surfel": WALL,
    "1e-6 from a surfel": WALL + torch.tensor([1e-6, 0.0, 0.0]),
    "behind a surfel": WALL - torch.tensor([1e-3, 0.0, 0.0]),
    "inside a solid": SOLID,
    "grazing": torch.tensor([0.0, 0.0, -0.1], dtype=torch.float64),
    "on the boundary of the ball": beyond(SCENE_REACH),
    "outside of the ball": beyond(40.0),
    "very far": torch.tensor([1e6, 1e5, 0.0], dtype=torch.float64),
}


def rays(scene: HardScene, count: int) -> tuple[Tensor, Tensor]:
    """Half from the middle in all directions; the others from above, at grazing and at right angles to the sheets."""
    generator = torch.Generator().manual_seed(0)
    directions = torch.randn(count, 3, generator=generator, dtype=torch.float64)
    origins = INSIDE.expand(count, 3).clone()
    origins[count // 2 :] = torch.tensor([0.01, -0.02, 0.45], dtype=torch.float64)
    directions[count // 2 :, 2] = -directions[count // 2 :, 2].abs()
    directions[count // 2 : count * 3 // 4, :2] *= 0.05
    return scene.at(origins), torch.nn.functional.normalize(directions, dim=1)


def scene_of_light(name: str) -> HardScene:
    """The room that a light of LIGHTS is a hard case in."""
    return SCENES["a solid" if name == "inside a solid" else "plain"]


#: (origin, target, resolution) of cameras, in a room of size 1.
CAMERAS: dict[str, tuple[list[float], list[float], int]] = {
    "plain": ([0.4, -0.4, 0.3], [0.0, 0.0, 0.0], 16),
    "in a surfel": (WALL.tolist(), [0.0, 0.0, 0.0], 16),
    "in a solid": (SOLID.tolist(), [0.0, 0.0, 0.0], 16),
    "looking at nothing": ([0.0, 0.0, 5.0], [0.0, 0.0, 9.0], 16),
    "of one pixel": ([0.4, -0.4, 0.3], [0.0, 0.0, 0.0], 1),
}


def camera(name: str = "plain", scene: HardScene = SCENES["plain"]) -> Camera:
    """A camera of CAMERAS in a scene."""
    origin, target, resolution = CAMERAS[name]
    places = (scene.at(torch.tensor(place)) for place in (origin, target))
    return Camera.from_field_of_view(look_at(*places), 1.2, resolution, resolution)


AXES = [[s if k == axis else 0.0 for k in range(3)] for axis in range(3) for s in (1.0, -1.0)]

#: Spots by profile, half-angle of the cone in degrees and rim: (profile, cone_angle, falloff).
SPOTS: dict[str, tuple[str, float, float]] = {
    f"{profile} {degrees} {rim}": (profile, math.radians(degrees), falloff)
    for degrees in (0, 45, 90, 180)
    for profile, rim, falloff in (
        ("gaussian", "hard", 0.0),
        ("gaussian", "soft", 0.3),
        ("smoothstep", "hard", 0.0),
        ("smoothstep", "soft", 0.5),
        ("linear", "hard", math.radians(degrees)),
        ("linear", "soft", 0.0),
    )
}

#: One of each profile that is neither everywhere nor nowhere.
SOFT_SPOTS = ("gaussian 45 soft", "smoothstep 45 soft", "linear 45 soft")


def spot(name: str, axis: Tensor | list[float], position: Tensor = ON_AXES) -> SpotLight:
    """A white spot of SPOTS; every axis of AXES points at a surfel from ON_AXES, exactly."""
    direction = torch.nn.functional.normalize(torch.as_tensor(axis, dtype=torch.float64), dim=0)
    return SpotLight(position, torch.ones(3, dtype=torch.float64), direction, *SPOTS[name])
