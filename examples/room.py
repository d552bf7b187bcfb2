"""What the examples share: a scene, a camera that looks into it, and a place for pictures."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import rgspipe as rg


@dataclass(frozen=True)
class Room:
    """A scene in the unit cube around the origin, seen from −y."""

    scene: rg.FrozenScene
    camera: rg.Camera
    pictures: Path


def room_from_arguments(purpose: str) -> Room:
    """The room that the command line asks for."""
    parser = argparse.ArgumentParser(description=purpose.splitlines()[0])
    parser.add_argument("scene", nargs="?", help="folder of a frozen scene, such as outputs/cornell/freeze/latest")
    parser.add_argument("--surfels", type=int, default=2000, help="of the Cornell box that is made without a folder")
    parser.add_argument("--size", type=int, default=128, help="of the images, pixels")
    parser.add_argument("--out", type=Path, default=Path("outputs/examples"), help="folder for pictures")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    if given.scene is None:
        scene = rg.FrozenScene.freeze(rg.exact_surfels(rg.CornellBox(), given.surfels), patches=400)
    else:
        scene = rg.FrozenScene.load(given.scene)
    camera = rg.Camera.look_at([0, -1.5, 0.05], [0, 0, 0], width=given.size, height=given.size)
    return Room(scene, camera, given.out)
