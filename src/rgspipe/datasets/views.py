"""What a dataset holds once it is in memory: views with all that is known of them, and fit targets."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.arguments import as_one_of
from rgspipe.datasets.classes import Occlusion
from rgspipe.errors import InputError
from rgspipe.scene import Camera, PointLight
from rgspipe.scene.arrays import as_device, as_tensor
from rgspipe.scene.lights import Light
from rgspipe.scene.shapes import Float


@dataclass(frozen=True, eq=False, repr=False)
class View:
    """One image and what is known of it.

    Attributes:
        name: for people and tables, e.g. "train/r_0001".
        camera: the camera that took it.
        image: (H, W, 3) float32 linear radiance, premultiplied by alpha.
        alpha: (H, W) float32 in [0, 1].
        light: the one light that was on, intensity in W/sr; None in a fit target.
        depth: (H, W) float32 planar depth at pixel centres, scene units; +inf where there is no surface,
            NaN where it is not known.
        normal: (H, W, 3) float32 unit world normals that face the camera; 0 where there is no surface.
        albedo: (H, W, 3) float32 diffuse reflectance; 0 where there is no surface.
        saturated_from: radiance from which on the image tells only that the scene is at least so bright; None where
            it holds radiance as it was.
        emitters: (H, W) bool, where the image shows lamps themselves; None where nobody said so.
        base: (H, W, 3) the same with the lamps off, in a fit target.
        lighting: of photographs under unknown lamps, the name of those that were on: all of one name share them; "off"
            is what was there with all of them off.
        exposure: shutter time × ISO / aperture² that the image's file states; None where it does not.
        base_exposure: what that of `base` states.

    Raises:
        InputError: the camera or the light is none, or image and alpha are no numbers of the camera's size.
    """

    name: str
    camera: Camera
    image: Float[Tensor, "H W 3"]
    alpha: Float[Tensor, "H W"]
    light: PointLight | None = None
    depth: Float[Tensor, "H W"] | None = None
    normal: Float[Tensor, "H W 3"] | None = None
    albedo: Float[Tensor, "H W 3"] | None = None
    saturated_from: float | None = None
    emitters: Tensor | None = None
    base: Float[Tensor, "H W 3"] | None = None
    lighting: str = ""
    exposure: float | None = None
    base_exposure: float | None = None

    def __post_init__(self) -> None:
        as_one_of(self.camera, Camera, "camera", "Camera.look_at makes one.")
        if self.light is not None:
            as_one_of(self.light, Light, "light", "Pass one, such as PointLight([0, 0, 0.3], 1.0).")
        size = (self.camera.height, self.camera.width)
        object.__setattr__(self, "image", as_tensor(self.image, "image", (*size, 3)))
        object.__setattr__(self, "alpha", as_tensor(self.alpha, "alpha", size))

    @property
    def saturated(self) -> Tensor:
        """(H, W, 3) bool: where the image tells only that the scene is at least so bright."""
        if self.saturated_from is None:
            return torch.zeros_like(self.image, dtype=torch.bool)
        return self.image >= self.saturated_from

    def to(self, device: torch.device | str) -> View:
        """The same view with its images on another device, which must be there."""
        device = as_device(device)
        parts = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(self, **{name: part.to(device) for name, part in parts.items() if isinstance(part, Tensor)})

    def as_photographed(self, rendered: Float[Tensor, "H W 3"]) -> Float[Tensor, "H W 3"]:
        """A render (H, W, 3) that is the image wherever that is saturated and the render at least as bright."""
        return as_photographed(rendered, self.image, self.saturated)

    def __repr__(self) -> str:
        known = [name for name in ("light", "depth", "normal", "albedo") if getattr(self, name) is not None]
        size = f"{self.camera.width} × {self.camera.height}"
        return f"View({self.name!r}, {size}{''.join(f', {name}' for name in known)})"


def as_photographed(
    rendered: Float[Tensor, "H W 3"], image: Float[Tensor, "H W 3"], saturated: Tensor
) -> Float[Tensor, "H W 3"]:
    """A render that is the image wherever that is `saturated`, (H, W, 3) bool, and the render at least as bright."""
    return torch.where(saturated & (rendered >= image), image, rendered)


@dataclass(frozen=True)
class Target:
    """Views of the scene under the same unknown lights; every view's `light` is None."""

    name: str
    occlusion: Occlusion
    views: tuple[View, ...]


@dataclass(frozen=True)
class Dataset:
    """The training and held-out views of one scene, and the targets whose lights are to be found."""

    root: Path
    train: tuple[View, ...]
    test: tuple[View, ...]
    targets: tuple[Target, ...]

    def left_out(self) -> tuple[View, ...]:
        """The held-out views, of which there must be some.

        Raises:
            InputError: the dataset has none.
        """
        if not self.test:
            raise InputError(
                self.root / "transforms_test.json",
                expected="views that are left out of training, to judge it by",
                found="none",
                remedy="Move some frames of transforms_train.json there.",
            )
        return self.test
