"""What accuracy is bought with: one setting of the renderer's knobs, and the model of a room made with it."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from rgspipe.benchmark.rooms import Room
from rgspipe.renderer.areas import surfel_areas
from rgspipe.renderer.clusters import cluster_patches
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.gather import build_gather
from rgspipe.renderer.images.model import SurfelModel, ViewModel
from rgspipe.renderer.images.pixels import PixelModel
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.transport import build_patch_transport
from rgspipe.renderer.view_weights import ViewWeights
from rgspipe.scene import LightRig
from rgspipe.scene.rectangles import surfels_on

#: Where direct light is evaluated: at the surfels' centres, at the pixels' hits too, or without any shadow.
Shadows = Literal["surfels", "pixels", "none"]


@dataclass(frozen=True)
class RenderSetting:
    """The knobs that cost time and buy accuracy.

    Attributes:
        surfels: how many, about.
        gather_rays: hemisphere rays a surfel, M.
        patches: patches of the indirect light.
        bounces: of the indirect light; None for all.
        resolution: width and height of the image, pixels.
        supersampling: rays of an edge pixel, squared.
        shadows: where they are evaluated.
        precision: of products and solve, after the ray casts.
    """

    surfels: int = 10_000
    gather_rays: int = 128
    patches: int = 500
    bounces: int | None = None
    resolution: int = 128
    supersampling: int = 4
    shadows: Shadows = "surfels"
    precision: Literal["float32", "float64"] = "float32"

    @property
    def changed(self) -> str:
        """What differs from the default, for a row of a table."""
        base = RenderSetting()
        names = [name for name in self.__dataclass_fields__ if getattr(self, name) != getattr(base, name)]
        return ", ".join(f"{name}={getattr(self, name)}" for name in names) or "base"


@dataclass
class Cost:
    """What a model took to make.

    Attributes:
        areas_s, gather_s, transport_s, views_s: seconds; views per camera.
        operators_mib: memory of gather, transport and view weights.
    """

    areas_s: float = 0.0
    gather_s: float = 0.0
    transport_s: float = 0.0
    views_s: float = 0.0
    operators_mib: float = 0.0

    @property
    def build_s(self) -> float:
        """Seconds that the model took to make."""
        return self.areas_s + self.gather_s + self.transport_s + self.views_s


@dataclass(frozen=True)
class Model:
    """A room made with a setting: the frozen scene, its views, and how each of these sees lights."""

    setting: RenderSetting
    frozen: FrozenScene
    views: tuple[ViewWeights, ...]
    seen: tuple[ViewModel, ...]
    cost: Cost

    @property
    def at_pixels(self) -> bool:
        """Whether direct light is evaluated where pixels look."""
        return self.setting.shadows == "pixels"

    def image(self, camera: int, rig: LightRig, indirect: bool = True) -> Tensor:
        """(H, W, 3) image of one camera, differentiable towards the tensors of the lights."""
        if self.setting.precision == "float64":
            return precise_image(self.frozen, self.views[camera], rig, indirect)
        model = self.seen[camera]
        model = replace(model, effects=replace(model.effects, interreflection=indirect))
        return model.views.split(model.image(rig))[0]


def precise_image(frozen: FrozenScene, view: ViewWeights, rig: LightRig, indirect: bool) -> Tensor:
    """(H, W, 3) float32 of an image whose products and solve are done in float64; ray casts stay as they are."""
    direct = frozen.radiance_of(rig, Effects(interreflection=False)).double().numpy()
    weights, transport = view.operator.to_scipy().astype(np.float64), frozen.transport
    radiance = direct.copy()
    if indirect:
        average, gather = (part.to_scipy().astype(np.float64) for part in (transport.average, transport.gather))
        albedo, patches = transport.albedo.double().numpy(), average.shape[0]
        for channel in range(3):
            bounce = (average @ (gather.multiply(albedo[:, channel : channel + 1]))).toarray()
            solved = np.linalg.solve(np.eye(patches) - bounce, average @ direct[:, channel])
            radiance[:, channel] += albedo[:, channel] * (gather @ solved)
    return torch.from_numpy(weights @ radiance).float().reshape(view.camera.height, view.camera.width, 3)


@dataclass
class Workshop:
    """Makes models of one room; the gather operator, the dearest part, is kept for settings that share it."""

    room: Room
    seed: int = 0
    _kept: dict[tuple[int, int], tuple[SurfelBvh, SparseOperator, Tensor, float, float]] = field(default_factory=dict)

    def model(self, setting: RenderSetting) -> Model:
        """The room's model; times are those of making it from nothing, also where the gather was kept."""
        bvh, gather, areas, areas_s, gather_s = self._gather(setting)
        surfels = bvh.surfels
        begin = time.perf_counter()
        labels = cluster_patches(surfels.centers, surfels.normals, setting.patches, seed=self.seed)
        transport = build_patch_transport(gather, labels, areas, surfels.albedo, bounces=setting.bounces)
        frozen = FrozenScene(surfels, areas, gather, transport)
        middle = time.perf_counter()
        cameras = self.room.cameras(setting.resolution)
        views = tuple(frozen.view(camera, setting.supersampling) for camera in cameras)
        effects, kind = Effects(setting.shadows != "none"), PixelModel if setting.shadows == "pixels" else SurfelModel
        seen = tuple(kind.of(ViewedPixels.every(frozen, [view]), effects) for view in views)
        views_s = (time.perf_counter() - middle) / len(cameras)
        parts = [gather, transport.average, transport.gather, *(view.operator for view in views)]
        size = 8 * sum(part.entries for part in parts) + 4 * transport.inverse.numel()
        return Model(setting, frozen, views, seen, Cost(areas_s, gather_s, middle - begin, views_s, size / 2**20))

    def _gather(self, setting: RenderSetting) -> tuple[SurfelBvh, SparseOperator, Tensor, float, float]:
        key = setting.surfels, setting.gather_rays
        if key not in self._kept:
            self._kept.clear()
            surfels = surfels_on(self.room.surfaces, setting.surfels).to(torch.float32)
            begin = time.perf_counter()
            bvh = SurfelBvh(surfels)
            areas = surfel_areas(bvh, seed=self.seed)
            middle = time.perf_counter()
            gather = build_gather(bvh, setting.gather_rays, seed=self.seed, areas=areas)
            self._kept[key] = bvh, gather, areas, middle - begin, time.perf_counter() - middle
        return self._kept[key]


def sweep(presets: Iterable[RenderSetting] = ()) -> list[RenderSetting]:
    """The base setting, every knob turned alone, and a few turned together; neighbours share a gather operator."""
    base = RenderSetting()
    turned = [
        *(replace(base, patches=n) for n in (100, 250, 1000, 2000)),
        *(replace(base, bounces=n) for n in (0, 1, 2, 4, 8)),
        *(replace(base, resolution=n) for n in (32, 64)),
        *(replace(base, supersampling=n) for n in (1, 2, 8)),
        *(replace(base, shadows=mode) for mode in ("none", "pixels")),
        replace(base, precision="float64"),
        *(replace(base, gather_rays=n) for n in (32, 64, 256, 512, 1024)),
        *(replace(base, surfels=n) for n in (2_500, 5_000, 20_000, 40_000)),
    ]
    together = [
        RenderSetting(2_500, 64, 100),
        RenderSetting(2_500, 64, 250, shadows="pixels"),
        RenderSetting(5_000, 64, 250),
        RenderSetting(5_000, 128, 500, shadows="pixels"),
        RenderSetting(10_000, 128, 1000, shadows="pixels"),
        RenderSetting(10_000, 128, 2000, shadows="pixels"),
        RenderSetting(20_000, 256, 1000),
        RenderSetting(40_000, 128, 2000, shadows="pixels"),
    ]
    settings = dict.fromkeys([base, *turned, *together, *presets])
    return sorted(settings, key=lambda s: (s.surfels, s.gather_rays))
