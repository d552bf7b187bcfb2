"""How long pictures take while a lamp or the camera moves, and at rest: `python tests/viewer/speed.py [FOLDER]`.

Without the folder of a frozen scene it takes a Cornell box of 10000 surfels on its true surfaces.
"""

from __future__ import annotations

import io
import resource
import statistics
import sys
import time

import torch
from PIL import Image

import rgspipe as rg
from rgspipe.viewer.around import cameras_around
from rgspipe.viewer.cameras import first_camera
from rgspipe.viewer.lamp_images import LampImages
from rgspipe.viewer.painter import COARSE
from rgspipe.viewer.search import Finder
from rgspipe.viewer.session import Session

REPEATS = 15

#: How far a lamp is dragged between two pictures, scene units.
MOVED = 0.002


def main() -> None:
    """Print medians at 256 by 256 pixels, from what is changed to the bytes that are sent, and of a search."""
    made, began = len(sys.argv) < 2, _now()
    surfels = rg.exact_surfels(rg.CornellBox(), 10000) if made else None
    session = Session(LampImages(rg.FrozenScene.freeze(surfels) if made else rg.FrozenScene.load(sys.argv[1])))
    session.add()
    camera = first_camera(*session.images.frozen.bounds)
    print(f"{len(session.images.frozen.surfels)} surfels, {torch.get_num_threads()} threads; wall and processor time")
    _tell("made and frozen" if made else "loaded", [_since(began)])
    _tell("first picture", [_picture(session, camera, "sharp")])
    for quality in ("soft", "sharp"):
        _tell(f"lamp moved, {quality}", [_picture(session, camera, quality, MOVED) for _ in range(REPEATS + 1)][1:])
    around = [one for _, one in cameras_around(session.images.frozen, camera)]
    _tell("camera moved, coarse", [_picture(session, one.resized(COARSE), "coarse") for one in around])
    _tell("camera at rest, sharp", [_picture(session, one, "sharp") for one in around])
    _tell_memory()
    _search(session, camera)
    _tell_memory()


def _picture(session: Session, camera: rg.Camera, quality: str, moved: float = 0.0) -> tuple[float, float]:
    """Seconds, and seconds of the processor, from a lamp that is moved so far to a picture."""
    light, began = session.lights[0], _now()
    session.replace(0, light.at(light.position + moved), "drag")
    picture, _ = session.picture(camera, quality)
    Image.fromarray(picture).save(io.BytesIO(), format="PNG" if quality == "sharp" else "JPEG", quality=80)
    return _since(began)


def _now() -> tuple[float, float]:
    return time.perf_counter(), time.process_time()


def _since(began: tuple[float, float]) -> tuple[float, float]:
    return time.perf_counter() - began[0], time.process_time() - began[1]


def _search(session: Session, camera: rg.Camera) -> None:
    """A search, a refit from a tenth of the scene's size away, and advice, with three photographs of 128² pixels."""
    finder = Finder(session.images.frozen)
    around = [one.resized(128) for _, one in cameras_around(session.images.frozen, camera)]
    taken = [session.photograph(one) for one in (around[0], around[1], camera.resized(128))]
    start = tuple(light.at(light.position + 0.1 * session.images.frozen.size) for light in session.lights)
    finder.refit(taken, start)
    began = _now()
    finder.find(taken)
    _tell("first search", [_since(began)])
    for name, ask in (
        ("refit", lambda: finder.refit(taken, start)),
        ("advice of 16 cameras", lambda: finder.advice(taken, start, around, 0.003)),
    ):
        began = _now()
        ask()
        _tell(name, [_since(began)])


def _tell(name: str, times: list[tuple[float, float]]) -> None:
    wall, own = (1e3 * statistics.median(part) for part in zip(*times, strict=True))
    print(f"{name}: {wall:.0f} ms, {own:.0f} ms", flush=True)


def _tell_memory() -> None:
    print(f"most memory so far: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB", flush=True)


if __name__ == "__main__":
    main()
