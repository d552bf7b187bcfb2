"""The entry to all fits: images of a frozen scene in, lights out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import get_args

import torch
from torch import Tensor

from rgspipe.fitting.baselines.paper_adam import fit_paper_adam
from rgspipe.fitting.baselines.paper_adam_start import LightPrior
from rgspipe.fitting.findings import ExposureUnknown
from rgspipe.fitting.model.blocks import BlockModel, block_model
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.model.gloss import bounced_light
from rgspipe.fitting.model.problem import Effects, LightProblem
from rgspipe.fitting.model.views import PreparedViews, prepare_views
from rgspipe.fitting.options import AdamOptions, Method, SearchOptions
from rgspipe.fitting.result import FitResult
from rgspipe.fitting.search.aimed_candidates import aimed_candidates
from rgspipe.fitting.search.coarse import CoarseImages, coarse_images
from rgspipe.fitting.search_lm import fit_search_lm
from rgspipe.fitting.spec import LightSpec
from rgspipe.renderer.dictionary import LightDictionary
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.pixel_direct import surfel_shares
from rgspipe.renderer.rig import unit_response
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, Light, LightRig, PointLight


@dataclass(frozen=True)
class FitViews:
    """Views made ready for any number of targets that the same cameras see.

    Attributes:
        prepared: the pixels and their weights.
        coarse: images of the dictionary's candidates, per kind of light; none where only `paper_adam` is used.
        effects: parts of light transport.
        blocks: the views as blocks of pixels, which searches look at; None where `coarse` is empty.
    """

    prepared: PreparedViews
    coarse: tuple[CoarseImages, ...]
    effects: Effects
    blocks: BlockModel | None = None


def prepare_fit(
    frozen: FrozenScene,
    views: Sequence[ViewWeights | Camera],
    *,
    masks: Sequence[Tensor] | None = None,
    mask_edges: bool = True,
    dictionary: LightDictionary | None = None,
    effects: Effects | None = None,
    spec: LightSpec | None = None,
) -> FitViews:
    """What all targets of one set of cameras share; see `fit_lights` for the arguments."""
    effects = effects or Effects()
    weights = [frozen.view(view) if isinstance(view, Camera) else view for view in views]
    prepared = prepare_views(frozen, weights, masks=masks, mask_edges=mask_edges, at_pixels=effects.at_pixels)
    if dictionary is None:
        return FitViews(prepared, (), effects)
    blocks = block_model(prepared, interreflection=effects.interreflection)
    return FitViews(prepared, _candidates(prepared, blocks, dictionary, effects, spec or LightSpec()), effects, blocks)


def _candidates(
    prepared: PreparedViews, blocks: BlockModel, dictionary: LightDictionary, effects: Effects, spec: LightSpec
) -> tuple[CoarseImages, ...]:
    """Candidates of each kind of light that is looked for, the plainest first."""

    def of(kind: Light) -> CoarseImages:
        if kind.axis is None:
            return coarse_images(prepared.frozen, blocks, dictionary)
        shapes = kind.variants() if spec.shape_free else (kind,)
        return aimed_candidates(prepared, dictionary, shapes, interreflection=effects.interreflection)

    return tuple(map(of, spec.kinds))


def fit_lights(
    frozen: FrozenScene,
    views: FitViews | Sequence[ViewWeights | Camera],
    images: Sequence[Tensor],
    *,
    method: Method = "search_lm",
    masks: Sequence[Tensor] | None = None,
    mask_edges: bool = True,
    dictionary: LightDictionary | None = None,
    effects: Effects | None = None,
    search: SearchOptions | None = None,
    adam: AdamOptions | None = None,
    training_lights: Sequence[PointLight] = (),
    seed: int = 0,
    spec: LightSpec | None = None,
    capture: ImageCapture | None = None,
) -> FitResult:
    """Recover the lights of images of a frozen scene.

    Args:
        frozen: the scene.
        views: the images' cameras, or their weights; or what `prepare_fit` made of them for the same `spec`, and then
            `masks`, `mask_edges`, `dictionary` and `effects` are those that it was given.
        images: (H, W, 3) linear radiance per view, premultiplied by alpha.
        method: "search_lm", "paper_adam", or "finite_differences": search_lm with derivatives by central differences.
        masks: (H, W) per view, the scene's share of each pixel (the image's alpha); 1 if None.
        mask_edges: whether `search_lm` leaves out pixels on silhouettes, creases and depth jumps.
        dictionary: candidates for `search_lm`; the scene's own if None.
        effects: parts of light transport; all if None.
        search, adam: settings of the methods.
        training_lights: lights of known images, where `paper_adam` starts from.
        seed: of every draw; the same seed gives the same result.
        spec: what is known of the lights: type, number, spots' profile; one point light if None.
        capture: what is known of how the images were taken; as radiance, with known exposures, if None.

    Returns:
        The lights, why the fit stopped, and how it got there. A target that is black gives a result without
        lights, not an error.

    Raises:
        InputError: images or masks do not fit the views, are not finite, or leave no pixel.
        ValueError: an unknown method; with `paper_adam` free exposures, clipped images, or lights whose type, number
            or cone is not known.
    """
    if method not in get_args(Method):
        raise ValueError(f"method must be one of {get_args(Method)}, got {method!r}")
    if not isinstance(views, FitViews):
        if method != "paper_adam" and dictionary is None:
            shaded = (effects or Effects()).shadows
            dictionary = (frozen if shaded else frozen.with_dictionary(shadows=False)).dictionary
        views = prepare_fit(
            frozen, views, masks=masks, mask_edges=mask_edges, dictionary=dictionary, effects=effects, spec=spec
        )
    stacked = views.prepared.stack_images(images)
    capture = capture or ImageCapture()
    problem = LightProblem.create(views.prepared, stacked, views.effects, capture)
    if method == "paper_adam":
        if capture != ImageCapture():
            raise ValueError("paper_adam takes images as radiance with known exposures: use search_lm")
        prior = LightPrior.of(training_lights)
        return fit_paper_adam(problem, stacked, adam or AdamOptions(), prior, seed, spec)
    if not views.coarse:
        raise ValueError(f"{method} needs a dictionary: pass one to prepare_fit")
    problem = replace(problem, differences=method == "finite_differences")
    result = fit_search_lm(problem, views.coarse, search or SearchOptions(), spec, views.blocks)
    if capture.exposure_free and len(views.prepared.views) == 1:
        return replace(result, findings=(*result.findings, ExposureUnknown()))
    return result


def render_light(views: FitViews, light: Light | None) -> list[Tensor]:
    """`render_rig` of one light, or of none."""
    return render_rig(views, () if light is None else (light,))


def render_rig(views: FitViews, rig: LightRig) -> list[Tensor]:
    """(H, W, 3) image per view of the scene under `rig`, with the fit's effects; black without lights."""
    prepared, effects = views.prepared, views.effects
    if rig and prepared.frozen.gloss is not None:
        return _render_with_gloss(views, rig)
    operator, frozen = prepared.all_pixels, prepared.frozen
    stacked = torch.zeros((operator.shape[0], 3), device=operator.matrix.device)
    if rig:
        indirect = effects.interreflection
        irradiance = unit_response(frozen.bvh, rig, effects.shadows).irradiance.T
        strength = torch.stack([light.intensity for light in rig]).to(irradiance)
        radiance = frozen.radiance(irradiance, indirect)
        if prepared.pixel_direct:
            radiance = radiance - frozen.radiance(irradiance, indirect=False)
            stacked = sum(_direct_at_pixels(views, light) * light.intensity.to(stacked) for light in rig)
        stacked = stacked + operator @ torch.einsum("ncl,lc->nc", radiance, strength)
    return prepared.split_images(stacked)


def _render_with_gloss(views: FitViews, rig: LightRig) -> list[Tensor]:
    """`render_rig` of a scene with gloss."""
    prepared, effects = views.prepared, views.effects
    frozen = prepared.frozen
    if not prepared.pixel_direct:
        return [frozen.render(view, rig, effects.interreflection, effects.shadows) for view in prepared.views]
    images = prepared.split_images(sum(_direct_at_pixels(views, light) * light.intensity.float() for light in rig))
    if effects.interreflection:
        light = bounced_light(frozen, rig, effects.shadows)
        bounced = [view.image(light.seen_from(view.camera.origin)) for view in prepared.views]
        images = [direct + others for direct, others in zip(images, bounced, strict=True)]
    return images


def _direct_at_pixels(views: FitViews, light: Light) -> Tensor:
    """(all pixels, 3) direct image of a light of unit intensity, where pixels look."""
    prepared, position = views.prepared, light.position
    shares = surfel_shares(prepared.frozen.bvh, position, views.effects.shadows)
    image = torch.cat([one.image(position, *shares)[:, :, 0] for one in prepared.pixel_direct])
    if prepared.highlights:
        image = image + torch.cat([one.image(position, *shares)[:, :, 0] for one in prepared.highlights])
    share = light.share(prepared.all_points)
    return image if share is None else image * share.value[:, None]
