"""A store that is made in spite of everything, with the notes of its runs."""

from __future__ import annotations

import os
import shutil
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from crash_world import Run, User, Way
from faults import Fault, note_settled
from rgspipe.store.artifacts import ArtifactStore
from rgspipe.store.retention import artifact_keys

#: What the notes of a store are called: what its runs have brought to the disk; of the present one how many calls it
#: has made, at which it was disturbed, and what it said.
LOG, COUNT, HIT, TOLD = "log", "log.count", "log.hit", "told"

#: Characters of a run's words that are shown.
SHOWN = 2000


@dataclass
class Store:
    """One store.

    Attributes:
        folder: in which runs make it.
        notes: the folder of its notes.
        users: whom the runs belong to, one after the other; nobody where it is oneself.
        suffered: kinds of disturbances so far.
    """

    folder: Path
    notes: Path
    users: tuple[User, ...] = ()
    suffered: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        for place in (self.outputs, self._kept, self.notes):
            place.mkdir(parents=True)
        for name in (LOG, COUNT, HIT, TOLD):
            (self.notes / name).touch()
            (self.notes / name).chmod(0o666)

    @property
    def outputs(self) -> Path:
        return self.folder / "outputs"

    @property
    def log(self) -> Path:
        """What its runs have brought to the disk."""
        return self.notes / LOG

    @property
    def calls(self) -> int:
        """How many calls the last run has made."""
        return (self.notes / COUNT).stat().st_size

    @property
    def hit(self) -> str:
        """The call at which the last run was disturbed; nothing if at none."""
        return (self.notes / HIT).read_text()

    @property
    def told(self) -> str:
        """The end of what the last run has written to the terminal."""
        return (self.notes / TOLD).read_text(errors="replace")[-SHOWN:]

    def run(self, way: Way, kind: str = "", at: int = 0) -> Run:
        """Start a run that suffers a fault of some kind at a call."""
        for name in (COUNT, HIT, TOLD):
            (self.notes / name).write_bytes(b"")
        user = self.users[self.suffered.total() % len(self.users)] if self.users else None
        return Run.start(way, self.folder, self.notes / TOLD, Fault(str(self.log), str(self._kept), kind, at), user)

    def artifacts(self) -> int:
        """How many there are; each must be whole."""
        keys = list(artifact_keys(self.outputs))
        for key in keys:
            artifact = ArtifactStore(self.outputs).find(key)
            assert artifact is not None, key
            artifact.folder()
        return len(keys)

    def begin_with(self, stages: Sequence[Path]) -> None:
        """Put the artifacts of some stages into it; it belongs to its users."""
        for stage in stages:
            copy = self.outputs / stage.parent.name / stage.name
            shutil.copytree(stage, copy, symlinks=True)
            note_settled(str(self.log), [path for path in copy.rglob("*") if path.is_file()])
        for path in (self.folder, self._kept, *self.folder.rglob("*")) if self.users else ():
            os.chown(path, self.users[0].number, self.users[0].group, follow_symlinks=False)
            if not path.is_symlink():
                path.chmod(path.stat().st_mode | (0o2070 if path.is_dir() else 0o060))

    def remove(self) -> None:
        """Remove it, and its notes."""
        for place in (self.folder, self._kept, self.notes):
            shutil.rmtree(place)

    @property
    def _kept(self) -> Path:
        """Where faults keep what was replaced: on the same disk, but not in the store."""
        return self.folder.with_name(f"{self.folder.name}.kept")
