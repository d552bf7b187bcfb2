"""Images of a frozen scene that follow a lamp: whatever did not change since the last one is kept."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from functools import cached_property, partial
from typing import Literal

import torch
from torch import Tensor

from rgspipe.renderer.ambient import ambient_radiance, lets_light_in
from rgspipe.renderer.effects import ALL_EFFECTS
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.model import Lit, SurfelModel, ViewModel
from rgspipe.renderer.images.pixels import PixelModel
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.rig import rig_irradiance
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, LightRig
from rgspipe.scene.lights import Light
from rgspipe.viewer.kept import Kept

#: How an image is made. `coarse`: soft, a ray a pixel; `soft`: direct light at surfels' centres; `sharp`: where pixels
#: look, as `FrozenScene.render` and the stage relight have it.
Quality = Literal["coarse", "soft", "sharp"]

#: Pixels of single lamps' images that are kept, 12 bytes each: 200 MB. Pixels of views, some 200 bytes each (measured
#: at 512²): 400 MB. Lamps whose light on the surfels is kept, 12 bytes a surfel.
IMAGE_PIXELS, VIEW_PIXELS, LIT = 2**24, 2**21, 16

#: Names what comes from all around, among lamps.
VOID = "void"

#: Of an albedo below this the radiance does not tell what arrives.
BLACK = 1e-3


class LampImages:
    """Images of a scene, each a sum over lamps, and over what comes from all around through openings.

    An image is linear in every lamp's intensity: with U_l what a camera sees of lamp l at 1 W/sr, it is Σ_l I_l U_l. So
    a change of colour or power renders nothing, and of several lamps only the one that moves is rendered. What a lamp
    makes of the surfels is the same from everywhere, so that a camera that moves is only traced.

    Methods take `ambient`, the radiance (3,) that comes from all around; None for black.

    Args:
        frozen: the scene.
    """

    def __init__(self, frozen: FrozenScene) -> None:
        self.frozen = frozen
        self._units: Kept[Tensor] = Kept(IMAGE_PIXELS, lambda image: image[..., 0].numel())
        self._weights: Kept[ViewWeights] = Kept(VIEW_PIXELS, lambda view: view.camera.pixel_count)
        self._models: Kept[ViewModel] = Kept(VIEW_PIXELS, lambda model: len(model.views.pixels))
        self._lit: Kept[Lit] = Kept(LIT)
        self._onto: Kept[Tensor] = Kept(LIT)

    def knows(self, camera: Camera) -> bool:
        """Whether the camera was traced already for images that are not coarse."""
        return (camera.key, False) in self._weights

    def image(self, camera: Camera, rig: LightRig, quality: Quality = "sharp", ambient: Tensor | None = None) -> Tensor:
        """(H, W, 3) linear radiance, black without any light."""
        image = torch.zeros(camera.height, camera.width, 3)
        for light in rig:
            image += light.intensity.float() * self._unit_image(camera, light, quality)
        if ambient is not None and self._void_lit is not None:
            image += ambient.to(image) * self._view(camera, quality == "coarse").image(self._void_lit).cpu()
        return image

    def irradiance(
        self, camera: Camera, rig: LightRig, quality: Quality = "soft", ambient: Tensor | None = None
    ) -> Tensor:
        """(H, W, 3) what arrives on the surfaces that a camera sees, with all bounces, W per square scene unit.

        The radiance of diffuse surfels times π over their albedo, or what arrives on those that are black; 0 where
        there is no surface.
        """
        model, albedo = self._model(camera, "coarse" if quality == "coarse" else "soft"), self.frozen.surfels.albedo
        arriving = torch.zeros_like(albedo)
        for light in rig:
            white = _white(light)
            direct = partial(rig_irradiance, self.frozen.bvh, (white,))
            arriving += light.intensity.to(albedo) * self._arriving(_told(white), self._lit_by(model, white), direct)
        if ambient is not None and self._void_lit is not None:
            arriving += ambient.to(albedo) * self._arriving(VOID, self._void_lit, self._direct_void)
        return (model.views.operator @ arriving).reshape(camera.height, camera.width, 3).cpu()

    @cached_property
    def lets_light_in(self) -> bool:
        """Whether anything from outside reaches the scene."""
        with torch.no_grad():
            return lets_light_in(self.frozen)

    @cached_property
    def _void_lit(self) -> Tensor | None:
        """(N, 3) radiance under a void of radiance 1; None in a closed scene."""
        with torch.no_grad():
            return ambient_radiance(self.frozen)

    def _direct_void(self) -> Tensor:
        return self.frozen.void_irradiance[:, None].expand(-1, 3)

    def _arriving(self, source: Hashable, lit: Lit, direct: Callable[[], Tensor]) -> Tensor:
        """(N, 3) irradiance of the surfels that a source has `lit`, whose own light on them is `direct`."""
        albedo = self.frozen.surfels.albedo
        arriving = (lit if isinstance(lit, Tensor) else lit.radiance) * math.pi / albedo.clamp(min=BLACK)
        black = albedo < BLACK
        if not bool(black.any()):
            return arriving
        return torch.where(black, self._onto.get(source, lambda: self._gathered(lit, direct)), arriving)

    def _gathered(self, lit: Lit, direct: Callable[[], Tensor]) -> Tensor:
        """(N, 3) the same before any of it is reflected: from the source, and from other surfels."""
        transport = self.frozen.transport
        with torch.no_grad():
            first = direct()
            sent = (self.frozen.surfels.albedo * first / math.pi)[..., None]
            if isinstance(lit, Tensor):
                received = transport.gathered(sent)
            else:
                highlights = lit.transport.highlights(lit.towards, lit.irradiance).sum(dim=0)[..., None]
                received, _ = lit.transport.received(transport, sent, highlights)
            return first + math.pi * received[..., 0]

    def _unit_image(self, camera: Camera, light: Light, quality: Quality) -> Tensor:
        white = _white(light)
        return self._units.get((camera.key, quality, _told(white)), lambda: self._rendered(camera, white, quality))

    def _rendered(self, camera: Camera, light: Light, quality: Quality) -> Tensor:
        model = self._model(camera, quality)
        soft = isinstance(model, SurfelModel)
        image = model.seen(self._lit_by(model, light)) if soft else model.image((light,))
        return model.views.split(image)[0].detach().cpu()

    def _lit_by(self, model: SurfelModel, light: Light) -> Lit:
        with torch.no_grad():
            return self._lit.get(_told(light), lambda: model.lit((light,)))

    def _model(self, camera: Camera, quality: Quality) -> ViewModel:
        return self._models.get((camera.key, quality), lambda: self._made(camera, quality))

    def _made(self, camera: Camera, quality: Quality) -> ViewModel:
        views = ViewedPixels.every(self.frozen, [self._view(camera, quality == "coarse")])
        return (PixelModel if quality == "sharp" else SurfelModel).of(views, ALL_EFFECTS)

    def _view(self, camera: Camera, coarse: bool) -> ViewWeights:
        rays = {"supersampling": 1} if coarse else {}
        return self._weights.get((camera.key, coarse), lambda: self.frozen.view(camera, **rays))


def _white(light: Light) -> Light:
    """The lamp at 1 W/sr."""
    return light.at(light.position, None, torch.ones(3, dtype=torch.float64))


def _told(light: Light) -> Hashable:
    """Equal for lights that shine alike."""
    return light.kind, tuple(light.position.tolist()), repr(light.file_fields())
