"""Images of a target's views with the lamps off: named by its frames, or a folder of them laid out as the target is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.datasets.frames import FrameEntry, read_entries
from rgspipe.datasets.images import check_size, read_colour
from rgspipe.datasets.input_file import input_folder
from rgspipe.datasets.json_file import is_number
from rgspipe.datasets.pinhole_keys import ANGLES, KEYS
from rgspipe.errors import InputError
from rgspipe.scene import Camera

#: Poses and intrinsics of two files are the same within this share: numbers may have been written with few digits.
SAME = 1e-4


def base_paths(entries: Sequence[FrameEntry], base: str | Path | None) -> list[Path | None]:
    """Per frame its image with the lamps off: in the folder `base`, or what the frame itself names; None without one.

    A folder with a transforms.json has as many frames, from the same cameras in the same order; another one has images
    that lie in it as the target's do in the target's folder.

    Raises:
        InputError: no such folder, or other frames than the target's.
    """
    if base is None:
        return [entry.base_path for entry in entries]
    folder = input_folder(base, "a folder of images with the lamps off")
    if not (folder / "transforms.json").exists():
        return [folder / _below(entry) for entry in entries]
    others = read_entries(folder / "transforms.json", "the cameras of images with the lamps off")
    if len(others) != len(entries):
        raise InputError(
            folder,
            expected=f"the {len(entries)} cameras of the target",
            found=f"{len(others)} frames",
            remedy="Give one image with the lamps off for each view of the target, in the same order.",
        )
    for entry, other in zip(entries, others, strict=True):
        _require_same(entry, other)
    return [other.image_path for other in others]


def read_base(path: Path, camera: Camera, mask: Tensor | None) -> Tensor:
    """(H, W, 3) linear radiance of an image with the lamps off, where `mask` (H, W) lets it through.

    Raises:
        InputError: missing or broken file, or another size than the target's image.
    """
    image, _ = read_colour(path)
    check_size(path, image, camera)
    return image if mask is None else image * mask[..., None]


def _below(entry: FrameEntry) -> Path:
    """Where the frame's image lies below its transforms file; its name alone if it lies elsewhere."""
    path, folder = entry.image_path, entry.transforms_path.parent
    return path.relative_to(folder) if path.is_relative_to(folder) else Path(path.name)


def _require_same(entry: FrameEntry, other: FrameEntry) -> None:
    """Refuse a frame of another camera. Intrinsics belong to an image's size, which is the same for both.

    Raises:
        InputError: naming both frames.
    """
    one, two = (_stated(frame) for frame in (entry, other))
    if len(one) != len(two) or not torch.allclose(one, two, rtol=SAME, atol=SAME):
        raise InputError(
            other.where,
            expected=f"the camera of {entry.where}",
            found="another one",
            remedy="Photograph the room with the lamps off from the same places, with the same lens.",
        )


def _stated(frame: FrameEntry) -> Tensor:
    """What a frame says of its camera: the pose, and intrinsics or the field of view, with what stands beside it."""
    fields = frame.shared | frame.fields
    beside = [fields[key] for key in (*KEYS, *ANGLES) if is_number(fields.get(key))]
    numbers = fields.get("camera_intrinsics", beside)
    return torch.cat([frame.pose().reshape(-1), torch.tensor(numbers, dtype=torch.float64).reshape(-1)])
