"""Scenes of a kind, drawn from a seed, with places for cameras and lamps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from foreign.by_mitsuba import Surfaces
from foreign.cameras import Shot
from foreign.furniture import Piece, pieces
from foreign.shapes import Shape


@dataclass(frozen=True)
class Kind:
    """What is drawn: the reflectance of the surfaces, pieces of furniture and the sides of the room [m].

    Attributes:
        open: there is no wall behind the cameras.
        corner: a block as high as the room fills a corner of it and leaves a corridor that turns.
        object: boxes and balls in a heap on a floor, and no walls.
        furnished: pieces are meshes of other makers instead of boxes.
    """

    albedo: tuple[float, float]
    pieces: int
    size: tuple[float, float, float] = (5.0, 4.0, 2.6)
    open: bool = False
    corner: bool = False
    object: bool = False
    furnished: bool = False


# Seeds draw with a kind's place in this list: new ones go to its end.
KINDS = {
    "closed": Kind((0.2, 0.8), 3),
    "open": Kind((0.2, 0.8), 3, open=True),
    "white": Kind((0.85, 0.92), 3),
    "dark": Kind((0.05, 0.25), 3),
    "clutter": Kind((0.2, 0.8), 8),
    "corridor": Kind((0.3, 0.8), 1, size=(5.0, 5.0, 2.6), corner=True),
    "object": Kind((0.2, 0.8), 5, size=(2.4, 2.4, 1.6), open=True, object=True),
    "furnished": Kind((0.3, 0.8), 6, furnished=True),
}

#: Horizontal fields of view [degrees], and how far from the wall behind them cameras stand [m].
LENSES, STAND = (37.0, 80.0), (0.25, 0.6)

#: Where Debian's package puts the libraries of furniture.
FURNITURE = Path("/usr/share/sweethome3d/furniture")

#: At what height people hold a camera who photograph a room from within [m].
EYES = (1.2, 1.9)

#: Lamps, and people within a room, keep so far from walls and furniture [m].
CLEAR = 0.3


class Room:
    """A scene of a kind, drawn from a seed; `furniture` is the folder of libraries for a furnished one."""

    def __init__(self, kind: str, seed: int, furniture: Path = FURNITURE) -> None:
        self.kind, self.size = KINDS[kind], np.array(KINDS[kind].size)
        self.rng = np.random.default_rng([list(KINDS).index(kind), seed])
        self.low, self.high = self.kind.albedo
        self.shapes: dict[str, Shape] = dict(self._walls())
        self.taken: list[tuple[np.ndarray, float]] = []
        self.boxes: list[np.ndarray] = []
        if self.kind.corner:
            self.shapes["corner"] = self._corner()
        known = pieces(furniture) if self.kind.furnished else []
        for index in range(self.kind.pieces):
            self.shapes |= (
                self._furniture(known, index) if self.kind.furnished else {f"piece_{index}": self._block(index)}
            )
        self.surfaces = Surfaces(self.shapes)

    def _walls(self) -> Iterator[tuple[str, Shape]]:
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
                yield f"wall_{axis}_{side:+.0f}", self._painted("rectangle", matrix)

    def _block(self, index: int) -> Shape:
        return self._heaped() if self.kind.object else self._box(index)

    def _box(self, index: int) -> Shape:
        """A box on the floor, turned; the first two may be tall."""
        highest = 1.7 if index < 2 else 0.9
        size = self.rng.uniform([0.4, 0.4, 0.4], [1.1, 0.8, highest])
        return self._painted("cube", self._placed(size))

    def _furniture(self, known: list[Piece], index: int) -> dict[str, Shape]:
        """The parts of a piece on the floor, turned."""
        while True:
            piece = known[int(self.rng.integers(len(known)))]
            try:
                parts = piece.parts()
                break
            except (ValueError, KeyError):
                # Too many triangles, or a file that its library lacks: another one.
                continue
        matrix = self._placed(piece.size)
        self.boxes.append(np.linalg.inv(matrix))
        return {
            f"piece_{index}_{number}": Shape("mesh", matrix, colour, (vertices, faces))
            for number, (vertices, faces, colour) in enumerate(parts)
        }

    def _placed(self, size: np.ndarray) -> np.ndarray:
        """(4, 4) that puts [-1, 1]³ of a size on the floor, turned, where there is room if there is."""
        reach = 0.5 * float(np.hypot(*size[:2]))
        for _ in range(1000):
            low, high = np.array([-0.5, -0.1]) * self.size[:2] + reach, 0.5 * self.size[:2] - reach
            place = np.array([*self.rng.uniform(low, high), 0.5 * size[2]])
            if all(np.linalg.norm((place - other)[:2]) > reach + far for other, far in self.taken):
                break
        self.taken.append((place, reach))
        return turned(place, size, self.rng.uniform(0.0, 90.0))

    def _corner(self) -> Shape:
        """A block that leaves a corridor along the wall x > 0, in which the cameras stand, and one along y > 0."""
        side = self.rng.uniform(0.5, 0.65, 2) * self.size[:2]
        middle = np.array([*(0.5 * (side - self.size[:2])), 0.5 * self.size[2]])
        self.taken.append((middle, 0.5 * float(np.hypot(*side))))
        return self._painted("cube", turned(middle, np.array([*side, self.size[2]]), 0.0))

    def _heaped(self) -> Shape:
        """A ball or a turned box of the heap in the middle; it stands on the floor, and may be sunk into others."""
        rng, is_ball = self.rng, self.rng.random() < 0.5
        size = np.full(3, rng.uniform(0.25, 0.6)) if is_ball else rng.uniform([0.2, 0.2, 0.2], [0.5, 0.5, 0.8])
        place = np.array([*rng.uniform(-0.3, 0.3, 2), 0.5 * size[2]])
        return self._painted("sphere" if is_ball else "cube", turned(place, size, rng.uniform(0.0, 90.0)))

    def _painted(self, kind: str, matrix: np.ndarray) -> Shape:
        grey, tint = self.rng.uniform(self.low, self.high), min(0.25, self.high - self.low)
        return Shape(kind, matrix, np.clip(grey * (1.0 + tint * self.rng.uniform(-1.0, 1.0, 3)), 0.02, 0.95))

    def shot(self) -> Shot:
        """A camera as somebody would hold it who stands along the wall y < 0, or before it if there is none."""
        rng, size, wall = self.rng, self.size, -0.5 * self.size[1] - (1.0 if self.kind.open else 0.0)
        along = (0.25, 0.45) if self.kind.corner else (-0.45, 0.45)
        eye = [rng.uniform(*along) * size[0], wall + rng.uniform(*STAND), rng.uniform(0.7, 2.0)]
        aim = rng.uniform([-0.5 * size[0], 0.0, 0.1], [0.5 * size[0], 0.5 * size[1], 0.8 * size[2]])
        aim = aim * 0.3 if self.kind.object else aim
        return Shot(np.array(eye), aim, rng.uniform(*LENSES))

    def shot_inside(self) -> Shot:
        """A camera of somebody who walks through the room and photographs all of it."""
        while True:
            eye, aim = self.place(), self.rng.uniform([*(-0.5 * self.size[:2]), 0.0], self._above())
            if EYES[0] <= eye[2] <= EYES[1] and np.linalg.norm(aim - eye) > 0.3 * self.size[0]:
                return Shot(eye, aim, self.rng.uniform(*LENSES))

    def place(self) -> np.ndarray:
        """A place in the room that is clear of walls and furniture, and not inside of a piece."""
        low = np.array([*(-0.5 * self.size[:2]), 0.0]) + CLEAR
        while True:
            place, around = self.rng.uniform(low, self._above() - CLEAR), fibonacci(256)
            is_near = float(self.surfaces.distances(place, around).min()) <= 0.5 * CLEAR
            if not is_near and not self._is_inside(place, around):
                return place

    def _above(self) -> np.ndarray:
        return np.array([*(0.5 * self.size[:2]), self.size[2]])

    def _is_inside(self, place: np.ndarray, around: np.ndarray) -> bool:
        """Within a piece. Meshes may have their faces either way around, so of these it is their box that counts."""
        if self.kind.furnished:
            return any(bool((np.abs((box @ [*place, 1.0])[:3]) < 1.0).all()) for box in self.boxes)
        return self.surfaces.meets_backs(place, around)

    def sees(self, eye: np.ndarray, place: np.ndarray) -> bool:
        way = place - eye
        return float(self.surfaces.distances(eye, way[None] / np.linalg.norm(way))[0]) > np.linalg.norm(way)


def turned(place: np.ndarray, size: np.ndarray, degrees: float) -> np.ndarray:
    """(4, 4) that puts [-1, 1]³ of a size around a place, turned around z."""
    angle = np.radians(degrees)
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, :3] *= 0.5 * size
    matrix[:3, 3] = place
    return matrix


def fibonacci(count: int) -> np.ndarray:
    """(N, 3) directions spread evenly."""
    z, turn = 1.0 - (2.0 * np.arange(count) + 1.0) / count, np.pi * (3.0 - 5.0**0.5) * np.arange(count)
    ring = np.sqrt(1.0 - z * z)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
