"""Surfels for other programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.options import Options


@dataclass(frozen=True)
class ExportConfig(Options):
    """Surfels for other programs."""

    light: str | None = None
    """light file: colours show the scene under these lights; by default the albedo"""
    layout: Literal["full", "viewer"] = "full"
    """all of a surfel, for this program and viewers that read properties by name; or just those of 3DGS, in order"""
