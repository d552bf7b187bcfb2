"""From views with depth to what their pixels saw."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.names import NormalSource
from rgspipe.progress import progress_bar
from rgspipe.training.initialise.depth_noise import relative_noise
from rgspipe.training.initialise.normals import normals_from_depth
from rgspipe.training.initialise.sightings import EXACT, Sightings, joined
from rgspipe.training.initialise.thin_things import with_thin_things

#: 1/ρ and 1/ρ² of the plastic number ρ, the root of ρ³ = ρ + 1: steps whose multiples fill the unit square evenly.
PLASTIC = (0.7548776662466927, 0.5698402909980532)

#: A fitted distance that is farther from the measured one, in standard deviations, is of another surface.
OUTLIER = 5.0

DEPTH_HELP = (
    'Give the frames of transforms_train.json a "depth_path" and name the "depth_convention" (planar_z or '
    "ray_distance) in dataset_info.json, or use a scene that Blender renders (render_dataset(job))."
)


def see_surfaces(
    views: Sequence[View],
    *,
    normals: NormalSource = "auto",
    least_cosine: float = 0.08,
    most: float = math.inf,
    where: str | Path = "the training views",
) -> Sightings:
    """What the pixels saw of all views that have depth, each view by itself.

    Args:
        views: at least one with `depth`; the others are passed over.
        normals: where a view's normals come from.
        least_cosine: surfaces seen at a smaller cosine are left out, as depth says little about them.
        most: sightings that are wanted, about; of more pixels an even part is kept.
        where: the dataset, for errors.

    Raises:
        InputError: no view has depth, none sees a surface, a depth is not positive, or `normals="pass"` and a view
            has no normals.
    """
    with_depth = [view for view in views if view.depth is not None]
    if not with_depth:
        listed = ", ".join(view.name for view in views[:3]) + (", …" if len(views) > 3 else "")
        found = f"no depth in any of its {len(views)} views ({listed})" if views else "no views"
        raise InputError(where, expected="training views with a depth map", found=found, remedy=DEPTH_HELP)
    share = most / sum(view.depth.numel() for view in with_depth)
    shown = progress_bar(with_depth, "depth", unit="view")
    parts = [_see(view, normals, least_cosine, share, where) for view in shown]
    sure, rest, pixels = zip(*parts, strict=True)
    seen = with_thin_things(joined(sure), joined(rest), np.concatenate(pixels))
    if not len(seen):
        raise InputError(
            where,
            expected="depth maps that show surfaces",
            found=f"no pixel of {len(with_depth)} depth maps on a surface (all infinite or unknown)",
            remedy="Check that the cameras look at the scene, that depth is in scene units, and that only the "
            "background is infinite.",
        )
    return seen


def _see(
    view: View, source: NormalSource, least_cosine: float, share: float, where: str | Path
) -> tuple[Sightings, Sightings, np.ndarray]:
    """What a share of the pixels of one view saw, in world axes; what those saw of which no window tells the normal;
    and how wide a pixel is where these are, scene units.
    """
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
    noise = relative_noise(depth)
    noise = noise if noise > EXACT else 0.0
    fitted, normals, valid, given = _surface(view, depth, source, noise, where)
    origins, directions, lengths = (part.numpy() for part in view.camera.rays())
    directions, lengths = directions.reshape(*depth.shape, 3), lengths.reshape(depth.shape)
    kept = _even_part(depth.shape, share)
    faces = -(normals * directions).sum(axis=-1) > least_cosine

    def of(keep: np.ndarray, distances: np.ndarray) -> Sightings:
        measured, count = lengths[keep] * depth[keep], int(keep.sum())
        return Sightings(
            origins=np.repeat(origins[:1], count, axis=0),
            directions=directions[keep],
            measured=measured,
            deviations=max(noise, EXACT) * measured,
            distances=lengths[keep] * distances[keep],
            normals=normals[keep],
            given=np.full(count, given),
        )

    # A pass that has no normal somewhere says that there is no surface.
    rest = of(kept & np.isfinite(depth) & ~valid & (not given), depth)
    return of(kept & valid & faces, fitted), rest, rest.measured / math.sqrt(view.camera.fx * view.camera.fy)


def _even_part(shape: tuple[int, int], share: float) -> np.ndarray:
    """(H, W) bool, true for an evenly spread share of the pixels: the sequence R2 of Roberts (2018)."""
    row, column = np.indices(shape)
    return np.modf(row * PLASTIC[0] + column * PLASTIC[1])[0] < share


def _surface(
    view: View, depth: np.ndarray, source: NormalSource, noise: float, where: str | Path
) -> tuple[np.ndarray, np.ndarray, np.ndarray, bool]:
    """Depth (H, W), smoothed if it is noisy, world normals (H, W, 3), the pixels with both, and whether normals are
    the pass's.
    """
    given = source == "pass" or (source == "auto" and view.normal is not None)
    normals, valid, fitted = np.zeros((*depth.shape, 3)), np.isfinite(depth), depth
    if noise > 0 or not given:
        camera = view.camera
        fits = normals_from_depth(depth, (camera.fx, camera.fy), (camera.cx, camera.cy))
        near = fits.valid & (np.abs(fits.depth - np.where(valid, depth, 0.0)) <= OUTLIER * noise * fits.depth)
        fitted = np.where(near, fits.depth, depth) if noise > 0 else depth
        if not given:
            valid = near if noise > 0 else fits.valid
            normals = fits.normals @ camera.camera_to_world[:3, :3].double().numpy().T
    if given:
        normals, with_normal = _pass(view, where)
        valid = valid & with_normal
    return fitted, normals, valid, given


def _pass(view: View, where: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """(H, W, 3) unit normals of the view's pass and the mask of the pixels that have one."""
    if view.normal is None:
        raise InputError(
            f"{where}: {view.name}",
            expected="a normal pass, as initialise_surfels(normals='pass') asks for",
            found="none",
            remedy="Give its frame a \"normal_path\", or use initialise_surfels(normals='estimate').",
        )
    normals = view.normal.detach().cpu().double().numpy()
    length = np.linalg.norm(normals, axis=-1)
    valid = length > 0.5
    return normals / np.where(valid, length, 1.0)[..., None], valid
