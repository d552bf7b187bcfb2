"""Scenes of another maker: a data set with known lamps, rendered by Mitsuba, which rgspipe's own code has no part in.

python tools/foreign_room.py KIND FOLDER [--seed 1] [--views 40] [--samples 64]
python -m rgspipe -m stage=evaluate scene=external scene.path=FOLDER views.count=1,3

All cameras stand along one wall (of an open room or around an object, before it), so that this wall and much of its
neighbours are seen by none. Photographs are path-traced and not denoised: their noise is that of the samples. Needs
`requirements-bench.txt` and an LLVM library, see there. Lengths are metres, +z is up.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import OpenEXR

mi.set_variant("llvm_ad_rgb")

#: Pixels along an image's side, and watts of the training lamps.
PIXELS, POWER = 128, 60.0


@dataclass(frozen=True)
class Kind:
    """What is drawn: the reflectance of the surfaces, pieces of furniture and the sides of the room [m].

    Attributes:
        open: there is no wall behind the cameras.
        corner: a block as high as the room fills a corner of it and leaves a corridor that turns.
        object: boxes and balls in a heap on a floor, and no walls.
    """

    albedo: tuple[float, float]
    pieces: int
    size: tuple[float, float, float] = (5.0, 4.0, 2.6)
    open: bool = False
    corner: bool = False
    object: bool = False


KINDS = {
    "closed": Kind((0.2, 0.8), 3),
    "open": Kind((0.2, 0.8), 3, open=True),
    "white": Kind((0.85, 0.92), 3),
    "dark": Kind((0.05, 0.25), 3),
    "clutter": Kind((0.2, 0.8), 8),
    "corridor": Kind((0.3, 0.8), 1, size=(5.0, 5.0, 2.6), corner=True),
    "object": Kind((0.2, 0.8), 5, size=(2.4, 2.4, 1.6), open=True, object=True),
}

#: Horizontal fields of view [degrees], and how far from the wall behind them cameras stand [m].
LENSES, STAND = (37.0, 80.0), (0.25, 0.6)

#: Lamps keep so far from walls and furniture [m]; targets have so many views, and lamps of these W/sr.
CLEAR, TARGET_VIEWS, INTENSITY = 0.3, 3, (3.0, 9.0)

CLASSES = ("visible", "out_of_frame", "occluded")


@dataclass(frozen=True)
class Shot:
    """A camera: its place, what it looks at, and its horizontal field of view [degrees]."""

    eye: np.ndarray
    aim: np.ndarray
    degrees: float

    @property
    def focal(self) -> float:
        return 0.5 * PIXELS / math.tan(0.5 * math.radians(self.degrees))

    @property
    def pose(self) -> np.ndarray:
        """(4, 4) camera-to-world, OpenGL axes."""
        back = (self.eye - self.aim) / np.linalg.norm(self.eye - self.aim)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3] = np.stack([right, np.cross(back, right), back, self.eye], axis=1)
        return pose

    def rays(self) -> np.ndarray:
        """(P, 3) unit directions through the middles of the pixels, row by row."""
        across = (np.arange(PIXELS) + 0.5 - 0.5 * PIXELS) / self.focal
        u, v = np.meshgrid(across, -across)
        rays = np.stack([u, v, -np.ones_like(u)], axis=-1).reshape(-1, 3) @ self.pose[:3, :3].T
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def frames(self, place: np.ndarray) -> bool:
        """Whether a place is within the picture, hidden or not."""
        x, y, z = self.pose[:3, :3].T @ (place - self.eye)
        return z < 0.0 and max(abs(x), abs(y)) < 0.5 * PIXELS / self.focal * -z

    def frame(self, path: str) -> dict[str, Any]:
        middle = 0.5 * PIXELS
        intrinsics = [middle, middle, self.focal, self.focal]
        return {"file_path": path, "transform_matrix": self.pose.tolist(), "camera_intrinsics": intrinsics}


class Room:
    """A scene of a kind, drawn from a seed."""

    def __init__(self, kind: str, seed: int) -> None:
        self.kind, self.size = KINDS[kind], np.array(KINDS[kind].size)
        self.rng = np.random.default_rng([list(KINDS).index(kind), seed])
        self.low, self.high = self.kind.albedo
        self.shapes: dict[str, Any] = dict(self._walls())
        self.balls: list[tuple[np.ndarray, float]] = []
        if self.kind.corner:
            self.shapes["corner"] = self._corner()
        for index in range(self.kind.pieces):
            self.shapes[f"piece_{index}"] = self._heaped() if self.kind.object else self._piece(index)
        self.scene = mi.load_dict({"type": "scene"} | self.shapes)

    def _walls(self) -> Iterator[tuple[str, Any]]:
        for axis in range(3):
            for side in (-1.0, 1.0):
                if (self.kind.open and (axis, side) == (1, -1.0)) or (self.kind.object and (axis, side) != (2, -1.0)):
                    continue
                normal = np.zeros(3)
                normal[axis] = -side
                u, v = np.roll(np.eye(3), -axis - 1, axis=0)[:2] * (0.5 * self.size)
                v = v if np.dot(np.cross(u, v), normal) > 0.0 else -v
                matrix = np.eye(4)
                matrix[:3] = np.stack([u, v, normal, [0, 0, 0.5 * self.size[2]] - 0.5 * self.size * normal], axis=1)
                yield f"wall_{axis}_{side:+.0f}", self._shape("rectangle", matrix)

    def _piece(self, index: int) -> dict[str, Any]:
        """A box on the floor, turned; the first two may be tall."""
        rng, highest = self.rng, 1.7 if index < 2 else 0.9
        size = rng.uniform([0.4, 0.4, 0.4], [1.1, 0.8, highest])
        reach = 0.5 * float(np.hypot(*size[:2]))
        for _ in range(1000):
            low, high = np.array([-0.5, -0.1]) * self.size[:2] + reach, 0.5 * self.size[:2] - reach
            place = np.array([*rng.uniform(low, high), 0.5 * size[2]])
            if all(np.linalg.norm((place - other)[:2]) > reach + far for other, far in self.balls):
                break
        self.balls.append((place, reach))
        turn = mi.ScalarTransform4f().translate(place.tolist()).rotate([0, 0, 1], float(rng.uniform(0.0, 90.0)))
        return self._shape("cube", np.array((turn @ mi.ScalarTransform4f().scale((0.5 * size).tolist())).matrix))

    def _corner(self) -> dict[str, Any]:
        """A block that leaves a corridor along the wall x > 0, in which the cameras stand, and one along y > 0."""
        side = self.rng.uniform(0.5, 0.65, 2) * self.size[:2]
        middle = [*(0.5 * (side - self.size[:2])), 0.5 * self.size[2]]
        self.balls.append((np.array(middle), 0.5 * float(np.hypot(*side))))
        matrix = np.diag([*(0.5 * side), 0.5 * self.size[2], 1.0])
        matrix[:3, 3] = middle
        return self._shape("cube", matrix)

    def _heaped(self) -> dict[str, Any]:
        """A ball or a turned box of the heap in the middle; it stands on the floor, and may be sunk into others."""
        rng, is_ball = self.rng, self.rng.random() < 0.5
        size = np.full(3, rng.uniform(0.25, 0.6)) if is_ball else rng.uniform([0.2, 0.2, 0.2], [0.5, 0.5, 0.8])
        place = [*rng.uniform(-0.3, 0.3, 2), 0.5 * size[2]]
        turn = mi.ScalarTransform4f().translate(place).rotate([0, 0, 1], float(rng.uniform(0.0, 90.0)))
        kind = "sphere" if is_ball else "cube"
        return self._shape(kind, np.array((turn @ mi.ScalarTransform4f().scale((0.5 * size).tolist())).matrix))

    def _shape(self, kind: str, matrix: np.ndarray) -> dict[str, Any]:
        grey, tint = self.rng.uniform(self.low, self.high), min(0.25, self.high - self.low)
        colour = np.clip(grey * (1.0 + tint * self.rng.uniform(-1.0, 1.0, 3)), 0.02, 0.95)
        bsdf = {"type": "diffuse", "reflectance": {"type": "rgb", "value": colour.tolist()}}
        return {"type": kind, "to_world": mi.ScalarTransform4f(matrix.tolist()), "bsdf": bsdf}

    def shot(self) -> Shot:
        """A camera as somebody would hold it who stands along the wall y < 0, or before it if there is none."""
        rng, size, wall = self.rng, self.size, -0.5 * self.size[1] - (1.0 if self.kind.open else 0.0)
        along = (0.25, 0.45) if self.kind.corner else (-0.45, 0.45)
        eye = [rng.uniform(*along) * size[0], wall + rng.uniform(*STAND), rng.uniform(0.7, 2.0)]
        aim = rng.uniform([-0.5 * size[0], 0.0, 0.1], [0.5 * size[0], 0.5 * size[1], 0.8 * size[2]])
        aim = aim * 0.3 if self.kind.object else aim
        return Shot(np.array(eye), aim, rng.uniform(*LENSES))

    def lamp(self) -> np.ndarray:
        """A place in the room that is clear of walls and furniture, and not inside of a piece."""
        while True:
            low, high = np.array([*(-0.5 * self.size[:2]), 0.0]) + CLEAR, self._above() - CLEAR
            place, around = self.rng.uniform(low, high), fibonacci(256)
            is_near = float(self._distances(place, around).min()) <= 0.5 * CLEAR
            if not is_near and not self._meets_backs(place, around):
                return place

    def _above(self) -> np.ndarray:
        return np.array([*(0.5 * self.size[:2]), self.size[2]])

    def sees(self, eye: np.ndarray, place: np.ndarray) -> bool:
        way = place - eye
        return float(self._distances(eye, way[None] / np.linalg.norm(way))[0]) > np.linalg.norm(way)

    def depth(self, shot: Shot) -> np.ndarray:
        """(H, W) distance along the ray through each pixel's middle; infinite where there is nothing."""
        return self._distances(shot.eye, shot.rays()).reshape(PIXELS, PIXELS)

    def _distances(self, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
        hit = self._hits(origin, directions)
        return np.where(np.array(hit.is_valid()), np.array(hit.t), np.inf)

    def _meets_backs(self, origin: np.ndarray, directions: np.ndarray) -> bool:
        hit = self._hits(origin, directions)
        facing = np.einsum("nd,dn->n", directions, np.array(hit.n))
        return bool((np.array(hit.is_valid()) & (facing > 0.0)).any())

    def _hits(self, origin: np.ndarray, directions: np.ndarray) -> Any:
        rays = mi.Ray3f(mi.Point3f(*origin.tolist()), mi.Vector3f(directions.T.astype(np.float32)))
        return self.scene.ray_intersect(rays)

    def photograph(self, shot: Shot, lamp: np.ndarray, intensity: Sequence[float], samples: int) -> np.ndarray:
        """(H, W, 4) linear radiance, premultiplied, and alpha."""
        sensor = {
            "type": "perspective",
            "fov": shot.degrees,
            "near_clip": 1e-4,
            "to_world": mi.ScalarTransform4f().look_at(shot.eye.tolist(), shot.aim.tolist(), [0, 0, 1]),
            "film": {
                "type": "hdrfilm",
                "width": PIXELS,
                "height": PIXELS,
                "rfilter": {"type": "box"},
                "pixel_format": "rgba",
            },
            "sampler": {"type": "independent", "sample_count": samples},
        }
        light = {"type": "point", "position": lamp.tolist(), "intensity": {"type": "rgb", "value": list(intensity)}}
        # Roulette ends paths late: a white room lives of its thirtieth bounce.
        integrator = {"type": "path", "max_depth": 64, "rr_depth": 16}
        scene = mi.load_dict({"type": "scene", "light": light, "integrator": integrator} | self.shapes)
        image = mi.render(scene, sensor=mi.load_dict(sensor), seed=int(self.rng.integers(2**31)))
        return np.array(image).astype(np.float32)


def fibonacci(count: int) -> np.ndarray:
    """(N, 3) directions spread evenly."""
    z, turn = 1.0 - (2.0 * np.arange(count) + 1.0) / count, np.pi * (3.0 - 5.0**0.5) * np.arange(count)
    ring = np.sqrt(1.0 - z * z)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)


def write_split(room: Room, folder: Path, name: str, views: int, samples: int) -> None:
    """Photographs with a known lamp each, and their depth."""
    (folder / name).mkdir(parents=True)
    frames = []
    for index in range(views):
        shot, lamp, path = room.shot(), room.lamp(), f"{name}/r_{index:04d}"
        image = room.photograph(shot, lamp, [POWER / (4.0 * math.pi)] * 3, samples)
        OpenEXR.File({}, {"RGBA": image}).write(str(folder / f"{path}.exr"))
        OpenEXR.File({}, {"Z": room.depth(shot).astype(np.float32)}).write(str(folder / f"{path}_depth.exr"))
        lamp_keys = {"pl_pos": lamp.tolist(), "pl_intensity": [POWER] * 3, "depth_path": f"{path}_depth.exr"}
        frames.append(shot.frame(path) | lamp_keys)
        print(f"{path} of {views}", flush=True)
    write_json(folder / f"transforms_{name}.json", {"frames": frames})


def write_target(room: Room, folder: Path, name: str, samples: int) -> None:
    """Photographs under a lamp of a class, which is written beside them."""
    while True:
        shots, lamp = [room.shot() for _ in range(TARGET_VIEWS)], room.lamp()
        framed, seen = shots[0].frames(lamp), room.sees(shots[0].eye, lamp)
        if name == ("out_of_frame" if not framed else "visible" if seen else "occluded"):
            break
    target = folder / "targets" / name
    target.mkdir(parents=True)
    intensity = (room.rng.uniform(*INTENSITY) * room.rng.uniform(0.6, 1.0, 3)).tolist()
    for index, shot in enumerate(shots):
        image = room.photograph(shot, lamp, intensity, samples)
        OpenEXR.File({}, {"RGBA": image}).write(str(target / f"view_{index}.exr"))
    write_json(target / "transforms.json", {"frames": [shot.frame(f"view_{i}") for i, shot in enumerate(shots)]})
    light = {"type": "point", "position": lamp.tolist(), "intensity": intensity}
    (folder / "truth").mkdir(exist_ok=True)
    write_json(folder / "truth" / f"{name}.json", {"version": 1, "lights": [light]})


def write_json(path: Path, content: Any) -> None:
    path.write_text(json.dumps(content, indent=1), encoding="utf-8")


def main() -> None:
    """Render a room into a folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--views", type=int, default=40, help="photographs to train from")
    parser.add_argument("--samples", type=int, default=64, help="paths a pixel; they decide the noise")
    given = parser.parse_args()
    room = Room(given.kind, given.seed)
    given.folder.mkdir(parents=True)
    write_json(given.folder / "dataset_info.json", {"version": 1, "depth_convention": "ray_distance"})
    write_split(room, given.folder, "train", given.views, given.samples)
    write_split(room, given.folder, "test", 6, 16 * given.samples)
    for name in CLASSES:
        write_target(room, given.folder, name, given.samples)
    names = [{"name": name, "occlusion": name} for name in CLASSES]
    write_json(given.folder / "targets" / "targets.json", {"targets": names})


if __name__ == "__main__":
    main()
