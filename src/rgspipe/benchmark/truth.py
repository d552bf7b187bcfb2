"""Path-traced truth of a room: every camera under every light, direct light alone and all bounces."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from rgspipe.benchmark.rooms import Room
from rgspipe.blender.options import OWN_BLENDER, BlenderOptions
from rgspipe.blender.render_room import render_room
from rgspipe.blender.room_job import Kind, RoomJob, image_name
from rgspipe.datasets.exr import read_array
from rgspipe.datasets.json_file import read_json, required
from rgspipe.errors import InputError
from rgspipe.evaluation.metrics import peak, psnr
from rgspipe.store.files import write_json

KINDS: tuple[Kind, ...] = ("direct", "global")

#: Bounces of global light: what 64 leave out of a closed room with albedo 0.73 is 0.73^64/(1 − 0.73) = 7e-9.
MAX_BOUNCES = 64

#: Samples of a global image over those of a direct one, which is noisy at edges only.
DIRECT_SHARE = 4

TRUTH_FILE = "truth.json"
CHANNELS = ("R", "G", "B", "noise.R", "noise.G", "noise.B")


@dataclass(frozen=True)
class Truth:
    """Path-traced images of a room; lights of 1 W/sr.

    Attributes:
        room: its name.
        resolution: width and height, pixels.
        samples: per pixel of the global images.
        images: by kind, (K, L, H, W, 3) linear radiance, the mean over each pixel.
        noise: by kind, the same shape: half the difference of two independent halves, as large as the error of
            `images`.
    """

    room: str
    resolution: int
    samples: int
    images: dict[Kind, Tensor]
    noise: dict[Kind, Tensor]

    def image(self, camera: int, light: int, kind: Kind) -> Tensor:
        """(H, W, 3) linear radiance."""
        return self.images[kind][camera, light]

    def cap(self, camera: int, light: int, kind: Kind) -> float:
        """PSNR [dB] of an image without any error against this one, because of the truth's own noise."""
        image = self.image(camera, light, kind)
        return psnr(image + self.noise[kind][camera, light], image)

    def psnr(self, image: Tensor, camera: int, light: int, kind: Kind, mask: Tensor | None = None) -> float:
        """PSNR [dB] of `image` (H, W, 3) against the truth without its noise; peak as in `metrics.psnr`.

        With independent halves A and B of the truth, mean (image − A)(image − B) is the squared error that `image`
        has against the exact truth, without bias. It counts as no less than its own standard error, so that an
        image is never called better than the noise lets us tell.

        Args:
            image: (H, W, 3) linear radiance.
            camera, light, kind: which image of the truth.
            mask: (H, W) boolean, True where a pixel counts; all pixels if None.
        """
        white = peak(self.image(camera, light, kind))
        return 10.0 * math.log10(white**2 / self._squared_error(image, camera, light, kind, mask))

    def relative_error(self, image: Tensor, camera: int, light: int, kind: Kind) -> float:
        """‖image − truth‖ / ‖truth‖, without the truth's noise as in `psnr`."""
        squared = self.image(camera, light, kind).double().square().mean()
        return math.sqrt(self._squared_error(image, camera, light, kind, None) / float(squared))

    def _squared_error(self, image: Tensor, camera: int, light: int, kind: Kind, mask: Tensor | None) -> float:
        """Mean squared error without the truth's own, at least its standard error."""
        target, noise = self.image(camera, light, kind).double(), self.noise[kind][camera, light].double()
        squared = ((image.double() - target).square() - noise.square()).mean(dim=2)
        counted = squared.reshape(-1) if mask is None else squared[mask]
        least = counted.std() / math.sqrt(len(counted))
        return float(torch.maximum(counted.mean(), least))

    def pooled(self, resolution: int) -> Truth:
        """The same truth at a lower resolution: means over blocks of pixels.

        Raises:
            ValueError: the resolution is not a divisor of this one's.
        """
        factor = self.resolution // resolution
        if factor * resolution != self.resolution:
            raise ValueError(f"images of {self.resolution}² pixels cannot be pooled to {resolution}²")

        def pool(stacks: dict[Kind, Tensor]) -> dict[Kind, Tensor]:
            blocks = {
                k: s.unflatten(3, (resolution, factor)).unflatten(2, (resolution, factor)) for k, s in stacks.items()
            }
            return {kind: block.mean(dim=(3, 5)) for kind, block in blocks.items()}

        return replace(self, resolution=resolution, images=pool(self.images), noise=pool(self.noise))


def render_truth(
    room: Room,
    folder: Path,
    options: BlenderOptions = OWN_BLENDER,
    *,
    resolution: int = 128,
    samples: int = 1024,
    seed: int = 0,
) -> dict[Kind, float | None]:
    """Render `room` with Cycles into `folder`, and write what the images are into truth.json.

    Images that are already there and whole are kept, so an interrupted call may be repeated.

    Args:
        room: what is rendered.
        folder: receives <kind>/camera_<k>_light_<l>.exr.
        options: which Blender renders.
        resolution: width and height, pixels.
        samples: per pixel of global images; direct ones take a quarter. A multiple of 8.
        seed: of the path tracer.

    Returns:
        by kind the least PSNR [dB] that the truth's own noise allows; None if no noise was seen.

    Raises:
        InputError: there is no Blender, or `folder` holds images of another room or with other settings.
        RuntimeError: Blender died.
        ValueError: `samples` cannot be halved.
    """
    job = RoomJob(
        room=room.name,
        corners=room.surfaces.corners.tolist(),
        albedo=room.surfaces.albedo.tolist(),
        poses=[camera.camera_to_world.tolist() for camera in room.cameras(resolution)],
        field_of_view=room.field_of_view,
        lights=room.lights.double().tolist(),
        resolution=resolution,
        samples=samples,
        direct_samples=samples // DIRECT_SHARE,
        max_bounces=MAX_BOUNCES,
        seed=seed,
    )
    folder = Path(folder)
    render_room(job, folder, options)
    facts = {"room": room.name, "resolution": resolution, "samples": samples, "direct_samples": job.direct_samples}
    facts |= {"max_bounces": MAX_BOUNCES, "seed": seed, "intensity": 1.0, "field_of_view": room.field_of_view}
    facts |= {"cameras": job.poses, "lights": job.lights}
    write_json(folder / TRUTH_FILE, facts)
    truth = load_truth(folder)
    caps = {kind: _caps(truth, kind) for kind in KINDS}
    write_json(folder / TRUTH_FILE, facts | {"noise_cap_db": caps})
    return {
        kind: min((cap for row in rows for cap in row if cap is not None), default=None) for kind, rows in caps.items()
    }


def _caps(truth: Truth, kind: Kind) -> list[list[float | None]]:
    """Of every camera and light; None for an image without noise or light."""
    cameras, lights = truth.images[kind].shape[:2]
    caps = [[truth.cap(camera, light, kind) for light in range(lights)] for camera in range(cameras)]
    return [[cap if math.isfinite(cap) else None for cap in row] for row in caps]


def load_truth(folder: Path) -> Truth:
    """The truth that `render_truth` left in `folder`.

    Raises:
        InputError: a file is missing, broken, or of another size than truth.json says.
    """
    folder = Path(folder)
    path = folder / TRUTH_FILE
    facts = read_json(path, "what the path-traced images of a room are")
    room, size, samples, cameras, lights = (
        required(facts, key, path) for key in ("room", "resolution", "samples", "cameras", "lights")
    )
    places = [(camera, light) for camera in range(len(cameras)) for light in range(len(lights))]
    images, noise = {}, {}
    for kind in KINDS:
        stack = np.stack([_read(folder / f"{image_name(kind, *place)}.exr", size) for place in places])
        both = torch.from_numpy(stack).reshape(len(cameras), len(lights), size, size, 6)
        images[kind], noise[kind] = both[..., :3].contiguous(), both[..., 3:].contiguous()
    return Truth(room, size, samples, images, noise)


def _read(path: Path, size: int) -> np.ndarray:
    array = read_array(path, CHANNELS)
    if array.shape[:2] != (size, size):
        raise InputError(
            path,
            expected=f"{size} × {size} pixels, as {TRUTH_FILE} says",
            found=f"{array.shape[1]} × {array.shape[0]}",
            remedy="Render the truth again.",
        )
    return array
