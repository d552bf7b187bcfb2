"""What was made earlier and is still in the store, and which of it is nearest to what is to be made."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from glob import escape
from itertools import islice
from pathlib import Path
from typing import Any

from rgspipe.errors import InputError
from rgspipe.store.artifacts import ArtifactStore, Key

#: At most so many results of a stage are compared with the one at hand: studies leave hundreds.
LOOKED_AT = 50

#: What an artifact says about itself.
Manifest = Mapping[str, Any]


def last_made(
    store: ArtifactStore, scene: str | None, stage: str, counts: Callable[[Manifest], bool] = lambda _: True
) -> list[Manifest]:
    """Manifests of the last results of a stage, the newest first; the store reads each once.

    Args:
        store: holds them.
        scene: whose; None for those of all scenes.
        stage: by name.
        counts: whether a result is one to be looked at.
    """
    made = islice(filter(counts, _manifests(store, scene, stage)), LOOKED_AT)
    return sorted(made, key=lambda one: str(one.get("created", "")), reverse=True)


def nearest(made: Sequence[Manifest], differences: Callable[[Manifest], list[str]]) -> tuple[list[Manifest], list[str]]:
    """Those of some results that have the fewest differences, in the same order, and those of the first of them."""
    told = [(differences(one), one) for one in made]
    fewest = min((len(causes) for causes, _ in told), default=0)
    found = [(causes, one) for causes, one in told if len(causes) == fewest]
    return [one for _, one in found], found[0][0] if found else []


def _manifests(store: ArtifactStore, scene: str | None, stage: str) -> Iterator[Manifest]:
    """Of a stage's results, about the newest first; those without settings tell nothing."""
    found = store.root.glob(f"{'*' if scene is None else escape(scene)}/{escape(stage)}/[!.]*")
    folders = [folder for folder in found if not folder.is_symlink()]
    for folder in sorted(folders, key=_changed, reverse=True):
        try:
            artifact = store.find(Key(folder.parts[-3], stage, folder.name))
        except (InputError, OSError):  # what is wrong with it is told where it is needed
            continue
        if artifact is not None and isinstance(artifact.manifest.get("config"), dict):
            yield artifact.manifest


def _changed(folder: Path) -> float:
    try:
        return folder.stat().st_mtime
    except OSError:  # removed meanwhile
        return 0.0
