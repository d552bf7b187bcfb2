"""A frozen scene on disk: its surfels, its operators and its light dictionary, each in a safetensors file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from torch import Tensor

from rgspipe.datasets.surfel_file import load_surfels, save_surfels
from rgspipe.datasets.tensor_file import load_tensors, save_tensors
from rgspipe.errors import InputError
from rgspipe.fitting.dictionary import LightDictionary
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.transport import PatchTransport

SURFELS, GATHER, TRANSPORT, DICTIONARY = (
    f"{name}.safetensors" for name in ("surfels", "gather", "transport", "dictionary")
)

#: What each effect can change, for effects=auto.
EFFECTS = "effects.json"

MAKE_AGAIN = "Remove it and run the stage freeze again."


def save_frozen(folder: Path, frozen: FrozenScene) -> None:
    """Write surfels, gather operator (with the surfels' areas) and patch transport into `folder`."""
    transport = frozen.transport
    save_surfels(folder / SURFELS, frozen.surfels)
    save_tensors(folder / GATHER, frozen.gather.tensors("gather") | {"areas": frozen.areas})
    operators = transport.average.tensors("average") | transport.gather.tensors("gather")
    save_tensors(folder / TRANSPORT, operators | {"inverse": transport.inverse})


def load_frozen(locate: Callable[[str], Path]) -> FrozenScene:
    """The scene that `save_frozen` wrote, on the CPU.

    Args:
        locate: gives the path of a file by its name, e.g. `folder.joinpath` or an artifact's `file`.

    Raises:
        InputError: a file is missing, broken, or does not belong to the others.
    """
    surfels = load_surfels(locate(SURFELS))
    count = len(surfels)
    path = locate(GATHER)
    tensors = _load(path, {"areas"}, ("gather",))
    areas, gather = tensors["areas"], _operator(path, tensors, "gather", (count, count))
    _require(path, "areas", areas.shape, (count,))
    return FrozenScene(surfels, areas, gather, _load_transport(locate(TRANSPORT), surfels.albedo.float()))


def _load_transport(path: Path, albedo: Tensor) -> PatchTransport:
    tensors = _load(path, {"inverse"}, ("average", "gather"))
    inverse = tensors["inverse"]
    count, patches = len(albedo), inverse.shape[-1]
    _require(path, "inverse", inverse.shape, (3, patches, patches))
    average = _operator(path, tensors, "average", (patches, count))
    return PatchTransport(average, _operator(path, tensors, "gather", (count, patches)), inverse, albedo)


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
