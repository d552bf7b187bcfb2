"""Gloss from images: which surfels have a lobe, how strong and how sharp it is, together with their albedo.

Where a lobe pays is decided by views that it was not fitted to (`gloss_search`). Then come rounds of one Gauss-Newton
step on albedo, specular reflectance and exponent (`gloss_solve`) and of the light that belongs to them (`gloss_light`),
as with albedo alone. Surfels whose lobe comes out faint have none in the end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from rgspipe.progress import progress_bar
from rgspipe.renderer.glossy import phong_lobe
from rgspipe.renderer.transport import PatchTransport, with_albedo
from rgspipe.scene.camera import Camera
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.surfels import Surfels
from rgspipe.training.albedo import ALBEDO_RANGE, AlbedoPrior
from rgspipe.training.gloss_light import GlossBounces, OperatorsOf, highlight_light
from rgspipe.training.gloss_model import GlossLight, GlossView, Reflection, centre_cosines
from rgspipe.training.gloss_search import find_lobes, searched_views
from rgspipe.training.gloss_solve import GlossProblem
from rgspipe.training.lighting import Lighting
from rgspipe.training.mixing import DAMPING, Mixing
from rgspipe.training.photographs import Photographs
from rgspipe.training.view_model import LitViewModel

#: Mean specular reflectance below which a surfel is diffuse.
FAINTEST = 0.02

#: What pixels on edges count for: there surfels of several materials mix.
EDGE_WEIGHT = 0.1


@dataclass(frozen=True)
class GlossScene:
    """Views of a scene with gloss under their own lights.

    Attributes:
        surfels: N surfels; their albedo and gloss are not used.
        models: of V views.
        lighting: of those views.
        operators: of glossy surfels.
        transport: diffuse bounces, of any albedo.
        at_pixels: whether lobes are taken where pixels look, otherwise at surfels' centres.
    """

    surfels: Surfels
    models: Sequence[LitViewModel]
    lighting: Lighting
    operators: OperatorsOf
    transport: PatchTransport
    at_pixels: bool

    @property
    def eyes(self) -> Tensor:
        """(V, 3) float64 cameras."""
        return torch.stack([model.weights.camera.origin for model in self.models])

    def of_views(self, views: Sequence[int]) -> GlossScene:
        """The same with some of the views."""
        return replace(self, models=[self.models[v] for v in views], lighting=self.lighting.of_views(views))

    def highlights(self, chosen: Tensor, received: Tensor | None = None) -> GlossLight:
        """The light of the lamps alone on the surfels `chosen` (G,), and `received` (V, N, 3) on all."""
        return highlight_light(self.surfels, chosen, self.models, self.lighting, received, self.at_pixels)

    def bounces(self, chosen: Tensor) -> GlossBounces:
        """All bounces where the surfels `chosen` (G,) may be glossy."""
        return GlossBounces(self.surfels, chosen, self.operators(chosen))

    def light(self, bounces: GlossBounces, flat: GlossLight, at: Reflection) -> GlossLight:
        """The light if the surfels reflect as `at` says."""
        return bounces.light(at, _of_albedo(self.transport, at.albedo), self.lighting, flat, self.eyes)


@dataclass(frozen=True)
class GlossFit:
    """A reflection and the images that follow.

    Attributes:
        surfels: with albedo and gloss.
        radiance: (V, N, 3) towards each view's own camera, with direct light and lobes at the surfels' centres.
        renders: V images (P, 3).
    """

    surfels: Surfels
    radiance: Tensor
    renders: tuple[Tensor, ...]


def fit_gloss(
    scene: GlossScene,
    photographs: Photographs,
    start: Surfels,
    indirect: Tensor | None,
    rounds: int,
    prior: AlbedoPrior | None,
    seed: int,
) -> GlossFit | None:
    """Albedo and gloss that explain the images best; None if no lobe pays.

    Args:
        photographs: of the scene's views.
        start: the surfels with albedo and, if lobes have been found before, gloss.
        indirect: (V, N, 3) light from other surfels over π without gloss; only where lobes are searched for.
        rounds: of a step and the light that belongs to it.
        prior: pulls towards known albedo.
        seed: of the patches that are searched.
    """
    edges = [model.weights.edges for model in scene.models]
    trust = [share * torch.where(edge, EDGE_WEIGHT, 1.0) for share, edge in zip(photographs.trust, edges, strict=True)]
    photographs = replace(photographs, trust=trust)
    if start.gloss is None:
        chosen, logs = _found(scene, photographs, start, indirect, seed)
        at = Reflection(start.albedo.float(), logs.new_zeros(len(chosen), 3), logs)
    else:
        chosen, at = reflection_of(start)
    if len(chosen) == 0:
        return None
    glossy = GlossProblem.build(start, scene.models, photographs.images, chosen, prior)
    solved = _solve(scene, glossy, at, photographs, rounds)
    surfels = _without_faint(replace(start, albedo=solved.albedo), chosen, solved)
    return render_gloss(scene, surfels) if len(surfels.gloss.glossy) else None


def _found(
    scene: GlossScene,
    photographs: Photographs,
    surfels: Surfels,
    indirect: Tensor | None,
    seed: int,
) -> tuple[Tensor, Tensor]:
    """`find_lobes` by some of the views."""
    views = searched_views(len(scene.models))
    everywhere = torch.arange(len(surfels), device=surfels.centers.device)
    some, images, weights = scene.of_views(views), photographs.images, photographs.weights()
    light = some.highlights(everywhere, None if indirect is None else indirect[views])
    whole = GlossProblem.build(surfels, some.models, [images[v] for v in views], everywhere)
    return find_lobes(surfels, whole, light, [weights[v] for v in views], seed)


def render_gloss(scene: GlossScene, surfels: Surfels) -> GlossFit:
    """Images of surfels with at least one lobe, and their radiance."""
    chosen, at = reflection_of(surfels)
    light = scene.light(scene.bounces(chosen), scene.highlights(chosen), at)
    renders = tuple(GlossView.of(model, light, v, at).image(at) for v, model in enumerate(scene.models))
    return GlossFit(surfels, _radiance(surfels, scene.lighting, scene.eyes, light, at), renders)


def reflection_of(surfels: Surfels) -> tuple[Tensor, Reflection]:
    """The glossy surfels (G,), and what all of them reflect."""
    chosen = surfels.gloss.glossy
    gloss = surfels.gloss.to(torch.float32)
    return chosen, Reflection(surfels.albedo.float(), gloss.reflectance[chosen], gloss.exponents[chosen].log())


def _solve(
    scene: GlossScene,
    problem: GlossProblem,
    at: Reflection,
    photographs: Photographs,
    rounds: int,
) -> Reflection:
    flat, bounces, mixing = scene.highlights(problem.chosen), scene.bounces(problem.chosen), Mixing(DAMPING)
    known, unjudged = bool((at.specular > 0.0).any()), photographs.weights()
    for index in progress_bar(range(rounds), "gloss", unit="round"):
        light = scene.light(bounces, flat, at)
        weights = unjudged
        if known or index > 1:
            # Not before lobes stand: without them highlights are what fits badly.
            weights = photographs.robust_weights(problem.images_of(light, at))
        found = problem.step(light, at, weights, exponents=known or index > 0)
        albedo = mixing.next(at.albedo, found.albedo).clamp(*ALBEDO_RANGE)
        specular = torch.minimum(found.specular, 1.0 - albedo[problem.chosen])
        at = Reflection(albedo, specular, found.log_exponents)
    return at


def _without_faint(surfels: Surfels, chosen: Tensor, at: Reflection) -> Surfels:
    bright = (at.specular.mean(dim=1) >= FAINTEST)[:, None]
    specular = torch.where(bright, at.specular, torch.zeros_like(at.specular))
    reflectance = specular.new_zeros(len(surfels), 3).index_copy(0, chosen, specular)
    exponents = specular.new_ones(len(surfels)).index_copy(0, chosen, at.log_exponents.exp().clamp(min=1.0))
    return replace(surfels, gloss=Gloss(reflectance, exponents))


def gloss_radiance(
    surfels: Surfels, lighting: Lighting, cameras: Sequence[Camera], operators: OperatorsOf, transport: PatchTransport
) -> Tensor:
    """(V, N, 3) radiance of surfels with at least one lobe towards each view's own camera, at their centres.

    Args:
        lighting: of V views.
        operators, transport: see `GlossScene`.
    """
    chosen, at = reflection_of(surfels)
    eyes, flat = torch.stack([camera.origin for camera in cameras]), GlossLight(chosen, (), None, None)
    bounces = GlossBounces(surfels, chosen, operators(chosen))
    light = bounces.light(at, _of_albedo(transport, at.albedo), lighting, flat, eyes)
    return _radiance(surfels, lighting, eyes, light, at)


def _of_albedo(transport: PatchTransport, albedo: Tensor) -> PatchTransport:
    return transport if torch.equal(transport.albedo, albedo) else with_albedo(transport, albedo)


def _radiance(surfels: Surfels, lighting: Lighting, eyes: Tensor, light: GlossLight, at: Reflection) -> Tensor:
    """(V, N, 3) radiance towards each view's own camera, at the surfels' centres."""
    direct, chosen = lighting.direct(), light.chosen
    cosines = centre_cosines(surfels, chosen, lighting.positions, eyes)
    total = at.albedo * (direct + light.received)
    lobes = math.pi * phong_lobe(cosines, at.log_exponents.exp())
    for v in range(len(eyes)):
        own = at.specular * (lobes[v][:, None] * direct[v, chosen] + light.reflected(v, at.log_exponents)[0])
        total[v].index_add_(0, chosen, own)
    return total
