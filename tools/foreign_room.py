"""Scenes of another maker: a data set with known lamps, rendered by programs which rgspipe's own code has no part in.

python tools/foreign_room.py KIND FOLDER [--seed 1] [--views 40] [--samples 64] [--targets mitsuba radiance luxcore]
python -m rgspipe -m stage=evaluate scene=external scene.path=FOLDER views.count=1,3

python tools/foreign_room.py KIND FOLDER --lamps 2 [--ordinary]
python -m rgspipe -m stage=evaluate scene=external scene.path=FOLDER scene.lamps=unknown views.count=1,3

All cameras stand along one wall (of an open room or around an object, before it), so that this wall and much of its
neighbours are seen by none; a capture under unknown lamps is taken from all over the room. Photographs to train from
are Mitsuba's; those of targets come from each renderer that is named, of the same lamps and cameras. They are
path-traced and not denoised: their noise is that of the samples. Needs `requirements-third-party.txt` and an LLVM
library (Debian: libllvm19). Lengths are metres, +z is up.
"""

from __future__ import annotations

import argparse
import importlib
import json
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from PIL import Image

from foreign.cameras import PIXELS, Shot
from foreign.ordinary import developed, sensed
from foreign.rooms import FURNITURE, KINDS, Room
from foreign.shapes import Lamp

#: Watts of the training lamps; targets have so many views, and lamps of these W/sr, as captures have.
POWER, TARGET_VIEWS, INTENSITY = 60.0, 3, (3.0, 9.0)

#: Radius of the lamps of a capture [m].
BULB = 0.04

CLASSES = ("visible", "out_of_frame", "occluded")
RENDERERS = ("mitsuba", "radiance", "luxcore")


def photographer(renderer: str) -> Callable[..., np.ndarray]:
    """A renderer's `photograph`; others need not be installed."""
    return importlib.import_module(f"foreign.by_{renderer}").photograph


def write_split(room: Room, folder: Path, name: str, views: int, samples: int) -> None:
    """Photographs with a known lamp each, and their depth."""
    intensity = np.full(3, POWER / (4.0 * math.pi))
    drawn = ((room.shot(), [Lamp(room.place(), intensity)]) for _ in range(views))
    write_views(room, folder, name, drawn, samples, told=True)


def write_capture(room: Room, folder: Path, views: int, samples: int, lamps: int, ordinary: bool) -> None:
    """Photographs from all over the room under lamps that are all on; these are written where no fit reads them."""
    on = [Lamp(room.place(), room_intensity(room), BULB) for _ in range(lamps)]
    drawn = ((room.shot_inside(), on) for _ in range(views))
    write_views(room, folder, "train", drawn, samples, told=False, ordinary=ordinary)
    write_lights(folder, "lamps", on)


def write_views(
    room: Room,
    folder: Path,
    name: str,
    drawn: Iterable[tuple[Shot, Sequence[Lamp]]],
    samples: int,
    *,
    told: bool,
    ordinary: bool = False,
) -> None:
    """Photographs under the lamps of each as they are drawn, their depth, and the lamp if it is to be told."""
    (folder / name).mkdir(parents=True)
    frames, photograph = [], photographer("mitsuba")
    for index, (shot, lamps) in enumerate(drawn):
        path = f"{name}/r_{index:04d}"
        image = photograph(room.shapes, shot, lamps, samples, int(room.rng.integers(2**31)))
        depth = room.surfaces.distances(shot.eye, shot.rays()).reshape(PIXELS, PIXELS)
        if ordinary:
            depth = sensed(depth, np.random.default_rng(index))
            Image.fromarray(developed(image)).save(folder / f"{path}.png")
        else:
            OpenEXR.File({}, {"RGBA": image}).write(str(folder / f"{path}.exr"))
        OpenEXR.File({}, {"Z": depth.astype(np.float32)}).write(str(folder / f"{path}_depth.exr"))
        known = {"pl_pos": lamps[0].place.tolist(), "pl_intensity": [POWER] * 3} if told else {}
        frames.append(shot.frame(path) | known | {"depth_path": f"{path}_depth.exr"})
        print(path, flush=True)
    write_json(folder / f"transforms_{name}.json", {"frames": frames})


def write_targets(room: Room, folder: Path, name: str, samples: int, renderers: Sequence[str]) -> list[str]:
    """Photographs under a lamp of a class, by each renderer; the lamp is written beside them. Returns their names."""
    while True:
        shots, lamp = [room.shot() for _ in range(TARGET_VIEWS)], room.place()
        framed, seen = shots[0].frames(lamp), room.sees(shots[0].eye, lamp)
        if name == ("out_of_frame" if not framed else "visible" if seen else "occluded"):
            break
    on = [Lamp(lamp, room_intensity(room))]
    seeds = [int(room.rng.integers(2**31)) for _ in shots]
    written = []
    for renderer in renderers:
        target = name if len(renderers) == 1 else f"{name}_{renderer}"
        (folder / "targets" / target).mkdir(parents=True)
        for index, (shot, seed) in enumerate(zip(shots, seeds, strict=True)):
            image = photographer(renderer)(room.shapes, shot, on, samples, seed)
            OpenEXR.File({}, {"RGBA": image}).write(str(folder / "targets" / target / f"view_{index}.exr"))
        frames = [shot.frame(f"view_{index}") for index, shot in enumerate(shots)]
        write_json(folder / "targets" / target / "transforms.json", {"frames": frames})
        write_lights(folder, target, on)
        written.append(target)
        print(f"targets/{target}", flush=True)
    return written


def room_intensity(room: Room) -> np.ndarray:
    """(3,) of a lamp [W/sr]."""
    return room.rng.uniform(*INTENSITY) * room.rng.uniform(0.6, 1.0, 3)


def write_lights(folder: Path, name: str, lamps: Sequence[Lamp]) -> None:
    """The truth, as a light file: a ball is the point in its middle."""
    (folder / "truth").mkdir(exist_ok=True)
    lights = [{"type": "point", "position": one.place.tolist(), "intensity": one.intensity.tolist()} for one in lamps]
    write_json(folder / "truth" / f"{name}.json", {"version": 1, "lights": lights})


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
    parser.add_argument("--targets", nargs="+", choices=RENDERERS, default=["mitsuba"], help="who renders the targets")
    parser.add_argument("--lamps", type=int, default=0, help="train from photographs under so many unknown lamps")
    parser.add_argument("--ordinary", action="store_true", help="a capture in 8 bits, of unknown exposure, noisy depth")
    parser.add_argument("--furniture", type=Path, default=FURNITURE, help="libraries (.sh3f) for a furnished room")
    given = parser.parse_args()
    if given.ordinary and not given.lamps:
        parser.error("--ordinary: expected a capture, which --lamps N asks for")
    room = Room(given.kind, given.seed, given.furniture)
    given.folder.mkdir(parents=True)
    write_json(given.folder / "dataset_info.json", {"version": 1, "depth_convention": "ray_distance"})
    if given.lamps:
        write_capture(room, given.folder, given.views, given.samples, given.lamps, given.ordinary)
    else:
        write_split(room, given.folder, "train", given.views, given.samples)
    write_split(room, given.folder, "test", 6, 16 * given.samples)
    names = [
        {"name": target, "occlusion": name}
        for name in CLASSES
        for target in write_targets(room, given.folder, name, given.samples, given.targets)
    ]
    write_json(given.folder / "targets" / "targets.json", {"targets": names})


if __name__ == "__main__":
    main()
