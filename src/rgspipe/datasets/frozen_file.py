"""A frozen scene on disk: its surfels, its operators and its light dictionary, each in a safetensors file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from torch import Tensor

from rgspipe.datasets.surfel_file import load_surfels, save_surfels
from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.errors import InputError
from rgspipe.fitting.search.dictionary import LightDictionary
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.glossy_operators import OPERATOR_NAMES, PAIR_NAMES, Exchange, GlossyOperators
from rgspipe.renderer.glossy_transport import GlossyTransport
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.transport import PatchTransport
from rgspipe.scene.surfels import Surfels

SURFELS, GATHER, TRANSPORT, GLOSS, DICTIONARY = (
    f"{name}.safetensors" for name in ("surfels", "gather", "transport", "gloss", "dictionary")
)

#: What each effect can change, for effects=auto.
EFFECTS = "effects.json"

MAKE_AGAIN = "Remove it and run the stage freeze again."


def save_frozen(folder: Path, frozen: FrozenScene) -> None:
    """Write surfels, patch transport (with areas and exact centres) and, where the scene has them, gather and gloss.

    Raises:
        ValueError: the transport has a limited number of bounces: what is stored is the scene with all of them.
    """
    transport = frozen.transport
    if transport.bounces is not None:
        raise ValueError(f"a frozen scene is stored with all bounces, got {transport.bounces}")
    save_surfels(folder / SURFELS, frozen.surfels)
    if frozen.gather is not None:
        save_tensors(folder / GATHER, frozen.gather.tensors("gather"))
    operators = transport.average.tensors("average") | transport.gather.tensors("gather")
    centers = (frozen.surfels.centers if frozen.centers is None else frozen.centers).double()
    more = {"inverse": transport.inverse, "areas": frozen.areas, "centers": centers}
    save_tensors(folder / TRANSPORT, operators | more)
    if frozen.gloss is not None:
        save_tensors(folder / GLOSS, frozen.gloss.operators.tensors())


def load_frozen(locate: Callable[[str], Path], *, gather: bool = False) -> FrozenScene:
    """The scene that `save_frozen` wrote, on the CPU.

    Args:
        locate: gives the path of a file by its name, e.g. `folder.joinpath` or an artifact's `file`.
        gather: whether the gather operator is loaded, too, which is most of the bytes; fits work on the patches.

    Raises:
        InputError: a file is missing, broken, or does not belong to the others.
    """
    surfels = load_surfels(locate(SURFELS))
    areas, centers, transport = _load_transport(locate(TRANSPORT), surfels.albedo.float())
    operator = _load_gather(locate(GATHER), len(surfels)) if gather else None
    glossy = surfels.gloss is not None and len(surfels.gloss.glossy) > 0
    gloss = _load_gloss(locate(GLOSS), replace(surfels, centers=centers), transport) if glossy else None
    return FrozenScene(surfels, areas, operator, transport, gloss=gloss, centers=centers)


def _load_gather(path: Path, count: int) -> SparseOperator:
    return _operator(path, _load(path, set(), ("gather",)), "gather", (count, count))


def _load_transport(path: Path, albedo: Tensor) -> tuple[Tensor, Tensor, PatchTransport]:
    """Areas, exact centres and patch transport."""
    tensors = _load(path, {"inverse", "areas", "centers"}, ("average", "gather"))
    areas, centers, inverse = tensors["areas"], tensors["centers"], tensors["inverse"]
    count, patches = len(albedo), inverse.shape[-1]
    _require(path, "areas", areas.shape, (count,))
    _require(path, "centers", centers.shape, (count, 3))
    _require(path, "inverse", inverse.shape, (3, patches, patches))
    average = _operator(path, tensors, "average", (patches, count))
    transport = PatchTransport(average, _operator(path, tensors, "gather", (count, patches)), inverse, albedo)
    return areas, centers, transport


def _load_gloss(path: Path, surfels: Surfels, transport: PatchTransport) -> GlossyTransport:
    tensors = _load(path, set(PAIR_NAMES), OPERATOR_NAMES)
    glossy, patches = surfels.gloss.glossy, transport.average.shape[0]
    for name in PAIR_NAMES:
        beyond = (tensors[name] < 0) | (tensors[name] >= patches)
        if bool(beyond.any()):
            found = str(int(tensors[name][beyond][0]))
            raise InputError(path, expected=f"{name} below {patches}", found=found, remedy=MAKE_AGAIN)
    groups, sent = int(tensors["average.shape"][0]), int(tensors["leaving.shape"][1])
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


def save_dictionary(path: Path, dictionary: LightDictionary) -> None:
    """Write a light dictionary."""
    save_tensors(path, {"positions": dictionary.positions, "irradiance": dictionary.irradiance})


def load_dictionary(path: Path, frozen: FrozenScene) -> LightDictionary:
    """The dictionary of `frozen` that `save_dictionary` wrote.

    Raises:
        InputError: the file is missing, broken, or of another scene.
    """
    tensors = _load(path, {"positions", "irradiance"}, ())
    positions, irradiance = tensors["positions"], tensors["irradiance"]
    _require(path, "positions", positions.shape, (positions.shape[0], 3))
    _require(path, "irradiance", irradiance.shape, (positions.shape[0], len(frozen.surfels)))
    return LightDictionary(positions, irradiance)


def _load(path: Path, names: set[str], operators: tuple[str, ...]) -> dict[str, Tensor]:
    """The tensors of a file that holds exactly `names` and sparse `operators`."""
    tensors, _ = load_tensors(path)
    wanted = names | {f"{operator}.{part}" for operator in operators for part in ("shape", "rows", "columns", "values")}
    if set(tensors) != wanted:
        listed = ", ".join(sorted(tensors)) or "none"
        raise InputError(path, expected=f"the tensors {', '.join(sorted(wanted))}", found=listed, remedy=MAKE_AGAIN)
    return tensors


def _operator(path: Path, tensors: dict[str, Tensor], name: str, shape: tuple[int, int]) -> SparseOperator:
    """The sparse operator of this name, of this shape."""
    _require(path, name, tensors[f"{name}.shape"].tolist(), shape)
    try:
        return SparseOperator.from_tensors(tensors, name)
    except ValueError as error:
        raise InputError(path, expected=f"a sparse matrix {name}", found=str(error), remedy=MAKE_AGAIN) from error


def _require(path: Path, name: str, found: Sequence[int], expected: tuple[int, ...]) -> None:
    if tuple(found) != expected:
        raise InputError(path, expected=f"{name} of shape {expected}", found=str(tuple(found)), remedy=MAKE_AGAIN)
