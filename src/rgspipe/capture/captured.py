"""A scene from photographs under unknown lamps: surfels with their albedo, and the lamps that were on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from rgspipe.arguments import as_count, as_several
from rgspipe.capture.bulbs import without_bulbs
from rgspipe.capture.certainty import Certainty
from rgspipe.capture.field import Field, Graph, Variances
from rgspipe.capture.lamps import LampProblem
from rgspipe.capture.oddities import Oddities
from rgspipe.capture.options import CaptureOptions
from rgspipe.capture.patches import with_patches
from rgspipe.capture.photographs import SHOWN, Numbers
from rgspipe.capture.prediction import Prediction
from rgspipe.capture.radiance import DRAWS, Measured, measured_radiance
from rgspipe.capture.received import Received
from rgspipe.capture.receivers import Receivers
from rgspipe.capture.refusals import (
    OFF,
    check_alike,
    check_brackets,
    check_lightings,
    check_measured,
    check_overlap,
    check_views,
)
from rgspipe.capture.search import BAR, FoundLamps, found_lamps, settled_on_all
from rgspipe.capture.several import found_in_turns, without
from rgspipe.capture.thinned import thinned, thinning
from rgspipe.capture.unlike import Said
from rgspipe.completion import with_unseen_surfaces
from rgspipe.datasets.views import View
from rgspipe.fitting.options import CertaintyOptions
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene.guesses import LEAST_DOUBT
from rgspipe.scene.lights import PointLight
from rgspipe.scene.shapes import Float
from rgspipe.scene.surfels import Surfels
from rgspipe.training.albedo import ALBEDO_RANGE
from rgspipe.training.initialise import initialise_surfels
from rgspipe.training.materials import trace_views
from rgspipe.training.operator_store import OperatorStore
from rgspipe.training.prior import albedo_prior

#: Albedo of surfaces of which nothing is known.
GREY = 0.5


@dataclass(frozen=True, repr=False)
class Captured:
    """What photographs told.

    Attributes:
        surfels: N with their albedo; those of surfaces that no camera saw are marked as guesses.
        lamps: that were on, W/sr.
        certainty: of the lamps.
        doubt: (N,) float32 standard deviation of the logarithm of each albedo, the common scale not counted.
        measured: radiance of the surfels, and exposures of the photographs.
        answer: how the number of lamps was chosen.
        frozen: the surfels with their light transport, as the lamps were found with.
        oddities: what is not matt, or lights itself, or cannot be.
        said: of the cameras; where those of `measured` have more of it free, the photographs contradict it.
        lighting: the name of the lamps that were on, if there are several.
    """

    surfels: Surfels
    lamps: tuple[PointLight, ...]
    certainty: Certainty
    doubt: Float[Tensor, " N"]
    measured: Measured
    answer: FoundLamps
    frozen: FrozenScene
    oddities: Oddities
    said: Said
    lighting: str = ""

    @property
    def guesses(self) -> NDArray[np.bool_]:
        """(K,) bool: lamps whose place is little sure, or all where light that is the same everywhere does as well."""
        in_doubt = self.certainty.spread(self.frozen.size) > CertaintyOptions.doubtful
        return in_doubt | (self.answer.over_even < BAR.least)

    def __repr__(self) -> str:
        return f"Captured({self.surfels!r}, {len(self.lamps)} lamps)"


def capture_scene(
    views: Sequence[View],
    surfels: Surfels | int,
    options: CaptureOptions | None = None,
    *,
    where: str | Path = "the photographs",
) -> Captured:
    """Albedo and lamps of a room from photographs that were taken while unknown lamps were on.

    Of photographs under several lightings (`View.lighting`) it is the first one's; see `capture_scenes`.
    """
    return capture_scenes(views, surfels, options, where=where)[0]


def capture_scenes(
    views: Sequence[View],
    surfels: Surfels | int,
    options: CaptureOptions | None = None,
    *,
    where: str | Path = "the photographs",
) -> list[Captured]:
    """The same for each lighting of the photographs, which share the room's albedo; on the CPU.

    Args:
        views: the photographs, with their cameras; their lights are not known. All of one `lighting` share their
            lamps; what those of "off" show is taken away from all others.
        surfels: the geometry, or how many to make from the depth of the views.
        options: how; the defaults if None.
        where: the dataset's folder, for errors.

    Raises:
        InputError: the photographs have known lights, show nothing, are all saturated, or do not overlap; there is
            no depth to make surfels from; or lamps are off in photographs of unknown exposure.
    """
    options = options or CaptureOptions()
    views = as_several(views, View, "views", "rg.load_views reads them.")
    check_views(views, where)
    check_lightings(views, options.exposure, options.response, where)
    if not isinstance(surfels, Surfels):
        surfels = as_count(surfels, "surfels", remedy="Pass surfels, or how many to make.")
        surfels = initialise_surfels(views, surfels, seed=options.seed, where=where)
    # The statistics of what follows are numpy's and scipy's.
    surfels, views = surfels.to(torch.float32).to("cpu"), [view.to("cpu") for view in views]
    if options.unseen:
        surfels = with_unseen_surfaces(surfels, [view.camera for view in views], depths=[view.depth for view in views])
    step, store = thinning(views, len(surfels)), OperatorStore(options.memory_mib, name="CaptureOptions")
    views = [thinned(view, step) for view in views]
    # A pixel among some that are left out is nearer to its middle than to the mean of what is around it.
    weights = trace_views(surfels, views, options.supersampling if step == 1 else 1, store)
    lit = _measured(weights, views, surfels, options, where)
    frozen = FrozenScene.freeze(surfels, gather_rays=options.gather_rays, seed=options.seed)
    answers = _found(frozen, list(lit.values()), _predicted(weights, views, options), options)
    return [_captured(lit[name], answer, options, name) for name, answer in zip(lit, answers, strict=True)]


def _measured(
    weights: Sequence[ViewWeights],
    views: Sequence[View],
    surfels: Surfels,
    options: CaptureOptions,
    where: str | Path,
) -> dict[str, Measured]:
    """The radiance of each lighting, without what shines with the lamps off."""
    found, said = {}, Said.of(options)
    for name in dict.fromkeys(view.lighting for view in views):
        own = [index for index, view in enumerate(views) if view.lighting == name]
        chosen = [weights[index] for index in own]
        taken = without_bulbs(chosen, [views[index] for index in own], surfels)
        bent = options.response == "free"
        if bent:
            check_brackets(taken, options.exposure)
        # Of a curve that is not known nobody can tell it from exposures that are not.
        free = said if bent else said.borne_out(chosen, taken, surfels)
        if free.exposure != "same":
            check_overlap(chosen, where)
        found[name] = measured_radiance(chosen, taken, exposure=free.exposure, vignetting=free.vignetting, bent=bent)
        if name != OFF:
            seen = (found[name].seen >= SHOWN) & ~found[name].blown_out.all(axis=1)
            check_measured(seen, found[name].radiance, taken, where)
    if OFF in found:
        check_alike({name: measured.cameras for name, measured in found.items()}, where)
    off = found.pop(OFF, None)
    return found if off is None else {name: without(measured, off) for name, measured in found.items()}


def _predicted(weights: Sequence[ViewWeights], views: Sequence[View], options: CaptureOptions) -> Numbers:
    """(N, 3) albedo as far as it is known before."""
    surfels = weights[0].operator.shape[1]
    if options.albedo_prior == "none":
        return np.full((surfels, 3), GREY)
    asked, otherwise = (f"CaptureOptions(albedo_prior={prior!r})" for prior in ("dataset", "none"))
    albedo, weight = (part.double().numpy() for part in albedo_prior(weights, views, asked, otherwise))
    known = weight > 0.0
    # A prediction is known up to a scale, and what no map shows is as the middle of the rest.
    middle = np.median(albedo[known], axis=0) if known.any() else GREY
    return np.where(known[:, None], albedo, middle)


def _found(
    frozen: FrozenScene, lit: Sequence[Measured], predicted: Numbers, options: CaptureOptions
) -> list[FoundLamps]:
    """The lamps of each lighting: looked for on an even part of the surfels if there are many, and settled on all."""
    every = Receivers(frozen)
    told = np.concatenate([part for measured in lit for part in _told(measured)], axis=1)
    kinds = np.unique(told, axis=0, return_inverse=True)[1].ravel()
    part = Receivers.of(frozen, kinds, options.search_surfels).with_dictionary(options.grid, options.seed)

    def problems(receivers: Receivers) -> list[LampProblem]:
        own = receivers.at(predicted)
        graph = Graph.of(receivers.surfels, own)
        return [_problem(receivers, measured, own, graph, options) for measured in lit]

    answers = found_in_turns(problems(part), lambda problem, _: found_lamps(problem, options.count, options.most))
    if part.are_all:
        return answers
    return found_in_turns(problems(every), lambda problem, own: settled_on_all(problem, answers[own]))


def _told(measured: Measured) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(N, 3) bool each: channels that are measured, and those that are known from below."""
    seen = (measured.seen >= SHOWN)[:, None]
    return seen & ~measured.blown_out, seen & measured.blown_out


def _problem(
    receivers: Receivers, measured: Measured, predicted: Numbers, graph: Graph, options: CaptureOptions
) -> LampProblem:
    """What `measured` (A surfels) tells of lamps, on the N that are looked at, of albedo `predicted` (N, 3)."""
    told, clipped = (receivers.at(part) for part in _told(measured))
    radiance, seen = receivers.at(measured.radiance), receivers.at(measured.seen) >= SHOWN
    bounded = bool(clipped.any())
    prediction = None if options.albedo_prior == "none" else Prediction.of(predicted, graph)
    # A surface's paint is taken for even until there are lamps to ask.
    expected = predicted if prediction is None else prediction.with_shares(1.0, 0.0)
    received = Received.of(receivers.gather, radiance, told, expected)
    pixels = np.where(seen, receivers.at(measured.variance), np.inf)
    field = Field(graph, pixels, seen.astype(np.float64), Variances(), told=told if bounded else None)
    bounds = clipped if bounded else None
    return LampProblem(receivers, received, field, radiance, expected, pixels, options.gather_rays, prediction, bounds)


def _captured(measured: Measured, answer: FoundLamps, options: CaptureOptions, lighting: str) -> Captured:
    problem, lamps = answer.best.problem, answer.best.lamps
    frozen, surfels = problem.frozen, problem.frozen.surfels
    field, either = with_patches(problem.field, problem.residual(lamps), problem.receivers.surfels)
    problem = replace(problem, field=field)
    albedo = torch.from_numpy(np.clip(problem.albedo(lamps), *ALBEDO_RANGE)).float()
    doubt = torch.from_numpy(np.sqrt(field.deviation(DRAWS, options.seed) ** 2 + either)).float()
    guessed = torch.where(surfels.guessed > 0.0, doubt.clamp(min=LEAST_DOUBT), 0.0)
    surfels = replace(surfels, albedo=albedo, guessed=guessed)
    certainty = Certainty.of(answer)
    oddities = Oddities.of(problem, lamps, measured)
    return Captured(
        surfels, lamps.lights(), certainty, doubt, measured, answer, frozen, oddities, Said.of(options), lighting
    )
