"""A frozen scene on disk: its surfels, its operators and its light dictionary, each in a safetensors file."""

from __future__ import annotations

from collections.abc import Callable
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
    gather, _ = _load(locate(GATHER), {"areas"}, ("gather",))
    transport, path = _load(locate(TRANSPORT), {"inverse"}, ("average", "gather"))
    average, gathered = (SparseOperator.from_tensors(transport, name) for name in ("average", "gather"))
    inverse, count, patches = transport["inverse"], len(surfels), average.shape[0]
    _require(locate(GATHER), tuple(gather["areas"].shape), (count,), "areas")
    _require(path, average.shape, (patches, count), "average")
    _require(path, gathered.shape, (count, patches), "gather")
    _require(path, tuple(inverse.shape), (3, patches, patches), "inverse")
    whole = SparseOperator.from_tensors(gather, "gather")
    _require(locate(GATHER), whole.shape, (count, count), "gather")
    return FrozenScene(
        surfels, gather["areas"], whole, PatchTransport(average, gathered, inverse, surfels.albedo.float())
    )


def save_dictionary(path: Path, dictionary: LightDictionary) -> None:
    """Write a light dictionary."""
    save_tensors(path, {"positions": dictionary.positions, "irradiance": dictionary.irradiance})


def load_dictionary(path: Path, frozen: FrozenScene) -> LightDictionary:
    """The dictionary of `frozen` that `save_dictionary` wrote.

    Raises:
        InputError: the file is missing, broken, or of another scene.
    """
    tensors, _ = _load(path, {"positions", "irradiance"}, ())
    dictionary = LightDictionary(tensors["positions"], tensors["irradiance"])
    candidates = dictionary.positions.shape[0]
    _require(path, tuple(dictionary.positions.shape), (candidates, 3), "positions")
    _require(path, tuple(dictionary.irradiance.shape), (candidates, len(frozen.surfels)), "irradiance")
    return dictionary


def _load(path: Path, names: set[str], operators: tuple[str, ...]) -> tuple[dict[str, Tensor], Path]:
    """The tensors of a file that holds exactly `names` and sparse `operators`."""
    tensors, _ = load_tensors(path)
    wanted = names | {f"{operator}.{part}" for operator in operators for part in ("shape", "rows", "columns", "values")}
    if set(tensors) != wanted:
        listed = ", ".join(sorted(tensors)) or "none"
        raise InputError(path, expected=f"the tensors {', '.join(sorted(wanted))}", found=listed, remedy=MAKE_AGAIN)
    return tensors, path


def _require(path: Path, found: tuple[int, ...], expected: tuple[int, ...], name: str) -> None:
    if tuple(found) != expected:
        raise InputError(path, expected=f"{name} of shape {expected}", found=str(tuple(found)), remedy=MAKE_AGAIN)
