"""Lights that a fit weighed against its answer, as data; `words` makes a sentence of it."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.scene import LightRig


@dataclass(frozen=True)
class Alternative:
    """Lights of another number, or clearly elsewhere.

    Attributes:
        lights: the rig, float64.
        cost: their robust cost, over the least where the answer stands.
        left: the energy that they leave unexplained, over what the answer leaves.
        more: how many more of them there are than lights of the answer; below 0 fewer.
        ruled_out: whether the answer is clearly the better one; else it is another answer.
    """

    lights: LightRig
    cost: float
    left: float
    more: int
    ruled_out: bool
