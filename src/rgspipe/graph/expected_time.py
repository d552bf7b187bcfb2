"""How long a stage will take, from what earlier runs of it on this machine took."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rgspipe.graph.earlier import Manifest, last_made, nearest
from rgspipe.machine.description import machine
from rgspipe.store.artifacts import ArtifactStore, Key
from rgspipe.store.fingerprints import config_differences

#: At most so many runs count: the last ones.
COUNTED = 5

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
    _known: dict[tuple[str | None, str], list[Manifest]] = field(default_factory=dict, repr=False, compare=False)

    def expected(self, key: Key, config: Mapping[str, Any]) -> Expected | None:
        """What making an artifact is expected to take; None where such work was never done here.

        Args:
            key: of the artifact.
            config: the settings that it depends on.
        """
        own = _alike(self._runs(key.scene, key.stage), config)
        made = own or _alike(self._runs(None, key.stage), config)
        if not made:
            return None
        alike, causes = nearest(made, lambda one: config_differences(config, one["config"]))
        seconds = statistics.median(one["seconds"] for one in alike[:COUNTED])
        return Expected(float(seconds), bool(own) and not causes)

    def _runs(self, scene: str | None, stage: str) -> list[Manifest]:
        """Manifests of the last runs, the newest first; those of all scenes where `scene` is None."""
        place = scene, stage
        if place not in self._known:
            here = machine()
            self._known[place] = last_made(self.store, scene, stage, lambda one: _is_of(one, here))
        return self._known[place]


def _alike(made: Sequence[Manifest], config: Mapping[str, Any]) -> list[Manifest]:
    """Those of the runs that did the same work."""
    return [one for one in made if one["config"].get(WORK) == config.get(WORK)]


def in_words(seconds: float) -> str:
    """A time as people say it: 0.4 s, 65 s, 12 min, 2.5 h; nothing is said to take less than 0.1 s."""
    if seconds < 9.95:
        return f"{max(0.1, seconds):.1f} s"
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def _is_of(manifest: Manifest, here: Mapping[str, str | int]) -> bool:
    """Whether an artifact was made on this machine, from the beginning, and says in what time."""
    known = isinstance(manifest.get("seconds"), int | float)
    at = manifest.get("machine")
    same = isinstance(at, dict) and all(at.get(name) == here[name] for name in SAME)
    return known and same and not manifest.get("resumed", False)
