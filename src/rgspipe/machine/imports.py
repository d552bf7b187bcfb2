"""Imports of what is large, such as torch, in less time."""

from __future__ import annotations

import gc
import importlib
import sys
from types import ModuleType


def imported(name: str) -> ModuleType:
    """A module, with all that it imports, while no garbage is collected.

    What is imported stays, and every collection would go through all of it: a sixth of the time that imports take.
    Nor do later ones: it is frozen, after what is garbage already has been collected.
    """
    if name in sys.modules:
        return sys.modules[name]
    collects = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        return importlib.import_module(name)
    finally:
        gc.freeze()
        if collects:
            gc.enable()
