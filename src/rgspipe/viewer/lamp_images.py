"""Images of a frozen scene that follow a lamp: whatever did not change since the last one is kept."""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import Literal

import torch
from torch import Tensor

from rgspipe.renderer.effects import ALL_EFFECTS
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.model import SurfelModel, ViewModel
from rgspipe.renderer.images.pixels import PixelModel
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, LightRig
from rgspipe.scene.lights import Light
from rgspipe.viewer.kept import Kept

#: How an image is made. `coarse`: soft, a ray a pixel; `soft`: direct light at surfels' centres; `sharp`: where pixels
#: look, as `FrozenScene.render` and the stage relight have it.
Quality = Literal["coarse", "soft", "sharp"]

#: Images of single lamps, and views, that are kept.
KEPT_LAMPS, KEPT_VIEWS = 64, 6


class LampImages:
    """Images of a scene, each a sum over lamps.

    An image is linear in every lamp's intensity: with U_l what a camera sees of lamp l at 1 W/sr, it is Σ_l I_l U_l. So
    a change of colour or power renders nothing, and of several lamps only the one that moves is rendered.

    Args:
        frozen: the scene.
    """

    def __init__(self, frozen: FrozenScene) -> None:
        self.frozen = frozen
        self._units, self._weights, self._models = Kept(KEPT_LAMPS), Kept(KEPT_VIEWS), Kept(KEPT_VIEWS)

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

        The radiance of diffuse surfels times π over their albedo; 0 where there is no surface.
        """
        view, surfels = self._view(camera, quality == "coarse"), self.frozen.surfels
        arriving = torch.zeros_like(surfels.albedo)
        if rig:
            arriving = self.frozen.radiance_of(rig).detach() * math.pi / surfels.albedo.clamp(min=1e-3)
        return (view.operator @ arriving.float()).reshape(camera.height, camera.width, 3).cpu()

    def _unit_image(self, camera: Camera, light: Light, quality: Quality) -> Tensor:
        white = light.at(light.position, None, torch.ones(3, dtype=torch.float64))
        return self._units.get((camera.key, quality, _told(white)), lambda: self._rendered(camera, white, quality))

    def _rendered(self, camera: Camera, light: Light, quality: Quality) -> Tensor:
        model = self._models.get((camera.key, quality), lambda: self._model(camera, quality))
        return model.views.split(model.image((light,)))[0].detach().cpu()

    def _model(self, camera: Camera, quality: Quality) -> ViewModel:
        views = ViewedPixels.every(self.frozen, [self._view(camera, quality == "coarse")])
        return (PixelModel if quality == "sharp" else SurfelModel).of(views, ALL_EFFECTS)

    def _view(self, camera: Camera, coarse: bool) -> ViewWeights:
        rays = {"supersampling": 1} if coarse else {}
        return self._weights.get((camera.key, coarse), lambda: self.frozen.view(camera, **rays))


def _told(light: Light) -> Hashable:
    """Equal for lights that shine alike."""
    return light.kind, tuple(light.position.tolist()), repr(light.file_fields())
