"""Materials of given surfels from the images of known lights."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from torch import Tensor

from rgspipe.datasets.views import View
from rgspipe.progress import progress_bar
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.transport import PatchTransport
from rgspipe.renderer.view_weights import ViewWeights, build_view_weights
from rgspipe.scene.surfels import Surfels
from rgspipe.training.albedo import AlbedoPrior, AlbedoProblem
from rgspipe.training.albedo_solve import solve_albedo
from rgspipe.training.gloss import GlossScene, fit_gloss
from rgspipe.training.gloss_light import operators_from
from rgspipe.training.lighting import trace_lighting
from rgspipe.training.operator_store import OperatorBytes, OperatorStore
from rgspipe.training.options import MaterialOptions
from rgspipe.training.view_model import build_view_models

#: Rounds of the solve when light does not bounce: only the pixels' weights change.
DIRECT_ROUNDS = 3

#: The prior of surfels as they stand.
PriorOf = Callable[[Surfels], AlbedoPrior]


@dataclass(frozen=True)
class Prepared:
    """What a fit needs of surfels and cameras, whatever the lights are.

    Attributes:
        bvh: the surfels.
        weights: view weights of V views.
        transport: light between the surfels; None if it does not bounce.
        gather: (N, N) which surfels each of them sees; None if it does not bounce.
        store: where the weights are kept.
    """

    bvh: SurfelBvh
    weights: tuple[ViewWeights, ...]
    transport: PatchTransport | None
    gather: SparseOperator | None
    store: OperatorStore


@dataclass(frozen=True)
class FittedMaterials:
    """Fitted materials, and the images that follow.

    Attributes:
        prepared: what was fitted with.
        surfels: with their albedo and, where it pays, gloss.
        radiance: (V, N, 3) radiance towards every view's camera under its light, with direct light at their centres.
        renders: V images (pixels, 3).
        stored: size of the views' operators.
    """

    prepared: Prepared
    surfels: Surfels
    radiance: Tensor
    renders: tuple[Tensor, ...]
    stored: OperatorBytes


def fit_materials(
    surfels: Surfels,
    views: Sequence[View],
    options: MaterialOptions,
    *,
    bounces: bool = True,
    prior: PriorOf | None = None,
    prepared: Prepared | None = None,
) -> FittedMaterials:
    """The albedo that explains `views` best, on surfels that stay where they are.

    Args:
        bounces: whether light goes from surfel to surfel; without, the model is a baseline.
        prior: pulls towards known albedo; it is asked for once the images alone have given one.
        prepared: of an earlier fit of the same surfels and cameras, under other lights.
    """
    prepared = prepared or prepare(surfels, views, options, bounces)
    transport = prepared.transport
    lighting = trace_lighting(prepared.bvh, views)
    store = prepared.store.beside()
    models = build_view_models(prepared.bvh, prepared.weights, lighting, options.at_pixels, store)
    problem = AlbedoProblem.build(surfels, models, views)
    rounds = options.rounds if bounces else min(DIRECT_ROUNDS, options.rounds)
    stored = prepared.store.stored + store.stored
    glossy = None
    if options.gloss == "auto" and transport is not None:
        glossy = GlossScene(
            surfels,
            models,
            lighting,
            operators_from(surfels, prepared.gather, transport),
            transport,
            options.at_pixels,
        )
    if glossy is not None and surfels.gloss is not None:
        known = None if prior is None else prior(surfels)
        fit = fit_gloss(glossy, problem.photographs, surfels, None, rounds, known, options.seed)
        if fit is not None:
            return FittedMaterials(prepared, fit.surfels, fit.radiance, fit.renders, stored)
    surfels, known = replace(surfels, gloss=None), None
    if prior is not None:
        # What the images say alone: maps know albedo only up to a scale.
        surfels = replace(surfels, albedo=solve_albedo(problem, surfels, lighting, transport, rounds)[0])
        known = prior(surfels)
    albedo, indirect = solve_albedo(problem, surfels, lighting, transport, rounds, known)
    surfels = replace(surfels, albedo=albedo)
    if glossy is not None:
        fit = fit_gloss(glossy, problem.photographs, surfels, indirect, rounds, known, options.seed)
        if fit is not None:
            return FittedMaterials(prepared, fit.surfels, fit.radiance, fit.renders, stored)
    renders = tuple(problem.render(v, albedo, indirect) for v in range(len(views)))
    received = lighting.direct() if indirect is None else lighting.direct() + indirect
    return FittedMaterials(prepared, surfels, received * albedo, renders, stored)


def prepare(surfels: Surfels, views: Sequence[View], options: MaterialOptions, bounces: bool = True) -> Prepared:
    """Trace the cameras and, if light bounces, the surfels' view of each other."""
    store = OperatorStore.of(options)
    weights = trace_views(surfels, views, options.supersampling, store)
    frozen = build_frozen(surfels, options) if bounces else None
    light = (None, None) if frozen is None else (frozen.transport, frozen.gather)
    return Prepared(SurfelBvh(surfels), weights, *light, store)


def build_frozen(surfels: Surfels, options: MaterialOptions) -> FrozenScene:
    """Light between the surfels as they stand, without their gloss."""
    return FrozenScene.freeze(
        replace(surfels, gloss=None), gather_rays=options.gather_rays, patches=options.patches, seed=options.seed
    )


def trace_views(
    surfels: Surfels, views: Sequence[View], supersampling: int, store: OperatorStore | None = None
) -> tuple[ViewWeights, ...]:
    """View weights of every view, kept in `store`; in memory by default."""
    keep = (store or OperatorStore()).keep
    each = each_view(surfels, views, supersampling)
    return tuple(replace(weights, operator=keep(weights.operator)) for weights in each)


def each_view(surfels: Surfels, views: Sequence[View], supersampling: int) -> Iterator[ViewWeights]:
    """View weights of one view after the other: for those who look at each once."""
    bvh = SurfelBvh(surfels)
    for view in progress_bar(views, "views", unit="view"):
        yield build_view_weights(bvh, view.camera, supersampling)
