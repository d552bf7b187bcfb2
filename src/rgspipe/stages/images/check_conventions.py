"""What the evidence of depth says of a dataset's poses and depth, in words, before anything is trained on them."""

from __future__ import annotations

from pathlib import Path

from rgspipe.datasets.info import INFO, read_info
from rgspipe.datasets.views import Dataset
from rgspipe.errors import InputError
from rgspipe.evidence.conventions import ViewFinding, contradicted, misread
from rgspipe.evidence.lamps import misplaced
from rgspipe.evidence.readings import Reading
from rgspipe.evidence.reprojection import Agreement

TRANSFORMS = "transforms_train.json"

#: Each depth convention's other one.
OTHER = {"planar_z": "ray_distance", "ray_distance": "planar_z"}


def check_conventions(dataset: Dataset) -> None:
    """Refuse training views whose depth or brightness contradicts their poses and lamps, where it would not otherwise.

    Raises:
        InputError: naming the file that states it, what was found, and what to do.
    """
    info = read_info(dataset.root)
    if info is None or info.depth_convention is None:
        return
    along_rays = info.depth_convention == "ray_distance"
    finding = misread(dataset.train, along_rays)
    if finding is not None:
        raise _refusal(dataset.root, info.depth_convention, finding)
    stated = contradicted(dataset.train, along_rays)
    if stated is not None:
        raise InputError(
            dataset.root / TRANSFORMS,
            expected="poses and depth by which the views agree where they show the same places",
            found=f"{_share(stated)} agreeing, under no axes and no unit that is known",
            remedy="Check that depth and poses are those of the images, that neither is turned, mirrored or 1 over the "
            "depth, and that the intrinsics are of their size.",
        )
    lamps = misplaced(dataset.train)
    if lamps is not None:
        meant = "" if lamps.lamps is None else f", {lamps.found:.2f} with the places {lamps.lamps.words}"
        belong = "Check that images, lamps and poses of each frame belong together, and that no other light was on."
        raise InputError(
            f"{dataset.root / TRANSFORMS}: pl_pos",
            expected="places of lamps, in the axes and the unit of the poses, near which surfaces are brighter",
            found=f"a rank correlation of {lamps.stated:.2f} between brightness and the light that surfaces would get "
            f"as read{meant}",
            remedy=belong if lamps.lamps is None else lamps.lamps.remedy,
        )


def _refusal(root: Path, convention: str, finding: ViewFinding) -> InputError:
    reading = finding.reading
    about_poses = reading.opencv or reading.inverse or reading.scale != 1.0
    meant = _meant(reading, OTHER[convention])
    return InputError(
        root / TRANSFORMS if about_poses else root / INFO,
        expected="camera-to-world poses with OpenGL axes and depth of their unit and of the stated convention, "
        f"{convention}, by which the views agree where they show the same places",
        found=f"{_share(finding.found)} agreeing under {' and '.join(meant)}, and {_share(finding.stated)} as read",
        remedy=" ".join(_remedies(reading, OTHER[convention])),
    )


def _share(result: Agreement) -> str:
    if not result.tested:
        return "none that could be compared"
    return f"{100 * result.share:.0f} % of {result.tested} points"


def _meant(reading: Reading, other: str) -> list[str]:
    return [
        *(["OpenCV axes (y down, z forwards)"] if reading.opencv else []),
        *(["world-to-camera matrices"] if reading.inverse else []),
        *([f"{other} depth"] if reading.other_depth else []),
        *([f"depth times {reading.scale:g}"] if reading.scale != 1.0 else []),
    ]


def _remedies(reading: Reading, other: str) -> list[str]:
    """What to do, in this order."""
    inverted = "Invert every transform_matrix."
    flipped = "Change the sign of the second and third column of every transform_matrix."
    scaled = f"Multiply the depth by {reading.scale:g}, or places of cameras and lamps by {1.0 / reading.scale:g}."
    return [
        *([inverted] if reading.inverse else []),
        *([flipped] if reading.opencv else []),
        *([f'Write "depth_convention": "{other}" into {INFO}.'] if reading.other_depth else []),
        *([scaled] if reading.scale != 1.0 else []),
    ]
