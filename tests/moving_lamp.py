"""A lamp that moves through the small room of `lit_room`, followed by stage=track."""

from __future__ import annotations

from pathlib import Path

import torch

from frozen_store import RESOLUTION, artifact, frozen_artifact, write_targets
from lit_room import room_cameras
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.fitting import FitViews
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.stages.base import StageContext
from rgspipe.stages.lights import track
from rgspipe.store.artifacts import Artifact

#: Of the lamp in each frame, and how its frames are called.
PLACES = [(0.1 - 0.06 * k, -0.25 + 0.05 * k, 0.3) for k in range(3)]
NAMES = [f"rig_{k:04d}" for k in range(3)]


def followed_lamp(root: Path, folder: Path) -> tuple[Artifact, StageContext]:
    """The frozen room in the store `root`, and what the stage was told and said, which wrote into `folder`."""
    freeze = frozen_artifact(root)
    lights = [PointLight(torch.tensor(place, dtype=torch.float64), torch.ones(3).double()) for place in PLACES]
    views = FitViews.prepare(FrozenScene.load(freeze.folder()), room_cameras(RESOLUTION), sharp=True)
    images = {name: views.render(light) for name, light in zip(NAMES, lights, strict=True)}
    truths = {name: (light,) for name, light in zip(NAMES, lights, strict=True)}
    targets = artifact(root, "generate_targets", lambda folder: write_targets(folder, images, truths))
    config = with_changes(RgspipeConfig(stage="track"), {"views.count": 2})
    folder.mkdir()
    context = StageContext(config, {"freeze": freeze, "generate_targets": targets}, {}, folder)
    track.run(context)
    return freeze, context
