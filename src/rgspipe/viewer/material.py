"""What a visitor is shown beside the scene: photographs, and lamps that a fit found."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from rgspipe.datasets.alternatives_file import ToldAlternative, read_alternatives
from rgspipe.datasets.covariance_file import covariance_fields, read_covariances
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.json_file import read_json
from rgspipe.datasets.light_file import read_ambient, read_lights
from rgspipe.datasets.views import Target, View
from rgspipe.errors import InputError
from rgspipe.fitting import FitResult
from rgspipe.fitting.findings import FitStatus
from rgspipe.fitting.model.capture import SATURATED, ImageCapture
from rgspipe.fitting.result_text import as_text, doubt, headline, light_lines
from rgspipe.fitting.words import told_alternative
from rgspipe.scene import Camera, LightRig

#: The light file in the folder of a target's fit.
LIGHTS = "lights.json"

#: Of photographs of which only some are known with the lamps off.
HALF_KNOWN = "Lamps cannot be looked for here: only some of the photographs are there with the lamps off, too."


@dataclass(frozen=True, eq=False)
class Photograph:
    """An image (H, W, 3) of linear radiance and the camera that took it.

    Attributes:
        mask: (H, W) the scene's share of each pixel, 0 where that tells too little of it; 1 if None.
        lights: under which it was taken, where they are known and not looked for.
        base: (H, W, 3) the same with the lamps off; black if None.
        clip: radiance at which the image is clipped; inf where it is not.
        saturated: a value from here on, as a part of the clip, tells only that the scene is at least so bright.
        emitters: (H, W) 1 where it shows lamps themselves, which searches leave out; None where nobody said so.
    """

    name: str
    camera: Camera
    image: Tensor
    mask: Tensor | None = None
    lights: LightRig | None = None
    base: Tensor | None = None
    clip: float = math.inf
    saturated: float = SATURATED
    emitters: Tensor | None = None

    @classmethod
    def of(cls, view: View, name: str) -> Photograph:
        """A view of a dataset or target; what is saturated in it is not searched for lamps."""
        saturated = view.saturated
        if view.base is not None and view.saturated_from is not None:
            saturated = saturated | (view.base >= view.saturated_from)
        mask = torch.where(saturated.any(dim=-1), 0.0, view.alpha)
        lights = None if view.light is None else (view.light,)
        return cls(name, view.camera, view.image, mask, lights, view.base, emitters=view.emitters)

    def explained(self, seen: Tensor) -> Tensor:
        """(H, W, 3) `seen` as it would have been photographed: what is saturated hides how much brighter it is."""
        is_hidden = (self.image >= self.saturated * self.clip) & (seen > self.image)
        return torch.where(is_hidden, self.image.to(seen), seen)


@dataclass(frozen=True, eq=False)
class Found:
    """Lamps that a search found.

    Attributes:
        covariance: of each, which begins with its position; none of those if not known.
        told: what is to be thought of them.
        costs: robust cost of the best rig of each number of lamps that was tried.
        path: the rigs on the way, from the start that won; or of lamps that move, frame by frame.
        alternatives: what they were weighed against.
        exposures: of each photograph over the first one's; empty where they were known.
        base_scale: (3,) how many times images with the lamps off are in the photographs; once if None.
        ambient: (3,) radiance that comes from all around through openings; black if None.
        frames: what each frame of lamps that move is called, and how it was found; empty where they stand.
        status, reason: how the fit ended, and why; empty where nothing is known of it.
    """

    lights: LightRig
    covariance: tuple[Tensor, ...] = ()
    told: str = ""
    costs: Mapping[int, float] = field(default_factory=dict)
    path: tuple[LightRig, ...] = ()
    alternatives: tuple[ToldAlternative, ...] = ()
    exposures: tuple[float, ...] = ()
    base_scale: Tensor | None = None
    ambient: Tensor | None = None
    frames: tuple[str, ...] = ()
    status: str = ""
    reason: str = ""

    @property
    def doubt(self) -> str:
        """What goes with the lamps to where the fit is not known; empty where it is sure of them."""
        return doubt(self.status, self.reason) if self.status else ""

    @property
    def fields(self) -> dict[str, Any]:
        """What a light file holds of them besides, as that of a fit does."""
        fields = {"lights": covariance_fields(len(self.lights), {"covariance": self.covariance})}
        return fields | ({"result": self.status, "reason": self.reason} if self.status else {})

    @property
    def step(self) -> int:
        """Which of the path has its lights: the last of them, or the end of all."""
        last = len(self.path) - 1
        return next((index for index in range(last, 0, -1) if self.path[index] == self.lights), last)

    @property
    def unknowns(self) -> dict[str, bool]:
        """What the fit looked for besides lamps, as `view` takes it, so that it is looked for again."""
        return {
            "exposure_free": any(exposure != 1.0 for exposure in self.exposures),
            "base_scale_free": self.base_scale is not None,
            "ambient": self.ambient is not None,
        }

    @classmethod
    def of(cls, result: FitResult) -> Found:
        """What a fit found."""
        steps = tuple(step.lights for step in result.trajectory)
        others = (ToldAlternative(one.lights, told_alternative(one), one.ruled_out) for one in result.alternatives)
        scale, ambient = (None if one is None else one.value for one in (result.base_scale, result.ambient))
        return cls(
            result.lights,
            result.covariance,
            repr(result),
            result.costs,
            steps,
            tuple(others),
            result.exposures,
            scale,
            ambient,
            status=str(result.status),
            reason=result.reason,
        )


@dataclass(frozen=True, eq=False)
class Case:
    """Photographs under lamps that are looked for, the truth and what a fit found, as far as these are known.

    Attributes:
        lacking: why there are no photographs, in a sentence.
        others: further photographs under the same lamps, which are looked at and not searched.
        warning: what is wrong with the photographs, in a sentence; empty where nothing is known to be.
    """

    name: str = "none"
    photographs: Sequence[Photograph] = ()
    truth: LightRig = ()
    found: Found | None = None
    lacking: str = "There are no photographs to find lamps in."
    others: Sequence[Photograph] = ()
    warning: str = ""

    @classmethod
    def of(
        cls, target: Target, truth: LightRig = (), found: Found | None = None, capture: ImageCapture | None = None
    ) -> Case:
        """A target; without its photographs where only some of them are known with the lamps off.

        Args:
            capture: where its images are clipped; what is saturated in them is not searched for lamps if None.
        """
        if len({view.base is None for view in target.views}) > 1:
            return cls(target.name, (), truth, found, HALF_KNOWN)
        views = [Photograph.of(view, f"{target.name}, view {index}") for index, view in enumerate(target.views)]
        if capture is not None:
            limits = zip(views, target.views, capture.clips(len(views)).tolist(), strict=True)
            known = capture.saturated
            views = [replace(one, mask=view.alpha, clip=clip, saturated=known) for one, view, clip in limits]
        return cls(target.name, views, truth, found)


def case_in(
    target: str | Path, found: Found | None = None, capture: Callable[[Sequence[View]], ImageCapture] | None = None
) -> Case:
    """The target in a folder; its truth stands in its dataset's folder truth/ where it is known.

    Args:
        capture: tells where images are clipped; see `Case.of`.
    """
    read = load_target(target)
    return Case.of(read, truth_of(target), found, None if capture is None else capture(read.views))


def truth_of(target: str | Path) -> LightRig:
    """The true lamps of a target."""
    target = Path(target).resolve()
    known = target.parents[1] / "truth" / f"{target.name}.json"
    return read_lights(known) if known.exists() else ()


def found_in(fit: str | Path) -> Found:
    """What is in the folder of a target's fit.

    Raises:
        InputError: it has no lights, as the folder of all fits, or they cannot be read.
    """
    path = Path(fit) / LIGHTS
    if not path.exists() and (fits := sorted(file.parent.name for file in Path(fit).glob(f"*/{LIGHTS}"))):
        found, remedy = f"fits of {', '.join(fits)}", f"Name one of them: {Path(fit) / fits[0]}."
        raise InputError(fit, expected="the folder of one target's fit", found=found, remedy=remedy)
    lights, told = read_lights(path), read_json(path, "a fit's light file")
    costs = {int(count): float(cost) for count, cost in told.get("costs", {}).items()}
    covariances = read_covariances(path)
    words = _words(told, lights, covariances) if {"result", "reason", "seconds"} <= told.keys() else ""
    steps = _path(Path(fit) / "convergence.csv", lights)
    exposures = tuple(float(one) for one in told.get("exposures", ()))
    scale = torch.tensor(told["base_scale"]["factor"]).double() if "base_scale" in told else None
    others, ambient = read_alternatives(path), read_ambient(path)
    ended = {"status": str(told.get("result", "")), "reason": str(told.get("reason", ""))}
    return Found(lights, covariances, words, costs, steps, others, exposures, scale, ambient, **ended)


def _words(told: Mapping[str, Any], lights: LightRig, covariances: Sequence[Tensor]) -> str:
    """As the fit itself told it."""
    head = headline(len(lights), FitStatus(told["result"]), float(told["seconds"]))
    return as_text(head, light_lines(lights, covariances), told["reason"])


def _path(table: Path, lights: LightRig) -> tuple[LightRig, ...]:
    """The rigs of the steps in a fit's convergence.csv, as far as they are of the lights that were found."""
    if not lights or not table.exists():
        return ()
    # Only the folder of a fit has a table; without pandas a page starts half a second sooner.
    import pandas as pd

    endings = ["" if index == 0 else f"_{index}" for index in range(len(lights))]
    rigs = []
    for row in pd.read_csv(table).to_dict("records"):
        pairs = zip(lights, endings, strict=True)
        rig = [one.with_columns({name: row.get(name + end, math.nan) for name in one.columns()}) for one, end in pairs]
        rigs.append(tuple(rig))
    return tuple(rig for rig in rigs if None not in rig)
