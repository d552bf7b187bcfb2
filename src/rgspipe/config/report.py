"""The pages."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.fitting.options import Method
from rgspipe.options import Options, option


@dataclass(frozen=True)
class ReportConfig(Options):
    """What the report compares."""

    truth: bool = True
    """also recover the lights with surfels made from the true surfaces, where they are known"""
    views: tuple[int, ...] = option((1, 3), low=1, high=1000)
    """numbers of views"""
    methods: tuple[Method, ...] = ("search_lm", "paper_adam")
    """methods"""
    paper_adam_limit: int | None = option(1, low=1, high=100000)
    """targets of each class that paper_adam is run on"""


@dataclass(frozen=True)
class OverviewConfig(Options):
    """The page over scenes."""

    scenes: tuple[str, ...] = ("cornell", "corner", "hotdog", "room", "cornell_glossy")
    """scenes by the names of their folders, in this order; the newest report of each is taken"""
