"""How long a picture takes while a lamp is dragged, and at rest: `python tests/viewer/speed.py FOLDER`."""

from __future__ import annotations

import io
import statistics
import sys
import time

import torch
from PIL import Image

from rgspipe.renderer.frozen import FrozenScene
from rgspipe.viewer.cameras import first_camera
from rgspipe.viewer.lamp_images import LampImages
from rgspipe.viewer.session import Session

REPEATS = 15


def main() -> None:
    """Print the median of each quality at 256 by 256 pixels, from the changed lamp to the bytes that are sent."""
    session = Session(LampImages(FrozenScene.load(sys.argv[1])))
    session.add()
    camera = first_camera(*session.images.frozen.bounds)
    print(f"{len(session.images.frozen.surfels)} surfels, {torch.get_num_threads()} threads")
    for quality in ("soft", "sharp"):
        times = []
        for step in range(REPEATS + 1):
            light = session.lights[0]
            began = time.perf_counter()
            session.replace(0, light.at(light.position + 0.002), "drag")
            picture, _ = session.picture(camera, quality)
            Image.fromarray(picture).save(io.BytesIO(), format="JPEG" if quality == "soft" else "PNG", quality=80)
            times += [time.perf_counter() - began] if step else []
        print(f"{quality}: {1e3 * statistics.median(times):.0f} ms")


if __name__ == "__main__":
    main()
