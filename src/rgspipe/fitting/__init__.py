"""From images of a frozen scene to the lights that made them.

Names are imported when they are first used, so that what only asks for options need not load torch.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rgspipe.fitting.findings import FitStatus
    from rgspipe.fitting.fit import FitViews, fit_lights
    from rgspipe.fitting.model.capture import BaseImages, ImageCapture
    from rgspipe.fitting.options import TrackOptions
    from rgspipe.fitting.result import FitResult, Step
    from rgspipe.fitting.solvers import PaperAdam, Search, Solver
    from rgspipe.fitting.spec import LightSpec

__all__ = [
    "BaseImages",
    "FitResult",
    "FitStatus",
    "FitViews",
    "ImageCapture",
    "LightSpec",
    "PaperAdam",
    "Search",
    "Solver",
    "Step",
    "TrackOptions",
    "fit_lights",
]

_HOMES = {
    "rgspipe.fitting.findings": ("FitStatus",),
    "rgspipe.fitting.fit": ("FitViews", "fit_lights"),
    "rgspipe.fitting.model.capture": ("BaseImages", "ImageCapture"),
    "rgspipe.fitting.options": ("TrackOptions",),
    "rgspipe.fitting.result": ("FitResult", "Step"),
    "rgspipe.fitting.solvers": ("PaperAdam", "Search", "Solver"),
    "rgspipe.fitting.spec": ("LightSpec",),
}


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(home), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
