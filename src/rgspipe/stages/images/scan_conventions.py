"""What the depth of a capture says of how its files were meant, in the words of its layout."""

from __future__ import annotations

from collections.abc import Sequence

from rgspipe.datasets.scans.frame import Scan
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.evidence.conventions import ViewFinding, contradicted, misread
from rgspipe.evidence.image_order import misplaced_images
from rgspipe.evidence.readings import Reading
from rgspipe.evidence.reprojection import Agreement

#: Axes of cameras, in words.
AXES = {"opengl": "OpenGL axes (y up, z backwards)", "opencv": "OpenCV axes (y down, z forwards)"}

EXPECTED = "poses and depth by which photographs agree where they show the same places"


def check_scan(scan: Scan, views: Sequence[View]) -> None:
    """Refuse a capture whose depth contradicts its poses.

    Raises:
        InputError: naming what its files seem to hold instead, and the setting or the change that helps.
    """
    finding = misread(views, along_rays=False)
    if finding is not None:
        raise _refusal(scan, finding)
    stated = contradicted(views, along_rays=False)
    if stated is not None:
        raise InputError(
            scan.stated,
            expected=EXPECTED,
            found=f"{_share(stated)} agreeing, under no axes and no unit that is known",
            remedy="Poses may be of other photographs: check that lines or files are in the order of the images, that "
            "rows of matrices are in theirs, that depth belongs to the photographs, and that focal lengths are in "
            "pixels of the stated size.",
        )


def check_images(scan: Scan, views: Sequence[View]) -> None:
    """Refuse a capture whose images are not those of its frames.

    Raises:
        InputError: naming where they seem to belong.
    """
    finding = misplaced_images(views)
    if finding is not None:
        raise InputError(
            scan.stated,
            expected="images that belong to their poses and depth, in which the same places are as bright as in others",
            found=f"a rank correlation of {finding.found:.2f} with images taken for {finding.words}, and "
            f"{finding.stated:.2f} as read",
            remedy=finding.remedy,
        )


def _refusal(scan: Scan, finding: ViewFinding) -> InputError:
    meant = _meant(finding.reading, scan.axes)
    return InputError(
        scan.stated,
        expected=f"{EXPECTED}, as the layout {scan.layout} writes them",
        found=f"{_share(finding.found)} agreeing under {' and '.join(words for words, _ in meant)}, and "
        f"{_share(finding.stated)} as read",
        remedy=" ".join(remedy for _, remedy in meant),
    )


def _share(result: Agreement) -> str:
    return f"{100 * result.share:.0f} % of {result.tested} points" if result.tested else "none that could be compared"


def _meant(reading: Reading, axes: str) -> list[tuple[str, str]]:
    """What was meant by files that were read with these axes, and what to do about it, in this order."""
    other = next(name for name in AXES if name != axes)
    scaled = f"multiply depth by {reading.scale:g} (scene.rgbd.depth_unit) or the cameras' places by "
    scaled += f"{1.0 / reading.scale:g} (scene.rgbd.pose_unit)."
    known = (
        (reading.inverse, "world-to-camera matrices", "Invert every matrix."),
        (
            reading.opencv,
            AXES[other],
            f"Set scene.rgbd.axes={other}.",
        ),
        (reading.other_depth, "depth along rays", "Divide depth by the length of each pixel's ray at depth 1."),
        (reading.scale != 1.0, f"depth times {reading.scale:g}", scaled.capitalize()),
    )
    return [(words, remedy) for applies, words, remedy in known if applies]
