"""How long a stage will take, from what earlier runs of it on this machine took."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rgspipe.errors import InputError
from rgspipe.machine.description import machine
from rgspipe.store.artifacts import ArtifactStore, Key
from rgspipe.store.fingerprints import config_differences

#: At most so many runs count: the last ones.
COUNTED = 5

#: At most so many are compared with the settings at hand: studies leave hundreds.
LOOKED_AT = 50

#: What of a machine decides over times; versions of Python and of the system do so little.
SAME = ("processor", "cores")


class Expected(NamedTuple):
    """What a stage is expected to take.

    Attributes:
        seconds: the median of the last runs.
        same: whether these had the same settings; otherwise they are those with the fewest others.
    """

    seconds: float
    same: bool

    def __str__(self) -> str:
        return f"{'' if self.same else '~'}{in_words(self.seconds)}"


@dataclass(frozen=True)
class EarlierRuns:
    """What the results in a store were made in, on this machine; each stage of a scene is read once."""

    store: ArtifactStore
    _known: dict[tuple[str, str], list[Mapping[str, Any]]] = field(default_factory=dict, repr=False, compare=False)

    def expected(self, key: Key, config: Mapping[str, Any]) -> Expected | None:
        """What making an artifact is expected to take; None where its stage was never made for its scene here.

        Args:
            key: of the artifact.
            config: the settings that it depends on.
        """
        runs = [(len(config_differences(config, made["config"])), made["seconds"]) for made in self._runs(key)]
        if not runs:
            return None
        fewest = min(others for others, _ in runs)
        last = [seconds for others, seconds in runs if others == fewest][:COUNTED]
        return Expected(float(statistics.median(last)), fewest == 0)

    def _runs(self, key: Key) -> list[Mapping[str, Any]]:
        """Manifests of the last runs, the newest first."""
        place = key.scene, key.stage
        if place not in self._known:
            here = machine()
            made = [manifest for manifest in self._manifests(key) if _is_of(manifest, here)]
            self._known[place] = sorted(made, key=lambda one: str(one.get("created", "")), reverse=True)[:LOOKED_AT]
        return self._known[place]

    def _manifests(self, key: Key) -> Iterator[Mapping[str, Any]]:
        for folder in (self.store.root / key.scene / key.stage).glob("[!.]*"):
            if folder.is_symlink():
                continue
            try:
                artifact = self.store.find(Key(key.scene, key.stage, folder.name))
            except (InputError, OSError):  # what is wrong with it is told where it is needed
                continue
            if artifact is not None:
                yield artifact.manifest


def in_words(seconds: float) -> str:
    """A time as people say it: 0.4 s, 65 s, 12 min, 2.5 h; nothing is said to take less than 0.1 s."""
    if seconds < 9.95:
        return f"{max(0.1, seconds):.1f} s"
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def _is_of(manifest: Mapping[str, Any], here: Mapping[str, str | int]) -> bool:
    """Whether an artifact was made on this machine, from the beginning, and says in what time."""
    known = isinstance(manifest.get("config"), dict) and isinstance(manifest.get("seconds"), int | float)
    at = manifest.get("machine")
    same = isinstance(at, dict) and all(at.get(name) == here[name] for name in SAME)
    return known and same and not manifest.get("resumed", False)
