"""The light-independent operators of the trained scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rgspipe.options import Options, option


@dataclass(frozen=True)
class FreezeConfig(Options):
    """The light-independent operators of the trained scene."""

    surfels: Literal["trained", "truth"] = "trained"
    """what is frozen: the trained surfels, or some made from the true surfaces, to compare with"""
    gather_rays: int = option(256, low=8, high=65536)
    """hemisphere rays of a surfel"""
    patches: int = option(1000, low=8, high=20000)
    """patches of the indirect light"""
    dictionary_grid: int = option(8, low=2, high=64)
    """candidate lights along each axis of the room"""
    known_lamps: int = option(19, low=0, high=1000)
    """at most so many lamps of held-out views are asked for, to widen regions that leave them out; 0 for none"""
    seed: int = option(0, low=0, high=2**31 - 1)
    """draws of rays"""
