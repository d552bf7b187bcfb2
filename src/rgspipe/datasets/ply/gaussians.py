"""Gaussians in the PLY layout of 3DGS (Kerbl et al. 2023) and 2DGS (Huang et al. 2024), read as surfels.

Log-scales, logit opacity, quaternion (w, x, y, z), colour in spherical harmonics of which f_dc_* is the constant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from rgspipe.datasets.conversion import Loss, loss
from rgspipe.datasets.opacity_profile import smoothstep
from rgspipe.datasets.ply.options import PlyOptions
from rgspipe.datasets.ply.table import VertexTable
from rgspipe.errors import InputError
from rgspipe.scene import srgb

#: The constant spherical harmonic, ½/√π; 3DGS stores (colour − ½)/Y₀.
Y0 = 0.5 / math.sqrt(math.pi)

#: Thresholds for Gaussians as they stand, a guess that little supports: in two views of one room that this program had
#: trained they kept 29.6 dB where 0 and 1 kept 27.2, and footprints fitted so that each covers alone what its opacity
#: says 25.5 (they grow, and hang over edges). Scenes that 3DGS trained were not at hand.
LOW, HIGH = 0.5, 0.9

#: Rotations that carry the axes (1, 2, 0), (2, 0, 1) and (0, 1, 2) to u, v and normal, by the axis that is dropped.
TURNS = np.array([[0.5, 0.5, 0.5, 0.5], [0.5, -0.5, -0.5, -0.5], [1.0, 0.0, 0.0, 0.0]])

#: Log-scales beyond leave float32.
LARGEST_LOG = 80.0

#: What only files that PlayCanvas's tools packed into 16 bytes a Gaussian have.
COMPRESSED = "packed_position"

#: A Gaussian is flat if its smallest deviation is below this share of the next one.
FLAT = 0.1


@dataclass(frozen=True)
class Discs:
    """Flat footprints as they stand in a file, numpy float64.

    Attributes:
        centers: (N, 3); rotations: (N, 4) unit quaternions (w, x, y, z); scales: (N, 2); opacities: (N,);
            albedo: (N, 3) in [0, 1].
        reflectance: (N, 3) k_s of a Phong lobe, or None.
        exponents: (N,) n of the lobe, or None.
        low, high: thresholds of the coverage that opacities and scales were fitted with.
        layout: in words.
        losses, notes: see Conversion.
    """

    centers: np.ndarray
    rotations: np.ndarray
    scales: np.ndarray
    opacities: np.ndarray
    albedo: np.ndarray
    low: float
    high: float
    layout: str
    losses: list[Loss]
    notes: list[str]
    reflectance: np.ndarray | None = None
    exponents: np.ndarray | None = None


def read_gaussians(table: VertexTable, options: PlyOptions) -> Discs:
    """The Gaussians of a 3DGS or 2DGS file as discs.

    The smallest of three scales is dropped, the colour of degree 0 is taken as albedo.

    Raises:
        InputError: a property is missing or has impossible values.
    """
    if COMPRESSED in table.names:
        raise InputError(
            f"{table.path}: element vertex, property {COMPRESSED}",
            expected="Gaussians with a property for each number",
            found="the compressed layout of PlayCanvas",
            remedy="Save it as a plain PLY: SuperSplat exports one, and splat-transform IN.compressed.ply OUT.ply.",
        )
    names = table.numbered("scale_")
    if len(names) not in (2, 3):
        raise table.error("scale_0", "2 or 3 log-scales", f"{len(names)} scales")
    scales = exponentials(table, *names)
    rotations, flat, thick = _flattened(unit_quaternions(table), scales)
    low = LOW if options.low is None else options.low
    high = HIGH if options.high is None else options.high
    opacities = expit(table.columns("opacity")[:, 0])
    albedo, colour_losses = _albedo(table, options)
    layout = "2DGS" if scales.shape[1] == 2 else "3DGS"
    losses = [
        loss("thickness along the normal is left out", thick, FLAT, "largest share of the next scale"),
        *colour_losses,
        loss("layers are sharpened", _sharpened(opacities, low, high), 0.01, "largest step of one's covered share"),
    ]
    encoding = "sRGB display values" if options.srgb else "linear"
    notes = [
        f"Colours (as {encoding}) are taken as albedo: they hold the light of the capture, which training would "
        "have told apart from the material."
    ]
    return Discs(
        table.columns("x", "y", "z"),
        rotations,
        flat,
        opacities,
        albedo,
        low,
        high,
        f"{layout} Gaussians",
        losses,
        notes,
    )


def exponentials(table: VertexTable, *names: str) -> np.ndarray:
    """(N, len(names)) scales of log-scales.

    Raises:
        InputError: one is missing, or 0 or infinite in float32.
    """
    stored = table.columns(*names)
    if (np.abs(stored) > LARGEST_LOG).any():
        found = f"up to {np.abs(stored).max():g}"
        raise table.error(names[0], f"log-scales within ±{LARGEST_LOG:g}", found)
    return np.exp(stored)


def unit_quaternions(table: VertexTable) -> np.ndarray:
    """(N, 4) the rotations of a file, normalised.

    Raises:
        InputError: one is missing or has no length.
    """
    rotations = table.columns("rot_0", "rot_1", "rot_2", "rot_3")
    length = np.linalg.norm(rotations, axis=1, keepdims=True)
    if (length < 1e-12).any():
        row = int(np.flatnonzero(length[:, 0] < 1e-12)[0])
        raise table.error("rot_0", "quaternions with a length", f"0, 0, 0, 0 in row {row}")
    return rotations / length


def _flattened(rotations: np.ndarray, scales: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotations whose third axis is the thinnest one, the two other scales, and the thickness over the smaller one."""
    if scales.shape[1] == 2:
        return rotations, scales, np.zeros(len(scales))
    thinnest = np.where(scales[:, 2] <= scales.min(axis=1), 2, scales.argmin(axis=1))
    others = (thinnest[:, None] + np.array([1, 2])) % 3
    kept = np.take_along_axis(scales, others, axis=1)
    thickness = np.take_along_axis(scales, thinnest[:, None], axis=1)[:, 0]
    return _product(rotations, TURNS[thinnest]), kept, thickness / kept.min(axis=1)


def _product(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(N, 4) quaternion products: `second` is turned first."""
    a, b, c, d = first.T
    w, x, y, z = second.T
    return np.stack(
        [
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ],
        axis=1,
    )


def _sharpened(opacities: np.ndarray, low: float, high: float) -> np.ndarray:
    """(N,) how far the covered share of a Gaussian that lies alone is from its opacity, anywhere in its footprint."""
    alpha = np.linspace(0.0, 1.0, 257)
    reached = np.maximum.accumulate(np.abs(smoothstep(low, high, alpha) - alpha))
    return np.interp(opacities, alpha, reached)


def _albedo(table: VertexTable, options: PlyOptions) -> tuple[np.ndarray, list[Loss]]:
    colour = 0.5 + Y0 * table.columns("f_dc_0", "f_dc_1", "f_dc_2")
    outside = np.maximum(-colour, colour - 1.0).max(axis=1)
    losses = [loss("colours are brought into 0 to 1", outside, 1e-3, "largest distance")]
    if any(name.startswith("f_rest_") for name in table.names):
        losses.append(loss("view-dependent colour is left out", _variation(table), 1e-3, "largest rms over directions"))
    clamped = np.clip(colour, 0.0, 1.0)
    return (srgb.decode(clamped) if options.srgb else clamped), losses


def _variation(table: VertexTable) -> np.ndarray:
    """(N,) rms over directions and channels of the colour that f_rest_* adds."""
    square = np.empty(len(table))
    for rows, rest in table.blocks(*table.numbered("f_rest_")):
        square[rows] = np.einsum("nk,nk->n", rest, rest)
    # Harmonics are orthonormal over the sphere of 4π; a third of the coefficients belong to each channel.
    return np.sqrt(square / (3.0 * 4.0 * math.pi))
