"""Lights that move from frame to frame."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.fitting.options import TrackOptions


@dataclass(frozen=True)
class TrackConfig(TrackOptions):
    """Lights that move from frame to frame."""

    folder: str | None = None
    """a folder whose targets/ are the frames, in order; by default those of generate_targets, kind=drive"""
