"""Which results a light file or a scene was made from: with them where its coordinates are, and what its units are."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from rgspipe.datasets.info import INFO
from rgspipe.store.manifest import MANIFEST, read_manifest


def origin_of(file: Path) -> Path | None:
    """The dataset_info.json of the dataset that the result with this file, such as a fit's lights, was made from.

    The configuration at hand may be of another dataset, which would put the lights elsewhere, or of one that is yet to
    be rendered.

    Returns:
        None where the file belongs to no result, or its dataset is gone.

    Raises:
        InputError: a manifest on the way is damaged.
    """
    return next((folder / INFO for folder in _results(file) if folder.parent.name == "generate_dataset"), None)


def is_captured(file: Path) -> bool:
    """Whether its scene is one of photographs under lamps that nobody measured, so that no watt is known in it.

    Raises:
        InputError: a manifest on the way is damaged.
    """
    return any(folder.parent.name == "capture_surfels" for folder in _results(file))


def scene_of(file: Path) -> str | None:
    """The name of the scene whose result the file belongs to; None where it belongs to none.

    Raises:
        InputError: a manifest on the way is damaged.
    """
    return next((folder.parent.parent.name for folder in _results(file)), None)


def elsewhere_line(file: Path, scene: Path, what: str = "lights") -> str:
    """A line where a file of lights, or of `what`, belongs to another scene than the file `scene`; else empty.

    Raises:
        InputError: a manifest on the way is damaged.
    """
    own, here = scene_of(file), scene_of(scene)
    if own is None or here is None or own == here:
        return ""
    return (
        f"{file}: its {what} are those of the scene {own}; here they stand at the same coordinates of {here}, "
        "which is the same place only where both were made from one file."
    )


def _results(file: Path) -> Iterator[Path]:
    """The folder of the result that the file lies in, and those of all results that it was made from, once each."""
    there = [folder for folder in file.resolve().parents if (folder / MANIFEST).exists()][:1]
    done: set[Path] = set()
    while there:
        folder = there.pop(0)
        if folder in done or not (folder / MANIFEST).exists():
            continue
        done.add(folder)
        yield folder
        inputs = read_manifest(folder, folder.parent.name, folder.name)["inputs"]
        there += [
            folder.parent.parent / stage / fingerprint
            for stage, fingerprints in inputs.items()
            for fingerprint in fingerprints
        ]
