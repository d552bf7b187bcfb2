"""The frozen scene as the stage relight renders it: cameras, effects, and what an image takes."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from torch import Tensor

from rgspipe.config import RgspipeConfig
from rgspipe.datasets import gs3
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.light_file import ambient_fields, write_lights
from rgspipe.datasets.location import dataset_root, open_dataset
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.renderer.ambient import ambient_image
from rgspipe.renderer.effect_choice import RigKind
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.images.model import SurfelModel, ViewModel
from rgspipe.renderer.images.pixels import PixelModel
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import Camera, LightRig
from rgspipe.scene.lights import KINDS
from rgspipe.stages.scene.effects import chosen_effects, frozen_scene, wanted_effects
from rgspipe.store.artifacts import Artifact


@dataclass
class Relighter:
    """Renders rigs; what rigs of one kind and cameras share is made once.

    Attributes:
        config: the whole configuration.
        freeze: the artifact of the frozen scene.
        frozen: the scene, with all of its effects.
        reasons: why effects are simulated or not, by the kind of rig, of those that were rendered.
    """

    config: RgspipeConfig
    freeze: Artifact
    frozen: FrozenScene
    reasons: dict[str, tuple[str, ...]] = field(default_factory=dict)
    _weights: dict[bytes, ViewWeights] = field(default_factory=dict)
    _models: dict[tuple[bytes, Effects], ViewModel] = field(default_factory=dict)
    _rendered: ViewModel | None = None
    _kinds: dict[RigKind, Effects] = field(default_factory=dict)

    @classmethod
    def of(cls, config: RgspipeConfig, freeze: Artifact) -> Relighter:
        """That of the frozen scene of an artifact."""
        return cls(config, freeze, frozen_scene(config, freeze))

    def render(
        self, cameras: Sequence[Camera], rig: LightRig, ambient: Tensor | None = None
    ) -> tuple[list[Tensor], float]:
        """(H, W, 3) image of every camera under `rig`, and the seconds that all of them took once they are prepared.

        Args:
            ambient: (3,) radiance from all around, that comes in through openings.
        """
        model = self._model(cameras, self._effects(rig))
        if model is not self._rendered:
            # The first image of a camera works out what the others share.
            model.image(rig)
            self._rendered = model
        began = time.perf_counter()
        # Read back before the clock stops: a GPU is still at it.
        images = model.views.split(model.image(rig).cpu())
        seconds = time.perf_counter() - began
        if ambient is not None:
            views = (self._view(camera) for camera in cameras)
            lit = (ambient.to(images[0]) * ambient_image(self.frozen, view).cpu() for view in views)
            images = [image + other for image, other in zip(images, lit, strict=True)]
        return images, seconds

    def write(
        self,
        folder: Path,
        name: str,
        rig: LightRig,
        views: Sequence[tuple[int, Camera]],
        ambient: Tensor | None = None,
    ) -> tuple[list[dict[str, object]], list[np.ndarray]]:
        """Render a rig in cameras with their indices, and write images/<name>/view_<index>.exr and lights/<name>.json.

        Returns:
            a row of what is known of each image, and the images, (H, W, 3) linear radiance.
        """
        images, seconds = self.render([camera for _, camera in views], rig, ambient)
        arrays = [image.numpy() for image in images]
        for (index, _), array in zip(views, arrays, strict=True):
            write_image(image_path(folder, name, index), array)
        write_lights(folder / "lights" / f"{name}.json", rig, ambient_fields(ambient))
        known = {"rig": name, "lights": len(rig)}
        rows = [known | {"view": index, "milliseconds": 1e3 * seconds / len(views)} for index, _ in views]
        return rows, arrays

    def _effects(self, rig: LightRig) -> Effects:
        """The effects of a rig."""
        wanted, kind = self.config.effects, RigKind.of(rig)
        if not wanted.auto:
            return wanted_effects(wanted)
        if kind not in self._kinds:
            choice = chosen_effects(wanted, self.freeze, kind)[1]
            self.reasons[_words(rig)] = choice.reasons
            self._kinds[kind] = choice.effects
        return self._kinds[kind]

    def _model(self, cameras: Sequence[Camera], effects: Effects) -> ViewModel:
        key = b"".join(camera.key for camera in cameras), effects
        if key not in self._models:
            views = ViewedPixels.every(self.frozen, [self._view(camera) for camera in cameras])
            sharp = self.config.effects.at_pixels
            self._models[key] = PixelModel.of(views, effects) if sharp else SurfelModel(views, effects)
        return self._models[key]

    def _view(self, camera: Camera) -> ViewWeights:
        if camera.key not in self._weights:
            self._weights[camera.key] = self.frozen.view(camera)
        return self._weights[camera.key]


def image_path(folder: Path, rig: str, view: int) -> Path:
    """Where the image of a rig in a camera is."""
    return folder / "images" / rig / f"view_{view}.exr"


def _words(rig: LightRig) -> str:
    """A rig in words: "2 points, 1 spot"."""
    counted = Counter(light.kind for light in rig)
    return ", ".join(f"{counted[name]} {name}{'s' if counted[name] != 1 else ''}" for name in KINDS if counted[name])


def configured_cameras(config: RgspipeConfig, folder: Path | None) -> list[Camera]:
    """The cameras that `relight.views` names, with images of `relight.resolution`.

    Args:
        folder: the artifact that has the views; None for those of `fit.target`.

    Raises:
        InputError: there are none.
    """
    width = config.relight.resolution
    return [view.camera if width is None else view.camera.resized(width) for view in _camera_views(config, folder)]


def _camera_views(config: RgspipeConfig, folder: Path | None) -> Sequence[View]:
    split = config.relight.views
    if split == "targets":
        return gs3.load_target(_first_target(config, folder)).views
    dataset = open_dataset(folder, train=split == "train", test=split == "test", targets=False)
    return dataset.train if split == "train" else dataset.left_out()


def _first_target(config: RgspipeConfig, folder: Path | None) -> Path:
    """All targets of a dataset are seen by the same cameras."""
    if folder is None:
        return Path(str(config.fit.target))
    return target_folders(folder)[0]


def target_folders(folder: Path) -> list[Path]:
    """The targets of a dataset, or of the one that its artifact points at.

    Raises:
        InputError: there are none.
    """
    root = dataset_root(folder)
    found = gs3.target_folders(root)
    if not found:
        raise InputError(
            root / "targets",
            expected="fit targets, for their cameras",
            found="none",
            remedy="Take other cameras: relight.views=test.",
        )
    return found


def chosen_indices(wanted: Sequence[int] | None, count: int) -> list[int]:
    """Which of `count` cameras are used: all of them if nothing is said.

    Raises:
        InputError: there are fewer, or one is named twice.
    """
    if wanted is None:
        return list(range(count))
    if not wanted or max(wanted) >= count or len(set(wanted)) < len(wanted):
        raise InputError(
            "relight.indices",
            expected=f"different ones of the {count} cameras, from 0",
            found=str(list(wanted)),
            remedy="Leave it away for all of them.",
        )
    return list(wanted)
