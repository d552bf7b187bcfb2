"""Make the scene that `rgspipe demo` opens: `python tools/demo_room.py`, minutes, with Blender.

The small Cornell box of the tutorial is rendered and learnt with fewer surfels, and one of its targets with a lamp out
of sight of all cameras is taken along, its photographs in half precision (to 0.05 %), which halves them.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np

from rgspipe.cli import main
from rgspipe.cli.compose import compose_config
from rgspipe.datasets.exr import read_channels, write_channels
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.demo import ROOM, TARGET
from rgspipe.graph.resolver import resolve
from rgspipe.renderer.frozen_file import SURFELS
from rgspipe.stages import load_stage
from rgspipe.store.artifacts import Artifact, ArtifactStore

SCENE = ("scene=tutorial", "init.surfels=4000")

#: The tutorial's target that is copied.
CHOSEN = "occluded_000"


def made(stage: str) -> Artifact:
    """What a stage makes of the scene, made now where it is not there."""
    overrides = [f"stage={stage}", *SCENE]
    if code := main(overrides):
        sys.exit(code)
    config = compose_config(overrides)
    artifact = ArtifactStore(Path(config.outputs)).find(resolve(config, load_stage).key)
    assert artifact is not None
    return artifact


def pack() -> None:
    """Write the folder of the package."""
    surfels, images = made("train_surfels").file(SURFELS), made("generate_dataset").folder()
    shutil.rmtree(ROOM, ignore_errors=True)
    shutil.copytree(images / "targets" / CHOSEN, TARGET)
    for path in TARGET.glob("*.exr"):
        write_channels(path, {name: values.astype(np.float16) for name, values in read_channels(path).items()})
    shutil.copy(surfels, ROOM / SURFELS)
    truth = ROOM / "truth" / f"{TARGET.name}.json"
    truth.parent.mkdir()
    write_lights(truth, read_lights(images / "truth" / f"{CHOSEN}.json"))
    print(f"{sum(path.stat().st_size for path in ROOM.rglob('*')) / 1e3:.0f} kB in src/rgspipe/demo/{ROOM.name}")


if __name__ == "__main__":
    pack()
