"""Keys of frames that were meant to be others are refused, and those of other programs are not."""

from __future__ import annotations

from pathlib import Path

import pytest

from rgspipe.datasets.frame_keys import MEANT, check_frames, is_meant
from rgspipe.errors import InputError

#: Of nerfstudio, instant-ngp, Blender's NeRF datasets and ours.
OTHERS = [
    "file_path",
    "transform_matrix",
    "colmap_im_id",
    "depth_file_path",
    "sharpness",
    "rotation",
    "camera",
    "camera_angle_x",
    "fl_x",
    "depth",
    "normal",
    "albedo",
    "light",
    "lighting",
    "pl_pos",
    "pl_intensity",
    "saturated_from",
    "timestamp",
    "depth_path",
    "normal_path",
    "albedo_path",
    "file_ext",
    "camera_intrinsics",
    "w",
    "h",
    "cameras_path",
    "database_path",
    "semantics_path",
]


@pytest.mark.parametrize(
    ("key", "meant"),
    [
        ("mask", "mask_path"),
        ("masks", "mask_path"),
        ("Mask_path", "mask_path"),
        ("mask_file_path", "mask_path"),
        ("maskpath", "mask_path"),
        ("masks_path", "mask_path"),
        ("emitters", "emitter_path"),
        ("emiter_path", "emitter_path"),
        ("base", "base_path"),
    ],
)
def test_a_mask_under_another_key_is_refused(key: str, meant: str) -> None:
    """It was passed over, and what it hides counted."""
    frames = [{"file_path": "a"}, {"file_path": "b", key: "m.png"}]
    with pytest.raises(InputError, match=rf'd/t\.json: frames\[1\]\.{key}: .*Call it "{meant}", or remove it'):
        check_frames(frames, Path("d/t.json"))
    # What says nothing, or stands beside the key itself, does no harm.
    check_frames([{key: None}, {key: "m.png", meant: "n.png"}], Path("d/t.json"))


@pytest.mark.parametrize("key", OTHERS)
def test_keys_of_other_programs_are_let_alone(key: str) -> None:
    assert not any(is_meant(key, meant) for meant in MEANT)


@pytest.mark.parametrize("frame", [None, 3, "a.png", ["a.png"]])
def test_what_is_no_frame_is_named(frame: object) -> None:
    with pytest.raises(InputError, match=r"frames\[0\]: expected a JSON object"):
        check_frames([frame], Path("t.json"))
