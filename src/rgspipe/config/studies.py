"""What is compared with what."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

from rgspipe.config.compared import ComparedFits
from rgspipe.config.scene import Modelled
from rgspipe.errors import InputError
from rgspipe.options import Options, option

#: What a study is about.
Kind = Literal["captures", "lamps", "views", "robustness", "classes", "kinds", "regions", "adam", "courses", "zoo"]

#: Settings that only some kinds of study have a use for; those that are not listed here use all of them.
UNUSED: dict[Kind, tuple[str, ...]] = {
    "captures": ("views", "methods", "paper_adam_limit", "paper_adam_views", "zoo", "lightings"),
    **dict.fromkeys(("views", "robustness", "classes", "kinds", "regions", "adam"), ("zoo", "lightings")),
    "courses": ("cases", "scenes", "views", "paper_adam_limit", "paper_adam_views", "zoo", "lightings"),
    "zoo": ("scenes", "paper_adam_limit", "paper_adam_views", "lightings"),
    "lamps": ("views", "methods", "paper_adam_limit", "paper_adam_views", "zoo"),
}


@dataclass(frozen=True)
class EvaluateConfig(Options):
    """How estimates are compared with the truth."""

    success: float = option(0.01, low=0, high=1)
    """largest position error of a success, fraction of the scene's size"""


@dataclass(frozen=True)
class ZooStudyConfig(Options):
    """Which rooms of the zoo a study takes, and how they are photographed."""

    seeds: tuple[int, ...] = option((1, 3, 5), low=0, high=2**31 - 1)
    """rooms, by scene.zoo.seed: odd ones are for work, even ones only for final figures"""
    fewest_views: int = option(25, low=2, high=100000)
    """training views: how many are drawn from the seed at least"""
    most_views: int = option(100, low=2, high=100000)
    """and at most"""
    least_noise: float = option(0.0, low=0, high=10)
    """capture.image_noise and target_capture.noise: what is drawn from the seed at least"""
    most_noise: float = option(0.1, low=0, high=10)
    """and at most"""

    def check(self) -> None:
        """Refuse ranges that hold nothing, and rooms that are named twice.

        Raises:
            InputError: says which.
        """
        for least, most in (("fewest_views", "most_views"), ("least_noise", "most_noise")):
            if getattr(self, least) > getattr(self, most):
                found = f"{getattr(self, most)} below {least}, {getattr(self, least)}"
                raise InputError(most, expected=f"no less than {least}", found=found, remedy="Change one of them.")
        twice = sorted({seed for seed in self.seeds if self.seeds.count(seed) > 1})
        if twice:
            raise InputError("seeds", expected="each room once", found=f"{twice[0]} twice", remedy="Name it once.")


@dataclass(frozen=True)
class StudyConfig(ComparedFits):
    """What a study compares: cases, methods and numbers of views."""

    kind: Kind = "captures"
    """what it is about: captures (what becomes of a trained scene when its capture gets worse); of recovered lights
    views (how many), robustness (errors of images and model), classes (where the light is), kinds (of lights), regions
    (how often those of 95 % hold the truth) or adam (the paper's method beside ours); courses (of fits from their start
    to their answer); zoo (rooms that nobody tuned); lamps (that were on and unknown while a room was photographed)"""
    cases: tuple[str, ...] = ("clean",)
    """what is compared: `clean`, or overrides such as target_capture.noise=0.03, several joined by spaces, and `NAME: `
    before them where wanted"""
    scenes: tuple[Modelled, ...] = ()
    """scenes that are compared; by default the one that is configured"""
    zoo: ZooStudyConfig = ZooStudyConfig()
    lightings: int = option(3, low=1, high=10000)
    """captures of each case with kind=lamps, from dataset.seed on: each number draws cameras and lamps anew"""

    def check(self) -> None:
        """Refuse settings that the kind of study has no use for.

        Raises:
            InputError: one of them is not as it is by default.
        """
        plain = {item.name: item.default for item in fields(self)}
        for name in UNUSED.get(self.kind, ()):
            if getattr(self, name) != plain[name]:
                used = [one for one in plain if one not in UNUSED[self.kind]]
                raise InputError(
                    name,
                    expected=f"its default where study.kind={self.kind}, which uses {', '.join(used)}",
                    found=str(getattr(self, name)),
                    remedy=f"Leave study.{name} out, or choose another study.kind.",
                )
