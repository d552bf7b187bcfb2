"""Images of a frozen scene that follow a lamp: whatever did not change since the last one is kept."""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import Literal

import torch
from torch import Tensor

from rgspipe.renderer.ambient import ambient_image
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

#: Of an albedo below this the radiance does not tell what arrives.
BLACK = 1e-3


class LampImages:
    """Images of a scene, each a sum over lamps.

    An image is linear in every lamp's intensity: with U_l what a camera sees of lamp l at 1 W/sr, it is Σ_l I_l U_l. So
    a change of colour or power renders nothing, and of several lamps only the one that moves is rendered. What a lamp
    makes of the surfels is the same from everywhere, so that a camera that moves is only traced.

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
        self._ambient: Kept[Tensor] = Kept(LIT)

    def knows(self, camera: Camera) -> bool:
        """Whether the camera was traced already for images that are not coarse."""
        return (camera.key, False) in self._weights

    def image(self, camera: Camera, rig: LightRig, quality: Quality = "sharp") -> Tensor:
        """(H, W, 3) linear radiance under `rig`, black without lamps."""
        image = torch.zeros(camera.height, camera.width, 3)
        for light in rig:
            image += light.intensity.float() * self._unit_image(camera, light, quality)
        return image

    def irradiance(self, camera: Camera, rig: LightRig, quality: Quality = "soft") -> Tensor:
        """(H, W, 3) what arrives on the surfaces that a camera sees, with all bounces, W per square scene unit.

        The radiance of diffuse surfels times π over their albedo, or what arrives on those that are black; 0 where
        there is no surface.
        """
        model, albedo = self._model(camera, "coarse" if quality == "coarse" else "soft"), self.frozen.surfels.albedo
        arriving = torch.zeros_like(albedo)
        for light in rig:
            arriving += light.intensity.to(albedo) * self._arriving(self._lit_by(model, _white(light)), _white(light))
        return (model.views.operator @ arriving).reshape(camera.height, camera.width, 3).cpu()

    def ambient(self, camera: Camera) -> Tensor:
        """(H, W, 3) what a camera sees under radiance 1 from all around, through openings; black in a closed scene."""
        return self._ambient.get(camera.key, lambda: ambient_image(self.frozen, self._view(camera, False)).cpu())

    def _arriving(self, lit: Lit, light: Light) -> Tensor:
        """(N, 3) irradiance of the surfels that a lamp has `lit`."""
        albedo = self.frozen.surfels.albedo
        arriving = (lit if isinstance(lit, Tensor) else lit.radiance) * math.pi / albedo.clamp(min=BLACK)
        black = albedo < BLACK
        if not bool(black.any()):
            return arriving
        return torch.where(black, self._onto.get(_told(light), lambda: self._gathered(lit, light)), arriving)

    def _gathered(self, lit: Lit, light: Light) -> Tensor:
        """(N, 3) the same before any of it is reflected: from the lamp, and from other surfels."""
        transport = self.frozen.transport
        with torch.no_grad():
            direct = rig_irradiance(self.frozen.bvh, (light,))
            sent = (self.frozen.surfels.albedo * direct / math.pi)[..., None]
            if isinstance(lit, Tensor):
                received = transport.gathered(sent)
            else:
                highlights = lit.transport.highlights(lit.towards, lit.irradiance).sum(dim=0)[..., None]
                received, _ = lit.transport.received(transport, sent, highlights)
            return direct + math.pi * received[..., 0]

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
