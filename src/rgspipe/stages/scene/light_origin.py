"""Which dataset a light file or a scene was made from, and with it where the scene's own coordinates are."""

from __future__ import annotations

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
    folders = [folder for folder in file.resolve().parents if (folder / MANIFEST).exists()]
    return _dataset_info(folders[0]) if folders else None


def _dataset_info(folder: Path) -> Path | None:
    if not (folder / MANIFEST).exists():
        return None
    if folder.parent.name == "generate_dataset":
        return folder / INFO
    inputs = read_manifest(folder, folder.parent.name, folder.name)["inputs"]
    scene = folder.parent.parent
    made_from = (scene / stage / fingerprint for stage, fingerprints in inputs.items() for fingerprint in fingerprints)
    return next(filter(None, map(_dataset_info, made_from)), None)
