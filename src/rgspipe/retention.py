"""What is in a store, what of it other results need, and how the rest is removed."""

from __future__ import annotations

import contextlib
import os
import shutil
import time
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock, Timeout

from rgspipe.artifacts import LATEST, MANIFEST, ArtifactStore, Key
from rgspipe.files import sync
from rgspipe.unwritable import told_below

#: The stage whose results are removed only where it is named.
REPORT = "report"

#: What a folder is called while it is removed; it is no artifact any more.
GONE = ".gone-"

#: What a folder is called while an artifact is made in it.
PARTIAL = ".partial-"


@dataclass(frozen=True)
class Stored:
    """A folder of a store: an artifact, or what an interrupted run left of one.

    Attributes:
        folder: where it is.
        key: what it is, or was to be.
        bytes: of all of its files.
        made: seconds since the epoch.
        inputs: stages and fingerprints of what it was made from.
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
    for folder in _folders(outputs):
        if not folder.name.startswith("."):
            yield Key(*folder.relative_to(outputs).parts)


def stored(outputs: Path) -> list[Stored]:
    """Everything in a store, by scene, stage and fingerprint.

    Raises:
        InputError: a manifest is damaged, so that nobody knows what its artifact was made from.
    """
    store = ArtifactStore(outputs)
    linked = {link.resolve() for link in outputs.glob(f"*/*/{LATEST}*") if link.is_symlink()}
    return [_stored(store, folder, linked) for folder in _folders(outputs)]


def removable(everything: Sequence[Stored], choice: Choice) -> list[Stored]:
    """What goes: what was chosen and nothing that stays needs.

    Where it is left open which, those go that no `latest` leads to and no report was made from, and what interrupted
    runs left.
    """
    if choice.is_open:
        chosen = [one for one in everything if choice.takes(one) and not one.linked]
    else:
        chosen = [one for one in everything if choice.takes(one)]
    asked = {one.folder for one in chosen}
    needed = _needed(everything, [one for one in everything if one.folder not in asked])
    return [one for one in chosen if one.name not in needed or not one.whole]


def remove(outputs: Path, gone: Collection[Stored]) -> Iterator[Stored]:
    """Remove results, the newest first, as nothing is made from these; those that were removed.

    Each goes in one step, by a name that no artifact has, and is then taken apart: a kill leaves it whole, or what the
    next call removes. One that a process is making stays.

    Raises:
        InputError: there is no right to remove it.
    """
    with told_below(outputs):
        for left in outputs.glob(f"*/*/{GONE}*"):
            shutil.rmtree(left)
    for one in sorted(gone, key=lambda one: one.made, reverse=True):
        with told_below(outputs), contextlib.suppress(Timeout), _unused(one):
            away = one.folder.with_name(f"{GONE}{one.folder.name.lstrip('.')}")
            one.folder.rename(away)
            for link in one.folder.parent.glob(f"{LATEST}*"):
                if link.is_symlink() and link.readlink() == Path(one.key.fingerprint) and one.whole:
                    link.unlink()
            sync(away.parent)
            shutil.rmtree(away)
            yield one


def _folders(outputs: Path) -> Iterator[Path]:
    """Folders of artifacts, and of those that are in the making."""
    for folder in sorted(outputs.glob("*/*/*")):
        hidden = folder.name.startswith(".") and not folder.name.startswith(PARTIAL)
        is_run = folder.relative_to(outputs).parts[0] == "runs"
        if not is_run and not hidden and folder.is_dir() and not folder.is_symlink():
            yield folder


def _stored(store: ArtifactStore, folder: Path, linked: Collection[Path]) -> Stored:
    scene, stage, name = folder.relative_to(store.root).parts
    key = Key(scene, stage, name.removeprefix(PARTIAL))
    size = sum(path.lstat().st_size for path in folder.rglob("*") if not path.is_dir())
    if name.startswith(PARTIAL):
        return Stored(folder, key, size, folder.stat().st_mtime, frozenset(), linked=False, whole=False)
    artifact = store.find(key)
    assert artifact is not None
    named = artifact.manifest.get("inputs", {})
    inputs = frozenset((stage, one) for stage, prints in named.items() for one in prints)
    made = (folder / MANIFEST).stat().st_mtime
    return Stored(folder, key, size, made, inputs, folder.resolve() in linked, whole=True)


def _needed(everything: Sequence[Stored], stay: Sequence[Stored]) -> set[tuple[str, str]]:
    """Names of what those that stay were made from, and of what these were made from, and so on."""
    inputs = {one.name: one.inputs for one in everything if one.whole}
    found: set[tuple[str, str]] = set()
    new = {name for one in stay for name in one.inputs}
    while new:
        found |= new
        new = {name for one in new for name in inputs.get(one, ())} - found
    return found


@contextlib.contextmanager
def _unused(one: Stored) -> Iterator[None]:
    """Hold the lock under which it is made.

    Raises:
        Timeout: a process is making it.
    """
    file = one.folder.parent / f".lock-{one.key.fingerprint}"
    os.close(os.open(file, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666))
    with FileLock(file).acquire(timeout=0):
        yield
