"""What is in a store, what of it other results need, and how the rest is removed."""

from __future__ import annotations

import contextlib
import os
import re
import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from filelock import Timeout

from rgspipe.errors import InputError
from rgspipe.store.artifacts import LATEST, Artifact, ArtifactStore, Key
from rgspipe.store.files import ASIDE, GONE, remove_any, remove_at_once
from rgspipe.store.fingerprints import DIGITS
from rgspipe.store.locks import LOCK, folder_locked_if_free, locked_if_free, locked_to_remove
from rgspipe.store.manifest import MANIFEST
from rgspipe.store.partial import PARTIAL
from rgspipe.store.unwritable import told_below

#: The stage whose results are removed only where it is named.
REPORT = "report"

#: What artifacts are called, those in the making, damaged ones that were set aside, and what is left of a removal.
#: Whoever names a folder that is no store must not lose what else is in it.
NAME = re.compile(rf"({re.escape(PARTIAL)}|{re.escape(ASIDE)}\d+-)?([0-9a-f]{{{DIGITS}}})")
LEFT = re.compile(re.escape(GONE) + NAME.pattern)


@dataclass(frozen=True)
class Stored:
    """A folder of a store: an artifact, or what an interrupted run left of one.

    Attributes:
        folder: where it is.
        key: what it is, or was to be.
        bytes: of all of its files.
        made: seconds since the epoch.
        inputs: stages and fingerprints of what it was made from, or shows.
        linked: whether `latest`, or another such link, points to it.
        whole: whether it is an artifact.
    """

    folder: Path
    key: Key
    bytes: int
    made: float
    inputs: frozenset[tuple[str, str]]
    linked: bool
    whole: bool

    @property
    def name(self) -> tuple[str, str]:
        """What those that were made from it call it."""
        return self.key.stage, self.key.fingerprint


@dataclass(frozen=True)
class Choice:
    """Which results are wanted: all that match what is given.

    Attributes:
        scene, stage: of these alone; None for any.
        older: seconds since they were made, at least; None for any.
    """

    scene: str | None = None
    stage: str | None = None
    older: float | None = None

    @property
    def is_open(self) -> bool:
        """Whether it leaves open which."""
        return self == Choice()

    def takes(self, one: Stored) -> bool:
        """Whether a result matches. Reports do only where their stage is named."""
        if one.key.stage == REPORT and self.stage != REPORT:
            return False
        named = self.scene in (None, one.key.scene) and self.stage in (None, one.key.stage)
        return named and (self.older is None or time.time() - one.made >= self.older)


def artifact_keys(outputs: Path) -> Iterator[Key]:
    """Every folder that has the place and the name of an artifact."""
    for _, is_artifact, key in _folders(outputs):
        if is_artifact:
            yield key


def stored(outputs: Path) -> list[Stored]:
    """Everything in a store, by scene, stage and fingerprint.

    Raises:
        InputError: a manifest is damaged, so that nobody knows what its artifact was made from, or cannot be read.
    """
    store = ArtifactStore(outputs)
    with told_below(outputs):
        linked = {link.resolve() for link in outputs.glob(f"*/*/{LATEST}*") if link.is_symlink()}
        found = [_stored(store, *one, linked) for one in _folders(outputs)]
    return [one for one in found if one is not None]


def in_the_making(outputs: Path) -> Path | None:
    """The folder of an artifact that a process is making at this moment; None if there is none."""
    for file in sorted(outputs.glob(f"*/*/{LOCK}*")):
        name = file.name.removeprefix(LOCK)
        try:
            with locked_if_free(file.parent, name):
                pass
        except Timeout:
            return file.with_name(name)
        except OSError:  # another user's, whose folders cannot be removed either
            continue
    return None


@contextlib.contextmanager
def removing(outputs: Path) -> Iterator[None]:
    """What is removed in the block no other process removes meanwhile.

    Raises:
        InputError: another one is removing from the store.
    """
    with contextlib.ExitStack() as held:
        try:
            with told_below(outputs):
                held.enter_context(folder_locked_if_free(outputs))
        except Timeout:
            expected, found = "nobody who removes results from this folder", "another outputs prune that does"
            remedy = "Wait for it to end, and see what is left then."
            raise InputError(outputs, expected=expected, found=found, remedy=remedy) from None
        yield


def removable(everything: Sequence[Stored], choice: Choice) -> list[Stored]:
    """What goes: what was chosen and nothing that stays needs.

    Where it is left open which, those go that no `latest` leads to and no report was made from, and what interrupted
    runs left. A stage without any such link, as in a store that was copied without them, keeps all of its results:
    nobody knows which are those of today.
    """
    if choice.is_open:
        known = {(one.key.scene, one.key.stage) for one in everything if one.linked}
        chosen = [
            one
            for one in everything
            if choice.takes(one) and not one.linked and (not one.whole or (one.key.scene, one.key.stage) in known)
        ]
    else:
        chosen = [one for one in everything if choice.takes(one)]
    asked = {one.folder for one in chosen}
    needed = _needed(everything, [one for one in everything if one.folder not in asked])
    return [one for one in chosen if one.name not in needed or not one.whole]


def remove(outputs: Path, gone: Collection[Stored]) -> Iterator[Stored]:
    """Remove results, the newest first, as nothing is made from these; those that were removed.

    Each loses its links, goes in one step, by a name that no artifact has, and is then taken apart: a kill leaves it
    whole, or what the next call removes. One that a process is making, or removing, stays.

    Raises:
        InputError: there is no right to remove it.
    """
    with told_below(outputs):
        for left, name in _named(outputs, LEFT):
            with contextlib.suppress(Timeout), locked_to_remove(left.parent, name[2]):
                remove_any(left)
    for one in sorted(gone, key=lambda one: one.made, reverse=True):
        place, name = one.folder.parent, one.key.fingerprint
        with told_below(outputs), contextlib.suppress(Timeout), locked_to_remove(place, name):
            if not one.folder.exists():
                continue
            if one.whole:
                _unlink(one)
            remove_at_once(one.folder)
            yield one


def _unlink(one: Stored) -> None:
    """Remove the links to an artifact; who finds it made sets them again."""
    for link in one.folder.parent.glob(f"{LATEST}*"):
        if link.is_symlink() and link.readlink() == Path(one.key.fingerprint):
            link.unlink()


def _named(outputs: Path, pattern: re.Pattern[str]) -> Iterator[tuple[Path, re.Match[str]]]:
    """What is called so in the place of an artifact, and how its name fits."""
    for path in sorted(outputs.glob("*/*/*")):
        if (name := pattern.fullmatch(path.name)) and path.relative_to(outputs).parts[0] != "runs":
            yield path, name


def _folders(outputs: Path) -> Iterator[tuple[Path, bool, Key]]:
    """Folders of artifacts, in the making, and set aside; whether it is an artifact, and of which key."""
    for folder, name in _named(outputs, NAME):
        if folder.is_dir() and not folder.is_symlink():
            scene, stage, _ = folder.relative_to(outputs).parts
            yield folder, name[1] is None, Key(scene, stage, name[2])


def _stored(store: ArtifactStore, folder: Path, is_artifact: bool, key: Key, linked: Collection[Path]) -> Stored | None:
    """What a folder is; None for one in the making that is an artifact, or gone, by now."""
    if not is_artifact:
        try:
            made = folder.stat().st_mtime
        except FileNotFoundError:
            return None
        return Stored(folder, key, _bytes_below(folder), made, frozenset(), linked=False, whole=False)
    artifact = store.find(key)
    if artifact is None:
        return None
    named = artifact.manifest.get("inputs", {})
    inputs = frozenset((stage, one) for stage, prints in named.items() for one in prints) | _shown(artifact)
    made = (folder / MANIFEST).stat().st_mtime
    return Stored(folder, key, _bytes_below(folder), made, inputs, folder.resolve() in linked, whole=True)


def _shown(artifact: Artifact) -> frozenset[tuple[str, str]]:
    """What a page shows of results that it found: their manifests are among the files that it depends on."""
    paths = (Path(name).parts for name in artifact.manifest.get("foreign", {}))
    return frozenset(
        (stage, name) for *_, stage, name, file in (parts for parts in paths if len(parts) > 2) if file == MANIFEST
    )


def _bytes_below(folder: Path) -> int:
    """Bytes of all files; those that a run removes meanwhile do not count."""
    size = 0
    for place, _, names in os.walk(folder):
        for name in names:
            with contextlib.suppress(FileNotFoundError):
                size += (Path(place) / name).lstat().st_size
    return size


def _needed(everything: Sequence[Stored], stay: Sequence[Stored]) -> set[tuple[str, str]]:
    """Names of what those that stay were made from, and of what these were made from, and so on."""
    inputs = {one.name: one.inputs for one in everything if one.whole}
    found: set[tuple[str, str]] = set()
    new = {name for one in stay for name in one.inputs}
    while new:
        found |= new
        new = {name for one in new for name in inputs.get(one, ())} - found
    return found
