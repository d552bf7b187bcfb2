"""What everything that drives the viewer in a real browser shares: the browser, and where things are on its page."""

from __future__ import annotations

import shutil

import torch

from rgspipe.scene import Camera
from rgspipe.viewer.lamp_controls import ARMS

CHROMIUM = shutil.which("chromium")

#: Software rendering, so that no GPU is needed.
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def launched(playwright):
    """Chromium, without a window."""
    return playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)


def on_canvas(camera: Camera, window, place: torch.Tensor) -> tuple[float, float]:
    """Where a point of the scene is on the page."""
    box = window.locator("canvas").first.bounding_box()
    (x, y), _ = camera.project(place)
    scale = box["width"] / camera.width
    return box["x"] + scale * float(x), box["y"] + scale * float(y)


def grip(size: float) -> torch.Tensor:
    """(3,) from a lamp to where the mouse holds its gizmo, by the arrow along x, in a scene of this size."""
    return torch.tensor([0.75 * ARMS * size, 0.0, 0.0], dtype=torch.float64)
