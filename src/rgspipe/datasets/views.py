"""What a dataset holds once it is in memory: views with all that is known of them, and fit targets."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.arguments import as_number, as_one_of
from rgspipe.datasets.classes import Occlusion
from rgspipe.errors import InputError
from rgspipe.scene import Camera, PointLight
from rgspipe.scene.arrays import as_device, as_tensor, check_finite, check_levels, check_radiance
from rgspipe.scene.lights import Light, check_numbers
from rgspipe.scene.shapes import Float, Given

#: The images of a view, and their channels.
PARTS: dict[str, tuple[int, ...]] = {"image": (3,), "alpha": (), "depth": ()}
PARTS |= dict.fromkeys(("normal", "albedo", "base"), (3,))

#: So much alpha may be above 1: it may have been resampled.
ROUNDING = 1e-3

#: The least radiance above 0.
TINY = 5e-324


@dataclass(frozen=True, eq=False, repr=False)
class View:
    """One image and what is known of it; lists and numpy arrays are taken for its tensors.

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
        InputError: the camera or the light is none, a part is no numbers of the camera's size, image or base are not
            finite or levels of 8 bits, or alpha is out of range.
    """

    name: str
    camera: Camera
    image: Given
    alpha: Given
    light: PointLight | None = None
    depth: Given | None = None
    normal: Given | None = None
    albedo: Given | None = None
    saturated_from: float | None = None
    emitters: Given | None = None
    base: Given | None = None
    lighting: str = ""
    exposure: float | None = None
    base_exposure: float | None = None

    def __post_init__(self) -> None:
        as_one_of(self.camera, Camera, "camera", "Camera.look_at makes one.")
        if self.light is not None:
            as_one_of(self.light, Light, "light", "Pass one, such as PointLight([0, 0, 0.3], 1.0).")
            check_numbers((self.light,))
        size = (self.camera.height, self.camera.width)
        for name, channels in PARTS.items():
            if (given := getattr(self, name)) is not None:
                check_levels(name, given)
                taken = as_tensor(given, name, (*size, *channels), torch.float32)
                object.__setattr__(self, name, taken.detach() if taken.requires_grad else taken)
        if self.emitters is not None:
            object.__setattr__(self, "emitters", as_tensor(self.emitters, "emitters", size) >= 0.5)
        self._check()

    def _check(self) -> None:
        """Refuse numbers that no photograph has.

        Raises:
            InputError: says which.
        """
        for name in ("image", "base", "alpha"):
            if (part := getattr(self, name)) is not None:
                check_finite(part, name, "Correct it; alpha says which pixels do not count.")
                check_radiance(name, float(part.min()), float(part.max()))
        least, most = float(self.alpha.min()), float(self.alpha.max())
        if least < 0.0 or most > 1.0 + ROUNDING:
            found, remedy = f"values from {least:.4g} to {most:.4g}", "Divide levels of 8 bits by 255."
            raise InputError("alpha", expected="shares of pixels, 0 to 1", found=found, remedy=remedy)
        if self.saturated_from is not None:
            expected, remedy = "radiance above 0", "None is for images that are not."
            limit = as_number(self.saturated_from, "saturated_from", remedy, expected=expected, low=TINY)
            object.__setattr__(self, "saturated_from", limit)

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
