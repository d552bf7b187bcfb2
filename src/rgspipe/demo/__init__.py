"""A small scene inside the package, which tools/demo_room.py makes and `rgspipe demo` shows."""

from __future__ import annotations

from pathlib import Path

import torch

from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.frozen_file import SURFELS

#: Surfels, a target with its photographs and the truth, laid out as a dataset is.
ROOM = Path(__file__).with_name("room")

#: What is looked for in it: a lamp that no photograph shows.
TARGET = ROOM / "targets" / "hidden"

#: Rays and patches that are frozen in seconds; see docs/guides/view.md for what that costs.
GATHER_RAYS, PATCHES = 128, 400


def demo_scene(device: torch.device | str = "cpu") -> FrozenScene:
    """The scene, frozen now: its operators take ten times the space of its surfels."""
    return FrozenScene.freeze(load_surfels(ROOM / SURFELS).to(device), gather_rays=GATHER_RAYS, patches=PATCHES)
