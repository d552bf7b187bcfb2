"""Views made ready for any number of targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import torch
from torch import Tensor

from rgspipe.arguments import as_one_of, as_several
from rgspipe.errors import InputError
from rgspipe.fitting.in_sight.sight import Sight, sights
from rgspipe.fitting.model.capture import ImageCapture
from rgspipe.fitting.model.problem import LightProblem
from rgspipe.fitting.model.views import PreparedViews, prepare_views
from rgspipe.fitting.options import AimedOptions, LossOptions
from rgspipe.fitting.result import FitResult
from rgspipe.fitting.search.aimed_candidates import aimed_candidates
from rgspipe.fitting.search.coarse import CoarseImages, coarse_images
from rgspipe.fitting.search.distant_candidates import distant_candidates
from rgspipe.fitting.spec import LightSpec, as_spec
from rgspipe.renderer.ambient import ambient_radiance
from rgspipe.renderer.dictionary import LightDictionary
from rgspipe.renderer.effects import ALL_EFFECTS, Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.blocks import BlockModel, block_model
from rgspipe.renderer.images.model import SurfelModel, ViewModel
from rgspipe.renderer.images.pixels import PixelModel
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, Light
from rgspipe.scene.arrays import ArrayLike, as_list
from rgspipe.scene.lights import as_rig
from rgspipe.scene.shapes import Float

Cameras = Camera | ViewWeights | Sequence[Camera | ViewWeights]


@dataclass(frozen=True)
class TargetViews:
    """Views made ready for any number of targets that the same cameras see, and of whose lights the same is known.

    Attributes:
        prepared: the pixels that a fit trusts, and their weights.
        lights: what is known of the lights.
        effects: parts of light transport.
        sharp: whether the last steps of a fit, and the images of its lights, take direct light where pixels look.
        whole: the views of which these leave pixels out; None if they do not.
        places: (K, 3) float32 where a search begins, too, besides the scene's candidates; None for these alone.
    """

    prepared: PreparedViews
    lights: LightSpec
    effects: Effects
    sharp: bool = True
    whole: TargetViews | None = None
    places: Tensor | None = None

    @classmethod
    def prepare(
        cls,
        scene: FrozenScene,
        cameras: Cameras,
        *,
        lights: str | LightSpec = "point",
        masks: Sequence[ArrayLike] | ArrayLike | None = None,
        effects: Effects = ALL_EFFECTS,
        sharp: bool = True,
        mask_edges: bool = True,
    ) -> Self:
        """What all targets of one set of cameras share; see `fit_lights` for the arguments.

        Raises:
            InputError: no scene or no camera; masks do not fit the cameras, or leave no pixel; or a kind of light that
                is not known.
        """
        weights = _weights(scene, cameras)
        as_one_of(effects, Effects, "effects", "Pass Effects(…).")
        masks = None if masks is None else as_list(masks, axes=2)
        prepared = prepare_views(scene, weights, masks=masks, mask_edges=mask_edges)
        return cls(prepared, as_spec(lights), effects, sharp)

    def without(self, pixels: Sequence[ArrayLike], places: Tensor | None = None) -> Self:
        """The same views less `pixels` (H, W) bool, one mask a view, searched from `places` (K, 3), too.

        Raises:
            InputError: too few pixels are left.
        """
        return replace(self, prepared=self.prepared.without(pixels), whole=self, places=places)

    @cached_property
    def sights(self) -> tuple[Sight, ...]:
        """What the pixels look at."""
        return sights(self.prepared)

    @cached_property
    def dictionary(self) -> LightDictionary:
        """The candidates that a search begins with: the scene's own, and those of `places`."""
        frozen, shadows = self.prepared.frozen, self.effects.shadows
        own = frozen.candidates_with(shadows)
        return own if self.places is None else own.joined(frozen.bvh, self.places, shadows)

    @cached_property
    def blocks(self) -> BlockModel:
        """The views as blocks of pixels, which searches look at."""
        return block_model(self.prepared, effects=self.effects)

    def coarse(self, options: AimedOptions) -> tuple[CoarseImages, ...]:
        """Images of the candidates of each kind of light that is looked for, the plainest first; made once."""
        if options not in self._coarse_made:
            self._coarse_made[options] = tuple(self._coarse(kind, options) for kind in self.lights.seed.kinds)
        return self._coarse_made[options]

    @cached_property
    def _coarse_made(self) -> dict[AimedOptions, tuple[CoarseImages, ...]]:
        return {}

    def _coarse(self, kind: Light, options: AimedOptions) -> CoarseImages:
        if kind.distant:
            return distant_candidates(self.blocks, kind, options.directions)
        if kind.axis is None:
            return coarse_images(self.blocks, self.dictionary)
        shapes = kind.variants() if self.lights.seed.free(kind) else (kind,)
        return aimed_candidates(self.prepared, self.dictionary, shapes, options, self.effects)

    @cached_property
    def pixels(self) -> PixelModel:
        """How the trusted pixels see lights where they look."""
        return PixelModel.of(self.prepared, self.effects) if self.whole is None else self.whole.pixels.on(self.prepared)

    @cached_property
    def images(self) -> ViewModel:
        """How all pixels see lights."""
        model = self.pixels if self.sharp else SurfelModel(self.prepared, self.effects)
        return model.on(self.prepared.every_pixel)

    def problem(
        self, stacked: Tensor, capture: ImageCapture | None = None, loss: LossOptions | None = None
    ) -> LightProblem:
        """The problem that images stacked by `PreparedViews.stack_images`, (all pixels, 3), pose."""
        sharp = self.pixels if self.sharp else None
        return LightProblem.create(self.prepared, stacked, self.effects, capture, sharp, loss, self.ambient)

    @cached_property
    def ambient(self) -> Tensor | None:
        """(N, 3) radiance of the surfels under a void of radiance 1; None where none is looked for or arrives."""
        if not self.lights.ambient:
            return None
        return ambient_radiance(self.prepared.frozen, self.effects.interreflection)

    def there_anyway(self, result: FitResult, capture: ImageCapture | None = None) -> list[Float[Tensor, "H W 3"]]:
        """(H, W, 3) per view of what a fit found in its images besides the lights, in the exposure of each view.

        Empty where nothing else was looked for or given.
        """
        prepared, base = self.prepared, None if capture is None else capture.base
        if base is None and result.ambient is None:
            return []
        image = torch.zeros((prepared.every_pixel.operator.shape[0], 3), device=prepared.frozen.device)
        if result.ambient is not None and self.ambient is not None:
            exposures = torch.tensor(result.exposures or [1.0] * len(prepared.views))
            exposures = exposures.to(image)[prepared.every_pixel.view_of]
            sent = self.ambient * result.ambient.value.to(self.ambient)
            image = exposures[:, None] * (prepared.every_pixel.operator @ sent)
        if base is not None:
            factor = 1.0 if result.base_scale is None else result.base_scale.value.to(image)
            image = image + factor * prepared.stack_images(base.images, "base")
        return prepared.split(image)

    def render(self, lights: Light | Sequence[Light]) -> list[Float[Tensor, "H W 3"]]:
        """(H, W, 3) image per view of the scene under lights, with the fit's effects; black without any."""
        return self.prepared.split(self.images.image(as_rig(lights)))


def _weights(scene: FrozenScene, cameras: Cameras) -> list[ViewWeights]:
    """Of each camera."""
    if not isinstance(scene, FrozenScene):
        remedy = "FrozenScene.load(folder) reads one, FrozenScene.freeze(surfels) makes one."
        raise InputError("scene", expected="a FrozenScene", found=type(scene).__name__, remedy=remedy)
    remedy = "Camera.look_at makes one, and a View has its own: view.camera."
    views = as_several(cameras, (Camera, ViewWeights), "cameras", remedy)
    weights = [scene.view(view) if isinstance(view, Camera) else view for view in views]
    own = len(scene.surfels)
    for index, view in enumerate(weights):
        if (found := view.operator.shape[1]) != own:
            expected, remedy = f"a view of this scene, of {own} surfels", "Pass its camera, or scene.view(camera)."
            raise InputError(f"cameras[{index}]", expected=expected, found=f"one of {found}", remedy=remedy)
    return weights
