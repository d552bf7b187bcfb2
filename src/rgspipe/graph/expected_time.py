"""How long a stage will take, from what earlier runs of it on this machine took."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from glob import escape
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from rgspipe.errors import InputError
from rgspipe.machine.description import machine
from rgspipe.store.artifacts import ArtifactStore, Key
from rgspipe.store.fingerprints import config_differences

#: At most so many runs count: the last ones.
COUNTED = 5

#: At most so many are compared with the settings at hand: studies leave hundreds.
LOOKED_AT = 50

#: The setting by which a stage does other work: images of one kind of scene are rendered, of another read.
WORK = "scene.kind"

#: What of a machine decides over times; versions of Python and of the system do so little.
SAME = ("processor", "cores")


class Expected(NamedTuple):
    """What a stage is expected to take.

    Attributes:
        seconds: the median of the last runs.
        same: whether these had the same settings; otherwise they are those with the fewest others, of other scenes
            where the scene has none.
    """

    seconds: float
    same: bool

    def __str__(self) -> str:
        return f"{'' if self.same else '~'}{in_words(self.seconds)}"


@dataclass(frozen=True)
class EarlierRuns:
    """What the results in a store were made in, on this machine; each stage of a scene, or of all, is read once."""

    store: ArtifactStore
    _known: dict[tuple[str | None, str], list[Mapping[str, Any]]] = field(
        default_factory=dict, repr=False, compare=False
    )

    def expected(self, key: Key, config: Mapping[str, Any]) -> Expected | None:
        """What making an artifact is expected to take; None where such work was never done here.

        Args:
            key: of the artifact.
            config: the settings that it depends on.
        """
        own = _alike(self._runs(key.scene, key.stage), config)
        made = own or _alike(self._runs(None, key.stage), config)
        runs = [(len(config_differences(config, one["config"])), one["seconds"]) for one in made]
        if not runs:
            return None
        fewest = min(others for others, _ in runs)
        last = [seconds for others, seconds in runs if others == fewest][:COUNTED]
        return Expected(float(statistics.median(last)), bool(own) and fewest == 0)

    def _runs(self, scene: str | None, stage: str) -> list[Mapping[str, Any]]:
        """Manifests of the last runs, the newest first; those of all scenes where `scene` is None."""
        place = scene, stage
        if place not in self._known:
            here = machine()
            made = islice((one for one in self._manifests(scene, stage) if _is_of(one, here)), LOOKED_AT)
            self._known[place] = sorted(made, key=lambda one: str(one.get("created", "")), reverse=True)
        return self._known[place]

    def _manifests(self, scene: str | None, stage: str) -> Iterator[Mapping[str, Any]]:
        """Of a stage's results, about the newest first."""
        found = self.store.root.glob(f"{'*' if scene is None else escape(scene)}/{escape(stage)}/[!.]*")
        folders = [folder for folder in found if not folder.is_symlink()]
        for folder in sorted(folders, key=_changed, reverse=True):
            try:
                artifact = self.store.find(Key(folder.parts[-3], stage, folder.name))
            except (InputError, OSError):  # what is wrong with it is told where it is needed
                continue
            if artifact is not None:
                yield artifact.manifest


def _alike(made: Sequence[Mapping[str, Any]], config: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Those of the runs that did the same work."""
    return [one for one in made if one["config"].get(WORK) == config.get(WORK)]


def in_words(seconds: float) -> str:
    """A time as people say it: 0.4 s, 65 s, 12 min, 2.5 h; nothing is said to take less than 0.1 s."""
    if seconds < 9.95:
        return f"{max(0.1, seconds):.1f} s"
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def _changed(folder: Path) -> float:
    try:
        return folder.stat().st_mtime
    except OSError:  # removed meanwhile
        return 0.0


def _is_of(manifest: Mapping[str, Any], here: Mapping[str, str | int]) -> bool:
    """Whether an artifact was made on this machine, from the beginning, and says in what time."""
    known = isinstance(manifest.get("config"), dict) and isinstance(manifest.get("seconds"), int | float)
    at = manifest.get("machine")
    same = isinstance(at, dict) and all(at.get(name) == here[name] for name in SAME)
    return known and same and not manifest.get("resumed", False)
