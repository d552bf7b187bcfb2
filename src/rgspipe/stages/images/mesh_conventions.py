"""What photographs of a mesh say of how poses and mesh were meant, in words."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rgspipe.datasets.mesh.options import MeshOptions
from rgspipe.datasets.mesh.up import is_y_up
from rgspipe.datasets.scans.frame import Scan
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.evidence.mesh_poses import MeshFinding, poses_on_mesh
from rgspipe.scene.mesh import TriangleMesh
from rgspipe.stages.images.scan_conventions import AXES

EXPECTED = "poses from which the photographs show the mesh, so that its points look alike in all of them"


def check_mesh(scan: Scan, views: Sequence[View], mesh: TriangleMesh, path: Path, options: MeshOptions) -> None:
    """Refuse a mesh that the photographs do not show from where they are said to be.

    Raises:
        InputError: naming what mesh or poses seem to be instead, and the setting that helps.
    """
    y_up = is_y_up(path, options)
    finding = poses_on_mesh(views, mesh, y_up=y_up)
    if finding is None:
        return
    if finding.misread:
        meant = _meant(finding, scan, options, y_up)
        raise InputError(
            scan.stated,
            expected=EXPECTED,
            found=f"a rank correlation of {finding.found:.2f} under {' and '.join(words for words, _ in meant)}, and "
            f"of {finding.stated:.2f} as read",
            remedy=" ".join(remedy for _, remedy in meant),
        )
    if not finding.clear:
        raise InputError(
            scan.stated,
            expected=EXPECTED,
            found=f"a rank correlation of {finding.stated:.2f}, which is chance, and no axes and no unit with a better",
            remedy="Poses and mesh may be of different reconstructions: both must be in the same coordinates, up to "
            "scene.mesh.up and scene.mesh.unit.",
        )


def _meant(finding: MeshFinding, scan: Scan, options: MeshOptions, y_up: bool) -> list[tuple[str, str]]:
    """What was meant, and what to do about it."""
    reading = finding.meant
    axes = next(name for name in AXES if name != scan.axes)
    up, unit = "z" if y_up else "y", options.unit * reading.scale
    known = (
        (reading.inverse, "world-to-camera matrices", "Invert every matrix."),
        (reading.opencv, AXES[axes], f"Set scene.rgbd.axes={axes}."),
        (reading.turned, f"a mesh whose {up} is up", f"Set scene.mesh.up={up}."),
        (reading.scale != 1.0, f"a mesh times {reading.scale:g}", f"Set scene.mesh.unit={unit:g}."),
    )
    return [(words, remedy) for applies, words, remedy in known if applies]
