"""The artifact store: what a stage made, published whole or not at all, and verified when it is read.

    <root>/<scene>/<stage>/<fingerprint>/              an artifact: its files and manifest.json
    <root>/<scene>/<stage>/latest                      link to the newest one
    <root>/<scene>/<stage>/latest-<settings>           link to the newest one of a variant; see `variants`
    <root>/<scene>/<stage>/.partial-<fingerprint>/     an artifact in the making
    <root>/<scene>/<stage>/.lock-<fingerprint>         held while it is made

A process that is killed leaves at most a partial folder, which the next run of the same recipe finds and goes on
with. The lock belongs to the operating system, so it ends with its holder however that ends.
"""

from __future__ import annotations

import datetime
import logging
import os
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rgspipe.errors import InputError
from rgspipe.machine.description import PeakMemory, library_versions, machine
from rgspipe.store.files import (
    NO_RIGHT,
    OCCUPIED,
    UNWRITABLE,
    point_at,
    publish,
    set_aside,
    sha256,
    unfinished_links,
    write_json,
)
from rgspipe.store.locks import lock_file, locked
from rgspipe.store.manifest import MANIFEST, SCHEMA_VERSION, DamagedError, inventory, read_manifest
from rgspipe.store.partial import PARTIAL, begin, forget, remove_scratch

#: What links to the newest artifacts are called, or begin with.
LATEST = "latest"

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Key:
    """Where an artifact belongs."""

    scene: str
    stage: str
    fingerprint: str


@dataclass(frozen=True)
class Artifact:
    """A published artifact. Read its files through `file` or `folder`, which verify them first.

    Attributes:
        path: its folder.
        manifest: what manifest.json says: config, inputs, code, libraries, machine, seconds, files, facts.
    """

    path: Path
    manifest: Mapping[str, Any]
    _verified: set[str] = field(default_factory=set, repr=False, compare=False)

    @property
    def stage(self) -> str:
        """The stage that made it."""
        return self.manifest["stage"]

    @property
    def fingerprint(self) -> str:
        """What identifies it among the artifacts of its stage."""
        return self.manifest["fingerprint"]

    @property
    def facts(self) -> Mapping[str, Any]:
        """What the stage noted about it."""
        return self.manifest["facts"]

    def file(self, name: str) -> Path:
        """The path of one file, verified against its checksum the first time it is asked for.

        Raises:
            InputError: the file is missing, truncated or changed.
            ValueError: the artifact never had such a file.
        """
        if name not in self.manifest["files"]:
            raise ValueError(f"{self.stage} made no {name}; it made {', '.join(self.manifest['files'])}")
        path = self.path / name
        if name not in self._verified:
            self._verify(path, self.manifest["files"][name])
            self._verified.add(name)
        return path

    def folder(self) -> Path:
        """The artifact's folder, after every file in it has been verified."""
        for name in self.manifest["files"]:
            self.file(name)
        return self.path

    def check_sizes(self) -> None:
        """See that every file is there and as long as it was written; reads none of them.

        Raises:
            InputError: one is missing, or was cut off.
        """
        for name, entry in self.manifest["files"].items():
            self._check_size(self.path / name, entry)

    def _verify(self, path: Path, entry: Mapping[str, Any]) -> None:
        self._check_size(path, entry)
        if sha256(path) != entry["sha256"]:
            raise self._damaged(path, entry, "other content (its checksum differs)")

    def _check_size(self, path: Path, entry: Mapping[str, Any]) -> None:
        if path.is_symlink() and not path.exists():
            where = f"a link that leads nowhere ({path.readlink()})"
            remedy = f"See that the place it leads to is there, or remove {self.path}."
            raise InputError(path, expected=f"a file of {self.stage}", found=where, remedy=remedy)
        if not path.is_file():
            raise self._damaged(path, entry, "no file")
        if path.stat().st_size != entry["bytes"] and (size := _size_now(path)) != entry["bytes"]:
            raise self._damaged(path, entry, f"{size} bytes")

    def _damaged(self, path: Path, entry: Mapping[str, Any], found: str) -> DamagedError:
        expected = f"the {entry['bytes']} bytes that {self.stage} wrote"
        remedy = f"Remove the folder {self.path} and run again: the stage will make it anew."
        return DamagedError(path, expected=expected, found=found, remedy=remedy)


@dataclass(frozen=True)
class ArtifactStore:
    """All artifacts below one folder. One store serves a process, so that each file is verified once."""

    root: Path
    _known: dict[Key, Artifact] = field(default_factory=dict, repr=False, compare=False)

    def path(self, key: Key) -> Path:
        """The folder of an artifact, made or not."""
        return self.root / key.scene / key.stage / key.fingerprint

    def partial(self, key: Key) -> Path:
        """The folder in which it is made."""
        return self.root / key.scene / key.stage / f"{PARTIAL}{key.fingerprint}"

    def find(self, key: Key) -> Artifact | None:
        """The published artifact, or None.

        Raises:
            InputError: there is a folder, but its manifest is missing or not its own.
        """
        path = self.path(key)
        if path.is_symlink() and not path.exists():
            found, remedy = f"a link that leads nowhere ({path.readlink()})", "Mount its disk, or remove the link."
            raise InputError(path, expected=f"a result of {key.stage}", found=found, remedy=remedy)
        if not path.exists():
            return None
        if key not in self._known:
            self._known[key] = Artifact(path, read_manifest(path, key.stage, key.fingerprint))
        return self._known[key]

    def usable(self, key: Key) -> Artifact | None:
        """The published artifact if every file is there and as long as it was written, else None.

        One that is not is set aside and made again; `damage` says what is wrong with it.

        Raises:
            InputError: what lies there is none of this store's: another version's, or a link that leads nowhere.
        """
        return None if self.damage(key) else self.find(key)

    def damage(self, key: Key) -> DamagedError | None:
        """What of the published artifact is not as it was written, without reading its files; None if all is."""
        try:
            if (artifact := self.find(key)) is not None:
                artifact.check_sizes()
        except DamagedError as error:
            return error
        return None

    def newest(self, scene: str, stage: str) -> Artifact | None:
        """The artifact of a stage that was made or asked for last, or None if it cannot be read or there is none."""
        links = [link for link in (self.root / scene / stage).glob(f"{LATEST}*") if link.is_symlink() and link.exists()]
        if not links:
            return None
        last = max(links, key=lambda link: link.lstat().st_mtime_ns)
        try:
            return self.find(Key(scene, stage, last.resolve().name))
        except InputError:
            return None

    def point_at(self, key: Key, variant: str = "") -> None:
        """Let `latest`, or `latest-<variant>`, be this artifact; a store that cannot be written to keeps its links."""
        self._point_at(key, variant, UNWRITABLE)

    def remove_unfinished_links(self) -> None:
        """Remove what kills have left of links, also in stages that nobody asks for again; what cannot go stays."""
        for stage in self.root.glob("*/*"):
            for link in unfinished_links(stage, LATEST):
                try:
                    link.unlink(missing_ok=True)
                except OSError as error:
                    if error.errno not in UNWRITABLE:
                        raise

    def _point_at(self, key: Key, variant: str, tolerated: Collection[int]) -> None:
        link = self.root / key.scene / key.stage / (LATEST + (f"-{variant}" if variant else ""))
        try:
            point_at(link, key.fingerprint)
        except OSError as error:
            if error.errno not in (*tolerated, *OCCUPIED):
                raise
            if not (link.is_symlink() and link.readlink() == Path(key.fingerprint)):
                log.warning("%s stays as it is: %s", link, error.strerror)

    def build(
        self,
        key: Key,
        recipe: Mapping[str, Any],
        make: Callable[[Path], Mapping[str, Any]],
        variant: str = "",
    ) -> tuple[Artifact, bool]:
        """Make an artifact and publish it, or wait for the process that is making it and take its result.

        Args:
            key: where it belongs.
            recipe: what identifies it; goes into the manifest as it is.
            make: writes the files into the folder it is given and returns facts for the manifest. The folder may
                hold files of an earlier, interrupted attempt. Names that start with a dot are not published.
            variant: what `latest-<variant>` is called; empty for `latest`.

        Returns:
            the artifact, and whether this call made it.
        """
        path, partial = self.path(key), self.partial(key)
        with locked(path.parent, key.fingerprint):
            if (damage := self.damage(key)) is not None:
                log.warning("%s: %s: made again; what is left is in %s", damage.where, damage.found, set_aside(path))
                self._known.pop(key, None)
            if (found := self.find(key)) is not None:
                # Who made it may have been killed before it was linked to, and may call it otherwise. On a full disk
                # the run ends, as the next one must find a reason to link to it.
                self._point_at(key, variant, NO_RIGHT)
                return found, False
            resumed = begin(partial)
            start, memory = time.perf_counter(), PeakMemory()
            try:
                facts = make(partial)
            except InputError:
                forget(partial, lock_file(path.parent, key.fingerprint))
                raise
            seconds = round(time.perf_counter() - start, 3)
            made = {"seconds": seconds, "peak_memory_mib": memory.mib(), "resumed": resumed, "facts": dict(facts)}
            self._publish(key, recipe, made)
            self._point_at(key, variant, NO_RIGHT)
        artifact = self.find(key)
        assert artifact is not None
        return artifact, True

    def _publish(self, key: Key, recipe: Mapping[str, Any], made: Mapping[str, Any]) -> None:
        path, partial = self.path(key), self.partial(key)
        remove_scratch(partial)
        manifest = {
            "schema": SCHEMA_VERSION,
            "scene": key.scene,
            "stage": key.stage,
            "fingerprint": key.fingerprint,
            **recipe,
            **made,
            "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
            "libraries": dict(library_versions()),
            "machine": machine(),
            "files": inventory(partial),
        }
        write_json(partial / MANIFEST, manifest)
        publish(partial, path)


def _size_now(path: Path) -> int:
    """How long a file is; a network file system may have remembered it from when it was written, until it is opened."""
    with path.open("rb") as stream:
        return os.fstat(stream.fileno()).st_size
