"""rgspipe: from images of a scene, find the lights.

import rgspipe as rg

scene = rg.FrozenScene.load("outputs/cornell/freeze/latest")
camera = rg.Camera.look_at([0, -1.5, 0], [0, 0, 0])
image = scene.render(camera, rg.PointLight([-0.3, 0.3, -0.1], 0.8))
print(rg.fit_lights(scene, camera, image))
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from rgspipe.machine.threads import settle_threads

if TYPE_CHECKING:
    from rgspipe.capture.captured import Captured, capture_scene
    from rgspipe.capture.options import CaptureOptions
    from rgspipe.datasets.light_file import read_ambient, read_lights, write_lights
    from rgspipe.datasets.location import load_views
    from rgspipe.datasets.photometric_file import read_photometry
    from rgspipe.datasets.ply.file import PlyOptions, save_ply
    from rgspipe.datasets.reading_limits import ReadingLimits, reading_within
    from rgspipe.datasets.surfel_file import load_surfels, save_surfels
    from rgspipe.datasets.views import View
    from rgspipe.errors import InputError
    from rgspipe.evaluation.images import save_png, tone_map
    from rgspipe.fitting import BaseImages, FitResult, FitStatus, FitViews, ImageCapture, LightSpec, fit_lights
    from rgspipe.fitting.options import TrackOptions
    from rgspipe.fitting.solvers import PaperAdam, Search
    from rgspipe.fitting.tracking.track import track_lights
    from rgspipe.light_export.export import LightExport, export_lights
    from rgspipe.renderer.ambient import ambient_image
    from rgspipe.renderer.effects import Effects
    from rgspipe.renderer.frozen import FrozenScene
    from rgspipe.renderer.ply import load_ply
    from rgspipe.scene import Camera, Surfels
    from rgspipe.scene.lights import (
        LedLight,
        Light,
        PanelLight,
        PointLight,
        ProfileLight,
        SphereLight,
        SpotLight,
        SunLight,
    )
    from rgspipe.scene.models import CornellBox, Corridor, exact_surfels
    from rgspipe.training.trainer import Trained, TrainOptions, train
    from rgspipe.viewer.serve import Viewer, view

#: Where the public names live; they are imported when first used, so that `import rgspipe` stays quick.
_HOMES = {
    "capture.captured": ("Captured", "capture_scene"),
    "capture.options": ("CaptureOptions",),
    "datasets.light_file": ("read_ambient", "read_lights", "write_lights"),
    "datasets.location": ("load_views",),
    "datasets.ply.file": ("PlyOptions", "save_ply"),
    "datasets.reading_limits": ("ReadingLimits", "reading_within"),
    "datasets.surfel_file": ("load_surfels", "save_surfels"),
    "datasets.views": ("View",),
    "errors": ("InputError",),
    "evaluation.images": ("save_png", "tone_map"),
    "fitting": ("BaseImages", "FitResult", "FitStatus", "FitViews", "ImageCapture", "LightSpec", "fit_lights"),
    "fitting.options": ("TrackOptions",),
    "fitting.solvers": ("PaperAdam", "Search"),
    "fitting.tracking.track": ("track_lights",),
    "light_export.export": ("LightExport", "export_lights"),
    "renderer.ambient": ("ambient_image",),
    "renderer.effects": ("Effects",),
    "renderer.frozen": ("FrozenScene",),
    "renderer.ply": ("load_ply",),
    "scene": ("Camera", "Surfels"),
    "scene.lights": (
        "LedLight",
        "Light",
        "PanelLight",
        "PointLight",
        "ProfileLight",
        "SphereLight",
        "SpotLight",
        "SunLight",
    ),
    "datasets.photometric_file": ("read_photometry",),
    "scene.models": ("CornellBox", "Corridor", "exact_surfels"),
    "training.trainer": ("TrainOptions", "Trained", "train"),
    "viewer.serve": ("Viewer", "view"),
}

__all__ = [
    "BaseImages",
    "Camera",
    "CaptureOptions",
    "Captured",
    "CornellBox",
    "Corridor",
    "Effects",
    "FitResult",
    "FitStatus",
    "FitViews",
    "FrozenScene",
    "ImageCapture",
    "InputError",
    "LedLight",
    "Light",
    "LightExport",
    "LightSpec",
    "PanelLight",
    "PaperAdam",
    "PlyOptions",
    "PointLight",
    "ProfileLight",
    "ReadingLimits",
    "Search",
    "SphereLight",
    "SpotLight",
    "SunLight",
    "Surfels",
    "TrackOptions",
    "TrainOptions",
    "Trained",
    "View",
    "Viewer",
    "__version__",
    "ambient_image",
    "capture_scene",
    "exact_surfels",
    "export_lights",
    "fit_lights",
    "load_ply",
    "load_surfels",
    "load_views",
    "read_ambient",
    "read_lights",
    "read_photometry",
    "reading_within",
    "save_ply",
    "save_png",
    "save_surfels",
    "tone_map",
    "track_lights",
    "train",
    "view",
    "write_lights",
]

settle_threads()

__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(__all__)
