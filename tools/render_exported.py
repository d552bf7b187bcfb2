"""The Cornell box of the demo in Blender, under the lamps of an exported script, as the target's first camera sees it.

python tools/render_exported.py SCRIPT FILE.exr, in a process of its own; `guide_pictures.py` runs it.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

from rgspipe.blender import passes
from rgspipe.blender.job import RenderSettings
from rgspipe.blender.models import cornell
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.gs3 import load_target
from rgspipe.demo import TARGET
from rgspipe.scene.models import CornellBox

#: Samples a pixel, and diffuse bounces: as the guide says that Cycles has to be set.
SAMPLES, BOUNCES = 256, 64


def main(script: Path, path: Path) -> None:
    """Run the script in the room, and write what the camera sees."""
    camera = load_target(TARGET).views[0].camera
    settings = RenderSettings(camera.width, SAMPLES, denoise=True, max_bounces=BOUNCES)
    studio = passes.Studio(cornell.build(CornellBox()), settings, path.parent)
    sys.argv = ["blender"]
    runpy.run_path(str(script))
    write_image(path, *studio.radiance(camera, (), seed=1))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
