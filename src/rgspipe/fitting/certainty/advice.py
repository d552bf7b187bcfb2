"""Which further camera would tell most about the lights of a fit, and how many views a wanted accuracy takes.

What a fit of a set A of views would leave uncertain is predicted from the image of the lights that were found:

    C_A = H_A⁻¹ (σ² H_A + τ² Σ_k (η t_kA t_kAᵀ + (1 − η) Σ_{v∈A} t_kv t_kvᵀ)) H_A⁻¹ ,
    H_A = Σ_{v∈A} H_v ,    t_kA = Σ_{v∈A} t_kv

H_v is the Gauss-Newton matrix of view v and t_kv = Σ Jᵀy over its pixels that look at cell k of the surface: an error
of the model that brightens or darkens the cell y as a whole moves the answer by H⁻¹t. The share η of the errors'
variance is the same for all views (an albedo, the light that bounces onto the cell), so that more of them help only if
they weigh the cells differently or see others; the rest each view has to itself (where its rays end, what it sees of an
edge or of a shadow's rim) and averages out over views, as noise does. σ² and τ² are set such that the views of the fit
itself give its own covariance (see `uncertainty`). Where images are clipped, values that would be saturated tell
nothing; views that are added are taken with the exposure of the first one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from rgspipe.fitting.certainty.uncertainty import surface_cells, whitener
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.model.known_images import KnownImage
from rgspipe.fitting.model.moments import group_moments, information, scores
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.model.views import prepare_views
from rgspipe.fitting.options import CertaintyOptions
from rgspipe.fitting.result import FitResult
from rgspipe.progress import progress_bar
from rgspipe.renderer.ambient import ambient_radiance
from rgspipe.renderer.effects import ALL_EFFECTS, Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.model import SurfelModel
from rgspipe.scene import Camera

#: Images that are only predicted need no more pixels than this along their longer side.
COARSE_PIXELS = 48

#: The plan of views goes up to this many.
MOST_VIEWS = 8


@dataclass(frozen=True)
class SuggestedView:
    """A camera and what it would do.

    Attributes:
        camera: its index among the candidates.
        position_sd: predicted root-mean-square error of the position of the worst light with this view added, as a
            fraction of the scene's size; infinite where it stays undetermined.
    """

    camera: int
    position_sd: float


@dataclass(frozen=True)
class ViewAdvice:
    """Which views to add to a fit.

    Attributes:
        present_views: how many views the fit had.
        present_sd: root-mean-square position error of its worst light, by its own covariance; a fraction of the
            scene's size.
        ranked: every candidate added alone, the best first.
        plan: the best candidate, then the best one beside that, and so on, up to `MOST_VIEWS` views together.
        in_order: the candidates as they were given, each added to those before it, up to `MOST_VIEWS` views together.
        wanted: the accuracy that was asked for, in the same unit.
        views_needed: with how many views of the plan, those of the fit included, it is reached; None if it is not.
    """

    present_views: int
    present_sd: float
    ranked: tuple[SuggestedView, ...]
    plan: tuple[SuggestedView, ...]
    in_order: tuple[SuggestedView, ...]
    wanted: float
    views_needed: int | None

    def words(self, names: Sequence[str]) -> str:
        """The advice in a sentence or two; `names` are the candidates' names."""
        now = f"With {_views(self.present_views)} the least certain light's place is {_known(self.present_sd)}"
        if not self.ranked:
            return f"{now}; there is no other camera to add."
        best, wanted = self.ranked[0], f"{100.0 * self.wanted:.2g} %"
        text = f"{now}; {names[best.camera]} would help most, and then it is {_known(best.position_sd)}. "
        if self.views_needed is None:
            last = self.plan[-1].position_sd if self.plan else self.present_sd
            most = self.present_views + len(self.plan)
            return f"{text}{wanted} is not reached: with {_views(most)} it is {_known(last)}."
        return f"{text}For {wanted} it takes {_views(self.views_needed)}."


def suggest_views(
    frozen: FrozenScene,
    result: FitResult,
    present: Sequence[Camera],
    candidates: Sequence[Camera],
    *,
    wanted: float,
    effects: Effects = ALL_EFFECTS,
    capture: ImageCapture | None = None,
    certainty: CertaintyOptions | None = None,
) -> ViewAdvice:
    """Rank further cameras for a fit by what they would leave uncertain.

    Args:
        frozen: the scene.
        result: the fit; with at least one light.
        present: the cameras that it used.
        candidates: cameras that could be added.
        wanted: position error to reach, a fraction of the scene's size.
        effects: parts of light transport of the fit; direct light is taken at surfels' centres here.
        capture: how its images were taken, and others would be; as radiance if None.
        certainty: how sure the fit said that it was.

    Raises:
        ValueError: the fit found no light, or used no camera.
    """
    if not result.lights or not present:
        raise ValueError("views can be suggested only for a fit with lights and cameras")
    cameras = [*present, *candidates]
    clips = _clips(result, capture or ImageCapture(), len(present), len(cameras))
    options = certainty or CertaintyOptions()
    evidence = _evidence(frozen, result, cameras, effects, clips, options.cell)
    first = list(range(len(present)))
    forecast = _Forecast.fitted_to(result, evidence, first, frozen.size, options.common)
    others = range(len(present), len(present) + len(candidates))
    found = [SuggestedView(view - len(present), forecast.position_sd([*first, view])) for view in others]
    # Cameras that differ by rounding alone keep their order.
    ranked = tuple(sorted(found, key=lambda view: float(f"{view.position_sd:.9g}")))
    plan = _plan(forecast, first, list(others), len(present))
    in_order = _in_order(forecast, len(present), len(candidates))
    present_sd = forecast.present_sd
    reached = [present_sd, *(view.position_sd for view in plan)]
    needed = next((len(present) + more for more, sd in enumerate(reached) if sd <= wanted), None)
    return ViewAdvice(len(present), present_sd, ranked, plan, in_order, wanted, needed)


def _clips(result: FitResult, capture: ImageCapture, present: int, count: int) -> Tensor:
    """(count,) radiance from which on each view is saturated, in the exposure of the first one."""
    clips = torch.full((count,), math.inf, dtype=torch.float64)
    clips[:present] = capture.saturated * capture.clips(present)
    # A further one is taken as the others were.
    clips[present:] = clips[:present].min()
    if result.exposures:
        clips[:present] /= torch.tensor(result.exposures, dtype=torch.float64)
    return clips


def _plan(forecast: _Forecast, chosen: list[int], others: list[int], present: int) -> tuple[SuggestedView, ...]:
    """Greedy: in each round the view that leaves the least."""
    plan, chosen, others = [], [*chosen], [*others]
    while others and len(chosen) < MOST_VIEWS:
        sds = [forecast.position_sd([*chosen, view]) for view in others]
        best = min(range(len(others)), key=sds.__getitem__)
        chosen.append(others.pop(best))
        plan.append(SuggestedView(chosen[-1] - present, sds[best]))
    return tuple(plan)


def _in_order(forecast: _Forecast, present: int, candidates: int) -> tuple[SuggestedView, ...]:
    """One candidate after the other, as they are given."""
    ends = range(present + 1, min(MOST_VIEWS, present + candidates) + 1)
    return tuple(SuggestedView(end - 1 - present, forecast.position_sd(range(end))) for end in ends)


@dataclass(frozen=True)
class _Evidence:
    """What each view would tell of n unknowns.

    Attributes:
        matrices: (V, n, n) Gauss-Newton matrices.
        brightening: (V, K, n) Jacobian times image, summed over the pixels of each view that see each cell.
        positions: per light the columns of its position.
    """

    matrices: Tensor
    brightening: Tensor
    positions: tuple[Tensor, ...]


@dataclass(frozen=True)
class _Forecast:
    """Predicts what sets of views leave uncertain; `common` is η, `noise` σ² and `model` τ²."""

    evidence: _Evidence
    common: float
    noise: float
    model: float
    size: float
    present_sd: float

    @classmethod
    def fitted_to(
        cls, result: FitResult, evidence: _Evidence, present: list[int], size: float, common: float
    ) -> _Forecast:
        """With noise and error of the model such that the present views give the fit's own covariance."""
        unit = cls(evidence, common, 1.0, 1.0, size, 0.0)
        noise, model = unit.variances(present)
        own = [_trace(part) for part in result.noise_covariance]
        rest = [max(_trace(whole) - part, 0.0) for whole, part in zip(result.covariance, own, strict=True)]
        worst = max(_trace(whole) for whole in result.covariance)
        return cls(evidence, common, _ratio(own, noise), _ratio(rest, model), size, math.sqrt(worst) / size)

    def variances(self, views: Sequence[int]) -> tuple[list[float], list[float]]:
        """Per light the sum of its position's variances from noise and from errors of the model, for unit size."""
        matrix = self.evidence.matrices[list(views)].sum(dim=0)
        root, unknown = whitener(matrix)
        # How far an error of each cell moves the answer: one of a view alone (V, K, n), one of all of them (K, n).
        alone = self.evidence.brightening[list(views)] @ root @ root.T
        together = alone.sum(dim=0)
        noise, model = [], []
        for position in self.evidence.positions:
            lost = bool(unknown[position].any())
            shared, own = together[:, position].square().sum(), alone[..., position].square().sum()
            noise.append(math.inf if lost else float(root[position].square().sum()))
            model.append(math.inf if lost else float(self.common * shared + (1.0 - self.common) * own))
        return noise, model

    def position_sd(self, views: Sequence[int]) -> float:
        """Root-mean-square position error of the worst light, a fraction of the scene's size."""
        noise, model = self.variances(views)
        worst = max(self.noise * a + self.model * b for a, b in zip(noise, model, strict=True))
        return math.sqrt(worst) / self.size if not math.isnan(worst) else math.inf


def _evidence(
    frozen: FrozenScene, result: FitResult, cameras: Sequence[Camera], effects: Effects, clips: Tensor, cell: float
) -> _Evidence:
    """The evidence of every camera, from small images of the lights that were found.

    Args:
        clips: (V,) radiance from which on values tell nothing.
        cell: side of the surface's cells, a part of the scene's size.
    """
    small = [camera.reduced(COARSE_PIXELS) for camera in cameras]
    weights = [
        frozen.view(camera, supersampling=1) for camera in progress_bar(small, "looking through cameras", unit="view")
    ]
    views = prepare_views(frozen, weights)
    black = torch.zeros((len(views.pixels), 3), device=views.operator.matrix.device)
    problem = LightProblem(views, SurfelModel(views, effects), black, 1.0)
    pairs = zip(result.lights, result.covariance, strict=True)
    emitters = [Emitter.fitted(light, matrix) for light, matrix in pairs]
    intensity = torch.stack([light.intensity.double().cpu() for light in result.lights])
    radiance = None if result.ambient is None else ambient_radiance(frozen, effects.interreflection)
    if radiance is not None:
        problem = problem.with_known(KnownImage("ambient", views.operator @ radiance, 1.0))
        intensity = torch.cat([intensity, result.ambient.value[None]])
    columns = [*(problem.evaluate(emitter) for emitter in emitters), *problem.known_columns]
    image = -problem.residual(columns, intensity)
    cells, count = surface_cells(views, cell)
    ends = torch.tensor([camera.pixel_count for camera in small]).cumsum(0)
    view = torch.searchsorted(ends, views.pixels.cpu(), right=True)
    # A small pixel stands for as many as it covers of the camera's own.
    scale = torch.tensor([a.pixel_count / b.pixel_count for a, b in zip(cameras, small, strict=True)])[view]
    groups = (view * count + cells).to(image.device)
    weight = scale[:, None].to(image) * (image < clips[view][:, None].to(image))
    values, owners = group_moments(columns, image, weight, groups, count * len(cameras))
    values = values.reshape(len(cameras), count, *values.shape[1:])
    brightening = scores(values, owners, intensity)
    positions = tuple((owners == index).nonzero()[:3, 0] for index in range(len(emitters)))
    return _Evidence(information(values.sum(dim=1), owners, intensity), brightening, positions)


def _trace(matrix: Tensor) -> float:
    """The sum of a position's variances."""
    return float(matrix.diagonal()[:3].sum())


def _ratio(wanted: Sequence[float], found: Sequence[float]) -> float:
    """How many times larger `wanted` is, over the lights whose positions are known; 1 if there is none."""
    pairs = [(a, b) for a, b in zip(wanted, found, strict=True) if math.isfinite(a) and math.isfinite(b) and b > 0.0]
    return sum(a for a, _ in pairs) / sum(b for _, b in pairs) if pairs else 1.0


def _views(count: int) -> str:
    return "1 view" if count == 1 else f"{count} views"


def _known(share: float) -> str:
    return f"known to {100.0 * share:.2g} % of the scene's size" if math.isfinite(share) else "undetermined"
