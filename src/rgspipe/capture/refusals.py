"""Photographs that say nothing of lamps, refused in a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from rgspipe.capture.exposures import Cameras
from rgspipe.capture.photographs import SHOWN, Numbers
from rgspipe.datasets.exif_exposure import check_exposures
from rgspipe.datasets.views import View
from rgspipe.errors import InputError
from rgspipe.renderer.view_weights import ViewWeights

#: Surfels that two photographs have to share for one exposure to follow from the other.
SHARED = 10

#: Exposures that differ by this factor, one stop, less rounding, tell a curve.
BRACKET = 1.9

#: Name of the lighting in which all lamps are off.
OFF = "off"

#: Least part of the surfels that has to be measured, and to be brighter than DARK times the brightest pixel.
LEAST_MEASURED, DARK = 0.05, 1e-4


def check_views(views: Sequence[View], where: str | Path) -> None:
    """Refuse photographs with lights of their own.

    Raises:
        InputError: there is no photograph, all are black, or one has a known light.
    """
    if not views:
        raise InputError(where, expected="photographs", found="none", remedy="Add some to transforms_train.json.")
    if not max(float(view.image.max()) for view in views) > 0.0:
        raise _black(where)
    lit = [view for view in views if view.light is not None]
    if lit:
        raise InputError(
            where,
            expected="photographs that were taken while the same unknown lamps were on (rg.capture_scene(views))",
            found=f"{len(lit)} of {len(views)} with a known light of their own, such as {lit[0].name}",
            remedy="Train on them instead (rg.train(views)), or take pl_pos and pl_intensity out of "
            "transforms_train.json if they mean nothing.",
        )


def check_lightings(views: Sequence[View], exposure: str, response: str, where: str | Path) -> None:
    """Refuse photographs with the lamps off that are alone, and lightings or exposures that cannot be compared.

    Raises:
        InputError: says which.
    """
    names = {view.lighting for view in views}
    if names == {OFF}:
        raise InputError(
            where,
            expected="photographs with lamps on beside those with all of them off",
            found="only the latter",
            remedy="Add them (ScanOptions.others), or name the lighting otherwise if something was on.",
        )
    if OFF in names and exposure != "same":
        raise InputError(
            "CaptureOptions.exposure",
            expected="same, so that what shines with the lamps off can be taken away",
            found=exposure,
            remedy="Expose all photographs alike, or leave those with the lamps off out.",
        )
    if len(names) > 1 and response == "free":
        # Each lighting's photographs give a curve of their own, in a unit of its own.
        raise InputError(
            "CaptureOptions.response",
            expected="known, so that several lightings can be compared",
            found=response,
            remedy="Leave CaptureOptions(response='known'), and say which curve levels have: "
            "ScanOptions(response='srgb') or ScanOptions(response='linear').",
        )
    if exposure == "same":
        remedy = "Let CaptureOptions(exposure='free') find them, or photograph all with one exposure."
        check_exposures([(view.name, view.exposure) for view in views], where, remedy)


def check_brackets(views: Sequence[View], exposure: str) -> None:
    """Refuse photographs that tell nothing of their camera's curve.

    Raises:
        InputError: exposures are not known, or do not differ, or images have no levels.
    """
    whites = np.array([np.nan if view.saturated_from is None else view.saturated_from for view in views])
    found = None
    if exposure != "same":
        found = f"CaptureOptions(exposure={exposure!r}): of unknown exposures a curve is known only up to a power"
    elif np.isnan(whites).any():
        found = "images that do not say what white is, as floating point"
    elif whites.max() < BRACKET * whites.min():
        found = f"exposures that differ by a factor of {whites.max() / whites.min():.2f} at most"
    if found is not None:
        raise InputError(
            "CaptureOptions.response",
            expected="photographs in 8 or 16 bits whose exposures are known (EXIF), and differ by a stop or more: the "
            "same surfaces at other levels are what a curve is told by",
            found=found,
            remedy="Photograph some views at two exposures, with shutter, aperture and ISO in the files, or leave "
            "CaptureOptions(response='known').",
        )


def check_overlap(weights: Sequence[ViewWeights], where: str | Path) -> None:
    """Refuse photographs of unknown exposure that share nothing.

    Raises:
        InputError: some show no surface that any of the others shows.
    """
    shown = sp.vstack([sp.csr_matrix(view.operator.to_scipy().sum(axis=0)) for view in weights])
    shown = (shown > SHOWN).astype(np.int64)
    shared = (shown @ shown.T).toarray() >= SHARED
    groups, labels = connected_components(sp.csr_matrix(shared), directed=False)
    if groups > 1:
        sizes = sorted(np.bincount(labels).tolist(), reverse=True)
        raise InputError(
            where,
            expected="photographs that show the same surfaces as others do, so that their exposures follow",
            found=f"{groups} groups of {', '.join(map(str, sizes))} photographs that share nothing",
            remedy="Add photographs in between, or expose all alike (CaptureOptions(exposure='same')).",
        )


def check_alike(exposures: Mapping[str, Cameras], where: str | Path) -> None:
    """Refuse photographs with the lamps off where some turn out to be exposed in ways of their own.

    Args:
        exposures: of the photographs of each lighting.

    Raises:
        InputError: says which lighting.
    """
    apart = [name or "the first one" for name, cameras in exposures.items() if cameras.exposure != "same"]
    if apart:
        raise InputError(
            where,
            expected="one exposure for all photographs, so that what shines with the lamps off can be taken away",
            found=f"photographs that differ in it, by the surfaces that they share, in lighting {', '.join(apart)}",
            remedy="Expose all photographs alike, with one white balance, or leave those with the lamps off out.",
        )


def check_measured(seen: np.ndarray, radiance: Numbers, views: Sequence[View], where: str | Path) -> None:
    """Refuse photographs that measure no radiance.

    Args:
        seen: (N,) bool, surfels that were measured.
        radiance: (N, 3) of them.

    Raises:
        InputError: next to all is saturated or outside of the surfaces, or all is black.
    """
    clipped = float(np.mean([float(view.saturated.any(dim=-1).double().mean()) for view in views]))
    if seen.mean() < LEAST_MEASURED:
        raise InputError(
            where,
            expected="photographs that tell how bright the surfaces are",
            found=f"{100 * clipped:.0f} % of the pixels saturated, and {100 * float(seen.mean()):.0f} % of the "
            "surfaces measured",
            remedy="Expose less, or use linear EXR; check the poses if nothing is saturated.",
        )
    brightest = max(float(view.image.max()) for view in views)
    if not (radiance[seen].mean(axis=1) > DARK * brightest).mean() > LEAST_MEASURED:
        raise _black(where)


def _black(where: str | Path) -> InputError:
    return InputError(
        where,
        expected="photographs of surfaces that light falls on",
        found="images that are black, but for some pixels at most",
        remedy="Switch the lamps on, or expose more; walls that reflect nothing tell nothing of lamps.",
    )
