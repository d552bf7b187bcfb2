"""Light that is there anyway: what comes from a void of one radiance all around, through openings, and bounces."""

from __future__ import annotations

import torch
from torch import Tensor

from rgspipe.arguments import as_one_of
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.openness import rough_void_irradiance
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera
from rgspipe.scene.shapes import Float

#: Scenes whose surfels see less of the void than this, on the average, are closed: what gets in leaks past surfaces.
#: Closed rooms of exact surfels see 5e-6 of it, measured.
LEAST_OPEN = 1e-3


def ambient_radiance(frozen: FrozenScene, interreflection: bool = True) -> Float[Tensor, "N 3"] | None:
    """(N, 3) outgoing radiance under a void of radiance 1; None in a closed scene, where nothing of it arrives.

    Gloss reflects none of it: surfels are as if they were diffuse.
    """
    return _reflected(frozen, frozen.void_irradiance, interreflection)


def rough_ambient_radiance(frozen: FrozenScene, interreflection: bool = True) -> Float[Tensor, "N 3"] | None:
    """`ambient_radiance` without a ray, from what the scene's own operators know of its openings."""
    return _reflected(frozen, rough_void_irradiance(frozen.transport), interreflection)


def ambient_image(frozen: FrozenScene, camera: Camera | ViewWeights) -> Float[Tensor, "H W 3"]:
    """(height, width, 3) what a camera sees of the scene under a void of radiance 1, black for a closed scene.

    Light adds up: `scene.render(camera, lights) + radiance * ambient_image(scene, camera)`. The void itself is not in
    it, as it is in no image of a frozen scene.
    """
    as_one_of(frozen, FrozenScene, "scene", "FrozenScene.load(folder) reads one.")
    view = camera if isinstance(camera, ViewWeights) else frozen.view(camera)
    radiance = ambient_radiance(frozen)
    return view.image(torch.zeros_like(frozen.surfels.albedo) if radiance is None else radiance)


def lets_light_in(frozen: FrozenScene) -> bool:
    """Whether anything arrives from outside; rays are cast only where the operators see an opening, if but a back."""
    return not (is_closed(rough_void_irradiance(frozen.transport)) or is_closed(frozen.void_irradiance))


def is_closed(irradiance: Tensor) -> bool:
    """Whether nothing arrives from outside, from the surfels' irradiance (N,) under a void of radiance 1."""
    return not len(irradiance) or float(irradiance.mean()) < LEAST_OPEN * torch.pi


def _reflected(frozen: FrozenScene, irradiance: Tensor, interreflection: bool) -> Tensor | None:
    if is_closed(irradiance):
        return None
    return frozen.coloured_radiance(irradiance[:, None].expand(-1, 3), interreflection)
