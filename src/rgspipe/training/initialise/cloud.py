"""From views with depth to one oriented point cloud."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.progress import track
from rgspipe.training.initialise.normals import normals_from_depth

#: Which normals a view contributes: fitted to its depth, its normal pass, or the pass where there is one.
NormalSource = Literal["auto", "estimate", "pass"]

DEPTH_HELP = (
    'Give the frames of transforms_train.json a "depth_path" and name the "depth_convention" (planar_z or '
    "ray_distance) in dataset_info.json, or use a scene that Blender renders (scene=cornell, scene=blend)."
)


@dataclass(frozen=True)
class Cloud:
    """M surface points in numpy float64.

    Attributes:
        points: (M, 3) scene units.
        normals: (M, 3) unit vectors towards the side from which the points were seen.
    """

    points: np.ndarray
    normals: np.ndarray

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, index: np.ndarray | slice) -> Cloud:
        return Cloud(self.points[index], self.normals[index])


def cloud_from_views(
    views: Sequence[View],
    *,
    normals: NormalSource = "auto",
    least_cosine: float = 0.08,
    where: str | Path = "the training views",
) -> Cloud:
    """The surface points behind the pixels of all views that have depth.

    Args:
        views: at least one with `depth`; the others are passed over.
        normals: where a view's normals come from.
        least_cosine: surfaces seen at a smaller cosine are left out, as depth says little about them.
        where: the dataset, for errors.

    Raises:
        InputError: no view has depth, none sees a surface, a depth is not positive, or
            `normals="pass"` and a view has no normals.
    """
    with_depth = [view for view in views if view.depth is not None]
    if not with_depth:
        listed = ", ".join(view.name for view in views[:3]) + (", …" if len(views) > 3 else "")
        found = f"no depth in any of its {len(views)} views ({listed})" if views else "no views"
        raise InputError(where, expected="training views with a depth map", found=found, remedy=DEPTH_HELP)
    parts = [_back_project(view, normals, least_cosine, where) for view in track(with_depth, "depth", unit="view")]
    cloud = Cloud(np.concatenate([p.points for p in parts]), np.concatenate([p.normals for p in parts]))
    if not len(cloud):
        raise InputError(
            where,
            expected="depth maps that show surfaces",
            found=f"no pixel of {len(with_depth)} depth maps on a surface (all infinite, or without a planar patch)",
            remedy="Check that the cameras look at the scene, that depth is in scene units, and that only the "
            "background is infinite.",
        )
    return cloud


def _back_project(view: View, source: NormalSource, least_cosine: float, where: str | Path) -> Cloud:
    """The points of one view, in world axes."""
    depth = view.depth.detach().cpu().double().numpy()
    bad = depth <= 0
    if bad.any():
        row, column = (int(index) for index in np.argwhere(bad)[0])
        raise InputError(
            f"{where}: {view.name}",
            expected="positive depth, infinite where there is no surface, NaN where it is not known",
            found=f"{int(bad.sum())} pixels that are not, the first {depth[row, column]} in row {row}, column {column}",
            remedy="Export the depth map again.",
        )
    normals, valid = _world_normals(view, depth, source, where)
    origins, directions, lengths = (part.numpy() for part in view.camera.rays())
    directions = directions.reshape(*depth.shape, 3)
    keep = valid & (-(normals * directions).sum(axis=-1) > least_cosine)
    distance = lengths.reshape(depth.shape)[keep] * depth[keep]
    return Cloud(origins[0] + directions[keep] * distance[:, None], normals[keep])


def _world_normals(
    view: View, depth: np.ndarray, source: NormalSource, where: str | Path
) -> tuple[np.ndarray, np.ndarray]:
    """(H, W, 3) world normals of one view and the mask of the pixels that have one."""
    if source == "estimate" or (source == "auto" and view.normal is None):
        camera = view.camera
        local, valid = normals_from_depth(depth, (camera.fx, camera.fy), (camera.cx, camera.cy))
        return local @ camera.camera_to_world[:3, :3].double().numpy().T, valid
    if view.normal is None:
        raise InputError(
            f"{where}: {view.name}",
            expected="a normal pass, as init.normals=pass asks for",
            found="none",
            remedy='Give its frame a "normal_path", or use init.normals=estimate.',
        )
    normals = view.normal.detach().cpu().double().numpy()
    length = np.linalg.norm(normals, axis=-1)
    valid = np.isfinite(depth) & (length > 0.5)
    return normals / np.where(valid, length, 1.0)[..., None], valid
