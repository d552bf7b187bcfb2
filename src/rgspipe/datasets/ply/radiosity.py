"""Surfels in the PLY layout of RadiosityGS (Jiang et al. 2025), read as ours.

Stored are logits: shininess s_*, blending b_*, diffuse and specular albedo ad_* and as_*, geovalue, scales; the ranges
that they stand for are in the model's cfg_args. A surfel's opacity at (u, v) standard deviations is

    α = min(0.99, 1 − exp(−0.03279·g^3.4)) ,   g = geovalue · exp(−½(u² + v²))
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from scipy.special import expit

from rgspipe.datasets.conversion import Loss, loss
from rgspipe.datasets.input_file import input_file
from rgspipe.datasets.json_file import shown
from rgspipe.datasets.opacity_profile import FittedProfiles, fit_profiles, smoothstep
from rgspipe.datasets.ply.gaussians import Discs, exponentials, unit_quaternions
from rgspipe.datasets.ply.options import PlyOptions
from rgspipe.datasets.ply.table import VertexTable
from rgspipe.errors import InputError

#: What only this layout has.
MARKS = ("geovalue", "ad_0", "as_0", "b_0", "s_0")

#: Thresholds under which a sharpened Gaussian is most like the steep profile (rms 0.02 or less).
LOW, HIGH = 0.2, 0.9

CONFIG, LEVELS_UP = "cfg_args", 3

#: Bytes of the largest cfg_args that is read.
MOST_BYTES = 2**20

#: No number of cfg_args that matters is as large.
LARGEST_RANGE = 1e6


@dataclass(frozen=True)
class Ranges:
    """The part of a model's configuration that its PLY file is read with.

    Attributes:
        sh_degree: shininess goes up to (sh_degree + 1)²/2.5.
        max_scaling: the largest standard deviation; 0 for log-scales without a limit.
        geovalue_mul: the largest geovalue.
    """

    sh_degree: float = 9
    max_scaling: float = 0.05
    geovalue_mul: float = 5.0


def is_radiosity(table: VertexTable) -> bool:
    """Whether a file has this layout."""
    return all(name in table.names for name in MARKS)


def profile(geovalue: float, radii: np.ndarray) -> np.ndarray:
    """Opacity at radii in standard deviations."""
    g = geovalue * np.exp(-0.5 * radii * radii)
    return np.minimum(0.99, -np.expm1(-0.03279 * g**3.4))


def read_radiosity(table: VertexTable, options: PlyOptions) -> Discs:
    """The surfels of a RadiosityGS file as discs with gloss.

    Raises:
        InputError: a property is missing or has impossible values, or cfg_args cannot be used.
    """
    ranges, note = find_ranges(table.path)
    low = LOW if options.low is None else options.low
    high = HIGH if options.high is None else options.high
    geovalue = ranges.geovalue_mul * expit(table.columns("geovalue")[:, 0])
    fitted = fit_profiles(profile, geovalue, low, high)
    albedo, reflectance, exponents, losses = _materials(table, ranges)
    losses += _profile_losses(fitted, geovalue, low, high)
    if "norm_factor" in table.names:
        factor = np.abs(table.columns("norm_factor")[:, 0])
        losses.append(loss("the trained norm factor is left out: ours follows from areas", factor, 1e-6, "largest log"))
    if not options.gloss:
        losses.append(loss("gloss is left out", reflectance.max(axis=1), 1e-3, "largest specular reflectance"))
    notes = [note, "The file holds no lights: RadiosityGS keeps them elsewhere, and there are none to take over."]
    return Discs(
        table.columns("x", "y", "z"),
        unit_quaternions(table),
        _scales(table, ranges) * fitted.stretch[:, None],
        fitted.opacities,
        albedo,
        low,
        high,
        "RadiosityGS surfels",
        losses,
        notes,
        reflectance if options.gloss else None,
        exponents if options.gloss else None,
    )


def find_config(ply: Path) -> Path | None:
    """cfg_args of the model that a PLY file belongs to, if there is one."""
    folders = list(ply.resolve().parents)[: LEVELS_UP + 1]
    return next((folder / CONFIG for folder in folders if (folder / CONFIG).exists()), None)


def find_ranges(ply: Path) -> tuple[Ranges, str]:
    """The ranges of the model that a PLY file belongs to, and where they are from, in words.

    Raises:
        InputError: cfg_args is there and cannot be used.
    """
    config = find_config(ply)
    if config is not None:
        return _parse_ranges(config), f"Ranges are those of {config}."
    known = ", ".join(f"{item.name} {item.default:g}" for item in fields(Ranges))
    return Ranges(), f"There is no {CONFIG} with the model: its defaults are assumed ({known})."


def _parse_ranges(path: Path) -> Ranges:
    """The numbers in the text `Namespace(name=value, …)`, which is parsed and never run."""
    error = InputError(path, expected="Namespace(…) with numbers", found="something else", remedy="Correct the file.")
    input_file(path, "the configuration of a model", most_bytes=MOST_BYTES)
    try:
        call = ast.parse(path.read_text(encoding="utf-8").strip(), mode="eval").body
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "Namespace"):
            raise error
        given = [item.arg for item in call.keywords]
        if call.args or None in given or len(set(given)) < len(given):
            raise error
        names = {item.name for item in fields(Ranges)}
        found = {item.arg: ast.literal_eval(item.value) for item in call.keywords if item.arg in names}
    except (OSError, ValueError, SyntaxError, RecursionError, MemoryError) as cause:
        raise error from cause
    for name, value in found.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= LARGEST_RANGE:
            raise InputError(
                f"{path}: {name}",
                expected=f"a number from 0 to {LARGEST_RANGE:g}",
                found=shown(value),
                remedy="Correct it.",
            )
    return replace(Ranges(), **found)


def _scales(table: VertexTable, ranges: Ranges) -> np.ndarray:
    if ranges.max_scaling == 0:
        return exponentials(table, "scale_0", "scale_1")
    scales = ranges.max_scaling * expit(table.columns("scale_0", "scale_1"))
    if (scales == 0.0).any():
        raise table.error("scale_0", "logits of scales above 0", "scales of 0")
    return scales


def _materials(table: VertexTable, ranges: Ranges) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[Loss]]:
    """Albedo (N, 3), k_s (N, 3) and exponent (N,).

    Their lobe is a_s·(n + 1)/2π·cosⁿα, ours k_s·(n + 2)/2π·cosⁿα, with one exponent for all channels.
    """
    blending = expit(table.columns("b_0", "b_1", "b_2"))
    albedo = expit(table.columns("ad_0", "ad_1", "ad_2")) * blending
    specular = expit(table.columns("as_0", "as_1", "as_2")) * (1.0 - blending)
    shininess = (ranges.sh_degree + 1.0) ** 2 / 2.5 * expit(table.columns("s_0", "s_1", "s_2"))
    mean = (specular * shininess).sum(axis=1) / np.maximum(specular.sum(axis=1), 1e-12)
    exponents = np.maximum(mean, 1.0)
    shiny = specular.max(axis=1) > 1e-3
    spread = np.where(shiny, np.ptp(shininess, axis=1) / np.maximum(mean, 1e-12), 0.0)
    raised = np.where(shiny, 1.0 - mean, 0.0)
    reflectance = specular * ((exponents + 1.0) / (exponents + 2.0))[:, None]
    losses = [
        loss("one shininess for all channels, their mean", spread, 0.01, "largest spread over the mean"),
        loss("shininess is raised to 1", raised, 0.0, "largest step"),
        loss(
            "the lobe is exact instead of cut at the model's degree of harmonics",
            np.where(shiny, specular.max(axis=1), 0.0),
            0.0,
            "largest specular albedo",
        ),
    ]
    return albedo, reflectance, exponents, losses


def _profile_losses(fitted: FittedProfiles, geovalue: np.ndarray, low: float, high: float) -> list[Loss]:
    alone = fitted.largest
    peak = np.array([profile(g, np.zeros(1))[0] for g in np.linspace(0.0, geovalue.max(), 64)])
    single = np.interp(geovalue, np.linspace(0.0, geovalue.max(), 64), peak)
    doubled = np.abs(smoothstep(low, high, 1.0 - (1.0 - fitted.opacities) ** 2) - (1.0 - (1.0 - single) ** 2))
    return [
        loss("steep opacity profile replaced by a Gaussian", alone, 0.01, "largest difference of covered share"),
        loss("the same where two surfels coincide", doubled, 0.01, "largest difference of covered share"),
    ]
