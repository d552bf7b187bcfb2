"""Our surfels in the PLY layout that 3DGS viewers open; what that layout cannot hold goes into properties of our own.

Viewers that read properties by name pass over ours. Those that expect exactly the properties of 3DGS in their order
need the layout "viewer", from which only part of a scene comes back.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, get_args

import numpy as np
import torch
from scipy.special import expit, logit
from torch import Tensor

from rgspipe.arguments import as_file, as_one_of
from rgspipe.datasets.conversion import Conversion, Loss, loss
from rgspipe.datasets.json_file import is_number
from rgspipe.datasets.ply.gaussians import HIGH, LOW, Y0, unit_quaternions
from rgspipe.datasets.ply.options import PlyOptions
from rgspipe.datasets.ply.table import VertexTable, write_vertices
from rgspipe.errors import InputError
from rgspipe.names import SurfelLayout
from rgspipe.scene import srgb
from rgspipe.scene.arrays import ArrayLike, as_tensor, check_finite
from rgspipe.scene.gloss import Gloss
from rgspipe.scene.spacing import inferred_coverage
from rgspipe.scene.surfels import NO_CLIP, Coverage, Surfels, quaternion_to_axes
from rgspipe.store.strict_json import parse_json

#: The comment that marks our files, followed by JSON.
MARK = "rgspipe-surfels"
VERSION = 1

#: Said of a file that another program wrote with our properties.
LOST_COMMENT = (
    f"The comment {MARK} is gone, which says how surfels cover: inferred as thresholds {{:g}} and {{:g}}, layers of "
    "{:.3g} (PlyOptions.low, high and layer change that). Edits of colours are passed over."
)

#: Third log-scale: so thin that viewers of 3DGS draw a disc.
THIN = float(np.log(1e-6))

#: Viewers take logits: opacities 0 and 1 have none.
OPACITY_RANGE = (1e-6, 1.0 - 1e-6)

#: Centres that the file moves by more of their surfel's smaller scale are reported.
MOVED = 1e-3

#: Coefficients beyond the constant that a file of degree 3 has.
REST = 45

OWN = {
    "scales": ("surfel_scale_0", "surfel_scale_1"),
    "opacities": ("surfel_opacity",),
    "albedo": ("albedo_0", "albedo_1", "albedo_2"),
    "clip_offsets": ("clip_offset_0", "clip_offset_1"),
    "clip_angles": ("clip_angle_0", "clip_angle_1"),
}
#: Only in files of scenes that were closed where no camera saw what is there.
OWN_GUESSED = "guessed"
OWN_GLOSS = {"reflectance": ("gloss_0", "gloss_1", "gloss_2"), "exponents": ("gloss_exponent",)}


def save_ply(
    path: str | Path, surfels: Surfels, *, radiance: ArrayLike | None = None, layout: SurfelLayout = "full"
) -> Conversion:
    """Write surfels as a PLY file that 3DGS viewers open.

    Args:
        radiance: (N, 3) linear, shown instead of the albedo; its 99.5th percentile becomes white.
        layout: "full" comes back as it was; "viewer" has only what 3DGS has, in its order.

    Returns:
        what a viewer does not show, and for "viewer" what the file does not hold.

    Raises:
        InputError: no path of a file, no surfels, none of them, or some with impossible numbers (`Surfels.check`);
            `radiance` is of another number of surfels, or not finite; or a layout of another name.
    """
    path = as_file(path, "surfels.ply")
    as_one_of(surfels, Surfels, "surfels", "Pass those of a scene: scene.surfels.").check()
    surfels = surfels.detached()
    if not len(surfels):
        raise InputError("surfels", expected="some of them", found="none", remedy="Pass those of a scene.")
    if layout not in get_args(SurfelLayout):
        expected = " or ".join(get_args(SurfelLayout))
        raise InputError("layout", expected=expected, found=repr(layout)[:80], remedy="Choose one of them.")
    if radiance is not None:
        radiance = as_tensor(radiance, "radiance", (len(surfels), 3))
        check_finite(radiance, "radiance", "Look where it was made.")
    shown, colour_losses = _shown(surfels, radiance)
    columns = _viewer_columns(surfels, shown, REST if layout == "viewer" else 0)
    comments = []
    if layout == "full":
        columns |= _own_columns(surfels)
        note = {
            "version": VERSION,
            "coverage": asdict(surfels.coverage),
            "colours": "albedo" if radiance is None else "radiance",
        }
        comments.append(f"{MARK} {json.dumps(note)}")
    write_vertices(path, columns, comments)
    where = "a viewer does not draw" if layout == "full" else "the file does not hold"
    return Conversion.of(path, f"{layout} layout", len(surfels), [*_unseen(surfels, where), *colour_losses], [])


def is_own(table: VertexTable) -> bool:
    """Whether a file has our properties; programs that do not know those may leave them away, or just our comment."""
    return all(name in table.names for names in OWN.values() for name in names)


def read_own(table: VertexTable, options: PlyOptions) -> tuple[Surfels, Conversion]:
    """The surfels that `save_ply` wrote in full, with what was edited since in the properties that viewers know.

    Where another program kept our properties and lost our comment, the coverage is inferred with the thresholds of
    `options`, or else those of Gaussians.

    Raises:
        InputError: a property is missing, or has impossible values.
    """
    note = None if _mark(table) is None else _note(table)
    own = {name: table.columns(*names) for name, names in OWN.items()}
    scales, resized = _unless_edited(
        own["scales"], table.columns("scale_0", "scale_1"), lambda x: np.log(np.maximum(x, 1e-30)), np.exp
    )
    opacities, faded = _unless_edited(
        own["opacities"], table.columns("opacity"), lambda x: logit(np.clip(x, *OPACITY_RANGE)), expit
    )
    albedo, painted = own["albedo"], np.zeros(len(table))
    if note is not None and note.get("colours") == "albedo":
        stored = table.columns("f_dc_0", "f_dc_1", "f_dc_2")
        albedo, painted = _unless_edited(
            albedo, stored, _constant, lambda dc: srgb.decode(np.clip(0.5 + Y0 * dc, 0.0, 1.0))
        )
    tensors = {
        "centers": table.columns("x", "y", "z"),
        "rotations": _rotations(table),
        "scales": scales,
        "opacities": opacities[:, 0],
        "albedo": albedo,
        "clip_offsets": own["clip_offsets"],
        "clip_angles": own["clip_angles"],
    }
    if OWN_GUESSED in table.names:
        tensors["guessed"] = table.columns(OWN_GUESSED)[:, 0]
    parts = {name: torch.from_numpy(values).float() for name, values in tensors.items()}
    coverage = _inferred(table, parts, options) if note is None else _noted(table, note)
    surfels = _with_gloss(Surfels(**parts, coverage=coverage, gloss=None), table)
    edits = [
        loss("scales were edited since: edges and coverage are as before", resized, 0.0, "largest step of log-scale"),
        loss("opacities were edited since", faded, 0.0, "largest step of the logit"),
        loss("colours were edited since and count as albedo", painted, 0.0, "largest step of f_dc"),
    ]
    notes = [] if note is not None else [LOST_COMMENT.format(coverage.low, coverage.high, coverage.layer_thickness)]
    return surfels, Conversion.of(table.path, "surfels of this program", len(surfels), edits, notes)


def _noted(table: VertexTable, note: Mapping[str, Any]) -> Coverage:
    try:
        return Coverage(**note["coverage"])
    except (TypeError, ValueError) as error:
        where = f"{table.path}: comment {MARK}"
        raise InputError(where, expected="coverage", found=str(error), remedy="Export the file again.") from error


def _inferred(table: VertexTable, parts: Mapping[str, Tensor], options: PlyOptions) -> Coverage:
    try:
        return inferred_coverage(
            parts["centers"],
            quaternion_to_axes(parts["rotations"])[:, 2],
            parts["scales"],
            low=LOW if options.low is None else options.low,
            high=HIGH if options.high is None else options.high,
            layer=options.layer,
            minimum_alpha=options.minimum_alpha,
        )
    except ValueError as error:
        raise InputError(
            table.path, expected="surfels that lie on surfaces", found=str(error), remedy="Export the file again."
        ) from error


def _unless_edited(
    own: np.ndarray,
    stored: np.ndarray,
    encode: Callable[[np.ndarray], np.ndarray],
    decode: Callable[[np.ndarray], np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Our exact values (N, K), or decoded ones where the stored ones are not theirs; and how far those are off (N,)."""
    step = np.abs(encode(own) - stored)
    edited = (step > 1e-4 * np.maximum(1.0, np.abs(stored))).any(axis=1)
    return np.where(edited[:, None], decode(stored), own), np.where(edited, step.max(axis=1), 0.0)


def _rotations(table: VertexTable) -> np.ndarray:
    """As stored if they are unit quaternions already, so that they come back exactly."""
    unit, stored = unit_quaternions(table), table.columns("rot_0", "rot_1", "rot_2", "rot_3")
    return np.where(np.abs(unit - stored).max(axis=1, keepdims=True) < 1e-5, stored, unit)


def _mark(table: VertexTable) -> str | None:
    return next((line for line in table.comments if line.split(" ")[0] == MARK), None)


def _note(table: VertexTable) -> Mapping[str, Any]:
    where = f"{table.path}: comment {MARK}"
    try:
        note = parse_json((_mark(table) or "").partition(" ")[2])
    except ValueError:
        note = None
    values = note.get("coverage") if isinstance(note, dict) and note.get("version") == VERSION else None
    if not isinstance(values, dict) or not all(map(is_number, values.values())):
        expected = f"version {VERSION} with the numbers of the coverage"
        raise InputError(where, expected=expected, found=str(note)[:120], remedy="Export the file again.")
    return note


def _with_gloss(surfels: Surfels, table: VertexTable) -> Surfels:
    names = [name for group in OWN_GLOSS.values() for name in group]
    if not any(name in table.names for name in names):
        return surfels
    values = torch.from_numpy(table.columns(*names)).float()
    gloss = Gloss(values[:, :3].contiguous(), values[:, 3].contiguous())
    try:
        gloss.check(surfels.albedo)
    except ValueError as error:
        raise table.error(names[0], "gloss that makes no energy", str(error)) from error
    return Surfels(**surfels.tensors(), coverage=surfels.coverage, gloss=gloss)


def _shown(surfels: Surfels, radiance: Tensor | None) -> tuple[np.ndarray, list[Loss]]:
    """(N, 3) linear colours in [0, 1] for viewers."""
    if radiance is None:
        return surfels.albedo.detach().double().cpu().numpy(), []
    values = radiance.detach().double().cpu().numpy()
    values = values / max(float(np.quantile(values, 0.995)), 1e-30)
    over = loss("brighter than white", values.max(axis=1) - 1.0, 1e-6, "largest excess over white")
    return np.clip(values, 0.0, 1.0), [over]


def _constant(linear: np.ndarray) -> np.ndarray:
    """f_dc of linear colours."""
    return (srgb.encode(linear) - 0.5) / Y0


def _viewer_columns(surfels: Surfels, shown: np.ndarray, rest: int) -> dict[str, np.ndarray]:
    """The properties of 3DGS, in its order."""
    count = len(surfels)
    flat = {name: tensor.detach().double().cpu().numpy() for name, tensor in surfels.tensors().items()}
    columns = dict(zip("xyz", flat["centers"].T, strict=True))
    columns |= dict(zip(("nx", "ny", "nz"), surfels.normals.detach().double().cpu().numpy().T, strict=True))
    columns |= {f"f_dc_{index}": column for index, column in enumerate(_constant(shown).T)}
    columns |= {f"f_rest_{index}": np.zeros(count) for index in range(rest)}
    columns["opacity"] = logit(np.clip(flat["opacities"], *OPACITY_RANGE))
    columns |= {f"scale_{i}": column for i, column in enumerate(np.log(np.maximum(flat["scales"], 1e-30)).T)}
    columns["scale_2"] = np.full(count, THIN)
    return columns | {f"rot_{index}": column for index, column in enumerate(flat["rotations"].T)}


def _own_columns(surfels: Surfels) -> dict[str, np.ndarray]:
    tensors = {names: getattr(surfels, field) for field, names in OWN.items()}
    if surfels.gloss is not None:
        tensors |= {names: getattr(surfels.gloss, field) for field, names in OWN_GLOSS.items()}
    if bool(surfels.guessed.any()):
        tensors[(OWN_GUESSED,)] = surfels.guessed
    columns = {}
    for names, tensor in tensors.items():
        values = tensor.detach().cpu().numpy().reshape(len(surfels), -1)
        columns |= dict(zip(names, values.T, strict=True))
    return columns


def _unseen(surfels: Surfels, where: str) -> list[Loss]:
    """What the layout of 3DGS has no place for."""
    clips = (surfels.clip_offsets < NO_CLIP).sum(dim=1).double().numpy()
    low = np.full(len(surfels), surfels.coverage.low)
    losses = [
        loss(f"straight edges: {where} them, so surfels hang over", clips, 0.0, "most edges of a surfel"),
        loss(f"coverage: {where} it, so surfaces look softer", low, -1.0, "opacity that counts as none"),
        _rounded(surfels),
    ]
    if surfels.gloss is not None:
        size = surfels.gloss.reflectance.amax(dim=1).double().cpu().numpy()
        losses.append(loss(f"gloss: {where} it", size, 0.0, "largest specular reflectance"))
    guessed = surfels.guessed.double().cpu().numpy()
    losses.append(loss(f"surfels that are guessed: {where} that they are", guessed, 0.0, "largest doubt of log albedo"))
    return losses


def _rounded(surfels: Surfels) -> Loss:
    """What float32, which PLY viewers read, leaves of centres in double precision far from the origin."""
    moved = (surfels.centers.float().double() - surfels.centers.double()).norm(dim=1)
    size = (moved / surfels.scales.double().amin(dim=1)).cpu().numpy()
    what = "centres: the file rounds them to float32, so move the scene near the origin"
    return loss(what, size, MOVED, "moved at most, in parts of its smaller scale,")
