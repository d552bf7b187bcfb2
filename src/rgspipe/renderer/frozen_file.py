"""A frozen scene as a folder: its surfels, its operators and its light dictionary, each in a safetensors file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from rgspipe.arguments import LARGEST_COUNT
from rgspipe.datasets.grade_file import GRADE, load_grade, save_grade
from rgspipe.datasets.input_file import is_there
from rgspipe.datasets.json_file import shown
from rgspipe.datasets.surfel_file import load_surfels, save_surfels
from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.errors import InputError
from rgspipe.renderer.dictionary import LightDictionary
from rgspipe.renderer.glossy_operators import OPERATOR_NAMES, PAIR_NAMES, Exchange, GlossyOperators
from rgspipe.renderer.glossy_transport import GlossyTransport
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.transport import PatchTransport
from rgspipe.scene.grade import SceneGrade
from rgspipe.scene.surfels import Surfels

#: Tensors of places, which are as exact as they are stored.
EXACT = ("centers", "positions")

SURFELS, GATHER, TRANSPORT, GLOSS, DICTIONARY = (
    f"{name}.safetensors" for name in ("surfels", "gather", "transport", "gloss", "dictionary")
)

#: Candidates along each axis of the finest dictionary: a search asks each of its million.
FINEST = 100

NAME_IT = "Name the folder that holds one: outputs/<scene>/freeze/latest, or what FrozenScene.save was given."

#: What to do about a scene with another solver than its own, which no file holds.
OWN_SOLVER = "Store the scene that with_solver was called on, and call it again on what is loaded."

MAKE_AGAIN = "Freeze the scene again: FrozenScene.freeze and save, or the stage freeze."


def save_parts(
    folder: Path,
    *,
    surfels: Surfels,
    areas: Tensor,
    centers: Tensor,
    gather: SparseOperator | None,
    transport: PatchTransport,
    gloss: GlossyTransport | None,
    candidates: LightDictionary | None,
    grade: SceneGrade | None,
) -> None:
    """Write the parts of a frozen scene; those that are None have no file."""
    folder.mkdir(parents=True, exist_ok=True)
    save_surfels(folder / SURFELS, surfels)
    operators = transport.average.tensors("average") | transport.gather.tensors("gather")
    more = {"inverse": transport.inverse, "areas": areas, "centers": centers}
    files = {TRANSPORT: (operators | more, {})}
    if gather is not None:
        files[GATHER] = gather.tensors("gather"), {}
    if gloss is not None:
        files[GLOSS] = gloss.operators.tensors(), {}
    if candidates is not None:
        tensors = {"positions": candidates.positions, "irradiance": candidates.irradiance}
        files[DICTIONARY] = tensors, {"grid": candidates.grid, "seed": candidates.seed}
    for name in (GATHER, TRANSPORT, GLOSS, DICTIONARY, GRADE):
        (folder / name).unlink(missing_ok=True)
    if grade is not None:
        save_grade(folder / GRADE, grade)
    for name, (tensors, note) in files.items():
        save_tensors(folder / name, tensors, note)


def load_parts(folder: Path, *, gather: bool) -> dict[str, Any]:
    """The parts that `save_parts` wrote, by name, on the CPU; the gather operator only where it is asked for.

    Raises:
        InputError: no such folder, or none of a scene, or a file is missing, broken, or does not belong to the others.
    """
    what, there = "the folder of a frozen scene", is_there(folder)
    if not (there and folder.is_dir()):
        found = "something else than a folder" if there else "no such folder"
        raise InputError(folder, expected=what, found=found, remedy=NAME_IT)
    missing = [name for name in (SURFELS, TRANSPORT) if not (folder / name).exists()]
    if missing:
        found = f"no {' and no '.join(missing)} in it"
        raise InputError(folder, expected=what, found=found, remedy=NAME_IT)
    surfels = load_surfels(folder / SURFELS)
    areas, centers, transport = _load_transport(folder / TRANSPORT, surfels.albedo.float())
    glossy = surfels.gloss is not None and len(surfels.gloss.glossy) > 0
    known = folder / DICTIONARY
    return {
        "surfels": surfels,
        "areas": areas,
        "centers": centers,
        "gather": _load_gather(folder / GATHER, len(surfels)) if gather else None,
        "transport": transport,
        "gloss": _load_gloss(folder / GLOSS, replace(surfels, centers=centers), transport) if glossy else None,
        "candidates": _load_dictionary(known, len(surfels)) if known.exists() else None,
        "grade": load_grade(folder / GRADE) if (folder / GRADE).exists() else None,
    }


def _load_gather(path: Path, count: int) -> SparseOperator:
    tensors, _ = _load(path, set(), ("gather",))
    return _operator(path, tensors, "gather", (count, count))


def _load_transport(path: Path, albedo: Tensor) -> tuple[Tensor, Tensor, PatchTransport]:
    """Areas, exact centres and patch transport."""
    tensors, _ = _load(path, {"inverse", "areas", "centers"}, ("average", "gather"))
    areas, centers, inverse = tensors["areas"], tensors["centers"], tensors["inverse"]
    count, patches = len(albedo), inverse.shape[-1] if inverse.dim() else 0
    _require(path, "areas", areas.shape, (count,))
    _require(path, "centers", centers.shape, (count, 3))
    _require(path, "inverse", inverse.shape, (3, patches, patches))
    _require_range(path, {"areas": areas}, 0.0)
    _require_range(path, {"centers": centers, "inverse": inverse})
    average = _operator(path, tensors, "average", (patches, count))
    transport = PatchTransport(average, _operator(path, tensors, "gather", (count, patches)), inverse, albedo)
    return areas, centers, transport


def _load_gloss(path: Path, surfels: Surfels, transport: PatchTransport) -> GlossyTransport:
    tensors, _ = _load(path, set(PAIR_NAMES), OPERATOR_NAMES)
    glossy, patches = surfels.gloss.glossy, transport.average.shape[0]
    for name in PAIR_NAMES:
        if tensors[name].dim() != 1 or tensors[name].dtype not in (torch.int32, torch.int64):
            found = f"{tensors[name].dtype} {tuple(tensors[name].shape)}"
            raise InputError(path, expected=f"a list of integers as {name}", found=found, remedy=MAKE_AGAIN)
        beyond = (tensors[name] < 0) | (tensors[name] >= patches)
        if bool(beyond.any()):
            found = str(int(tensors[name][beyond][0]))
            raise InputError(path, expected=f"{name} below {patches}", found=found, remedy=MAKE_AGAIN)
    groups, sent = _listed_shape(path, tensors, "average")[0], _listed_shape(path, tensors, "leaving")[1]
    harmonics, pairs = sent // max(1, groups), [len(tensors[name]) for name in PAIR_NAMES]
    shapes = (
        (groups, len(glossy)),
        (len(surfels), groups * harmonics),
        (pairs[0], sent),
        (len(glossy) * harmonics, pairs[0]),
        (patches, sent),
        (pairs[1], sent),
        (groups * harmonics, pairs[1]),
    )
    average, leaving, between, arriving, patch_leaving, *coarse = (
        _operator(path, tensors, name, shape) for name, shape in zip(OPERATOR_NAMES, shapes, strict=True)
    )
    exchanges = Exchange(between, arriving, tensors[PAIR_NAMES[0]]), Exchange(*coarse, tensors[PAIR_NAMES[1]])
    return GlossyTransport(
        surfels, glossy, GlossyOperators(average, leaving, exchanges[0], patch_leaving, exchanges[1])
    )


def _load_dictionary(path: Path, count: int) -> LightDictionary:
    tensors, note = _load(path, {"positions", "irradiance"}, ())
    positions, irradiance = tensors["positions"], tensors["irradiance"]
    _require(path, "positions", positions.shape, (positions.shape[0], 3))
    _require(path, "irradiance", irradiance.shape, (positions.shape[0], count))
    _require_range(path, {"positions": positions})
    _require_range(path, {"irradiance": irradiance}, 0.0)
    made_with = {name: note[name] for name in ("grid", "seed") if name in note}
    if odd := [f"{name} {shown(value)}" for name, value in made_with.items() if type(value) is not int]:
        raise InputError(path, expected="whole numbers as grid and seed", found=odd[0], remedy=MAKE_AGAIN)
    if not (1 <= made_with.get("grid", 1) <= FINEST and 0 <= made_with.get("seed", 0) <= LARGEST_COUNT):
        expected = f"a grid from 1 to {FINEST} and a seed from 0 to {LARGEST_COUNT}"
        raise InputError(path, expected=expected, found=shown(made_with), remedy=MAKE_AGAIN)
    return LightDictionary(positions, irradiance, **made_with)


def _load(path: Path, names: set[str], operators: tuple[str, ...]) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """The tensors of a file that holds exactly `names` and sparse `operators`, and its note."""
    tensors, note = load_tensors(path)
    wanted = names | {f"{operator}.{part}" for operator in operators for part in ("shape", "rows", "columns", "values")}
    if set(tensors) != wanted:
        listed = ", ".join(sorted(tensors)) or "none"
        raise InputError(path, expected=f"the tensors {', '.join(sorted(wanted))}", found=listed, remedy=MAKE_AGAIN)
    # Operators are of single precision.
    single = {name: one.float() for name, one in tensors.items() if one.dtype == torch.float64 and name not in EXACT}
    return tensors | single, note


def _operator(path: Path, tensors: dict[str, Tensor], name: str, shape: tuple[int, int]) -> SparseOperator:
    """The sparse operator of this name, of this shape."""
    _require(path, name, _listed_shape(path, tensors, name), shape)
    try:
        return SparseOperator.from_tensors(tensors, name)
    except ValueError as error:
        raise InputError(path, expected=f"a sparse matrix {name}", found=str(error), remedy=MAKE_AGAIN) from error


def _listed_shape(path: Path, tensors: dict[str, Tensor], name: str) -> tuple[int, int]:
    """Rows and columns that a file states of a sparse operator."""
    stated = tensors[f"{name}.shape"]
    if stated.shape != (2,) or stated.is_floating_point() or stated.is_complex():
        found = f"{stated.dtype} {tuple(stated.shape)}"
        raise InputError(path, expected=f"two integers as {name}.shape", found=found, remedy=MAKE_AGAIN)
    rows, columns = (int(size) for size in stated)
    return rows, columns


def _require(path: Path, name: str, found: Sequence[int], expected: tuple[int, ...]) -> None:
    if tuple(found) != expected:
        raise InputError(path, expected=f"{name} of shape {expected}", found=str(tuple(found)), remedy=MAKE_AGAIN)


def _require_range(path: Path, tensors: dict[str, Tensor], low: float = -math.inf) -> None:
    """Refuse values that are not finite, or below `low`."""
    for name, tensor in tensors.items():
        if not tensor.is_floating_point():
            raise InputError(path, expected=f"floats as {name}", found=str(tensor.dtype), remedy=MAKE_AGAIN)
        good = tensor.isfinite() & (tensor >= low)
        if not bool(good.all()):
            expected = f"finite {name}" if low == -math.inf else f"finite {name} of at least {low:g}"
            raise InputError(path, expected=expected, found=f"{float(tensor[~good][0]):g}", remedy=MAKE_AGAIN)
