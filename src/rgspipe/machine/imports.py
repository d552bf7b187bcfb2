"""Imports of what is large, such as torch, in less time."""

from __future__ import annotations

import gc
import importlib
import sys
from types import ModuleType


def imported(name: str) -> ModuleType:
    """A module, with all that it imports, while no garbage is collected.

    What is imported stays, and every collection would go through all of it: a sixth of the time that imports take.
    """
    if name in sys.modules or not gc.isenabled():
        return importlib.import_module(name)
    gc.disable()
    try:
        return importlib.import_module(name)
    finally:
        gc.enable()
