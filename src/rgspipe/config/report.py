"""The pages."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.config.compared import ComparedFits
from rgspipe.options import Options, option


@dataclass(frozen=True)
class ReportConfig(ComparedFits):
    """What the report compares."""

    views: tuple[int, ...] = option((1, 3), low=1, high=1000)
    """numbers of views"""
    truth: bool = True
    """also recover the lights with surfels made from the true surfaces, where they are known"""


@dataclass(frozen=True)
class OverviewConfig(Options):
    """The page over scenes."""

    scenes: tuple[str, ...] = ("cornell", "corner", "hotdog", "room", "cornell_glossy")
    """scenes by the names of their folders, in this order; the newest report of each is taken"""
