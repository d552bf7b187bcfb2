"""What is true of fit targets, for stages that compare with it: their lights, and the size of the scene."""

from __future__ import annotations

from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.json_file import numbers, read_json
from rgspipe.datasets.location import dataset_root
from rgspipe.datasets.surfel_file import load_surfels
from rgspipe.errors import InputError
from rgspipe.store.artifacts import Artifact


def truth_file(config: RgspipeConfig, dataset: Artifact | None, target: str) -> Path | None:
    """The light file with the true lights of a target; None where there is none."""
    if config.fit.target is None:
        return _dataset_file(dataset, f"truth/{target}.json")
    return None if config.fit.truth is None else Path(config.fit.truth)


def scene_bounds(dataset: Artifact | None, freeze: Artifact | None) -> tuple[list[list[float]] | None, str]:
    """The corners of the scene's box, and a note where they are not what the dataset states."""
    info = _dataset_file(dataset, "dataset_info.json")
    stated = None if info is None else read_json(info, "what is known of the dataset").get("bounds")
    if stated is not None:
        return _checked_bounds(stated, info), ""
    if freeze is None:
        return None, "The size of the scene is not known, so there are no position errors."
    centers = load_surfels(freeze.file("surfels.safetensors")).centers.double()
    box = [centers.min(dim=0).values.tolist(), centers.max(dim=0).values.tolist()]
    return box, "The dataset does not state the scene's bounds; those of the surfels' centres stand in for them."


def _dataset_file(dataset: Artifact | None, name: str) -> Path | None:
    """A file of the dataset, verified where it is the artifact's own; None if there is none."""
    if dataset is None:
        return None
    if name in dataset.manifest["files"]:
        return dataset.file(name)
    foreign = dataset_root(dataset.path) / name
    return foreign if foreign.exists() else None


def _checked_bounds(stated: object, path: Path) -> list[list[float]]:
    if not isinstance(stated, list) or len(stated) != 2:
        raise InputError(
            f"{path}: bounds",
            expected="[[low x, y, z], [high x, y, z]]",
            found=repr(stated)[:120],
            remedy="Correct it.",
        )
    low, high = (numbers(corner, 3, path, "bounds") for corner in stated)
    if max(b - a for a, b in zip(low, high, strict=True)) <= 0.0:
        raise InputError(
            f"{path}: bounds", expected="a lower and then an upper corner", found=repr(stated), remedy="Correct it."
        )
    return [low, high]
