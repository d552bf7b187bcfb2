"""The nodes of the stage graph, and how they are made: one by one, some of which may fail."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rgspipe.config import RgspipeConfig
from rgspipe.errors import InputError
from rgspipe.machine.device import gpu_in_use
from rgspipe.stages.base import Failure, Stage, StageContext
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key
from rgspipe.store.files import remove_any, tree_digest

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Node:
    """One artifact of the graph, made or not.

    Attributes:
        stage: what makes it.
        config: the configuration it is made with.
        changes: how that differs from the configuration of the run.
        key: where it belongs.
        recipe: the config values, inputs, foreign files, code and order of sums behind its fingerprint.
        inputs: the artifacts it is made from.
        may_fail: for each of the inputs, whether it is made without that one where it cannot be had.
    """

    stage: Stage
    config: RgspipeConfig
    changes: Mapping[str, object]
    key: Key
    recipe: Mapping[str, Any]
    inputs: tuple[Node, ...]
    may_fail: tuple[bool, ...]

    def required(self) -> Iterator[Node]:
        """The inputs that it cannot be made without."""
        return (needed for needed, may_fail in zip(self.inputs, self.may_fail, strict=True) if not may_fail)


def foreign_behind(node: Node) -> dict[str, str]:
    """The files and folders that a node's inputs depend on, and their digests: an input may lead to them."""
    found: dict[str, str] = {}
    for needed in node.inputs:
        found |= needed.recipe["foreign"] | foreign_behind(needed)
    return found


def indispensable(root: Node) -> set[Key]:
    """What `root` cannot be made without, itself among it."""
    return {root.key}.union(*map(indispensable, root.required()))


@dataclass
class Making:
    """What a run has made so far.

    Attributes:
        store, names: where artifacts go, and what each is called.
        indispensable: what the run ends without.
        artifacts: those that are there.
        failures: why others are not.
        said: what the plan has said about each.
    """

    store: ArtifactStore
    names: Mapping[Key, str]
    indispensable: set[Key]
    artifacts: dict[Key, Artifact]
    failures: dict[Key, Failure] = field(default_factory=dict)
    said: Mapping[Key, Sequence[str]] = field(default_factory=dict)

    def make(self, node: Node) -> None:
        """Make a node, or keep why it cannot be made where the run can do without it."""
        lost = next((self.failures[needed.key] for needed in node.required() if needed.key in self.failures), None)
        if lost is not None:
            self.failures[node.key] = lost
            return
        try:
            self.artifacts[node.key] = self._built(node)
        except OSError:  # of the disk, not of what is made
            raise
        except Exception as error:
            if node.key in self.indispensable:
                raise
            reason = " ".join(f"{error}".split()) or type(error).__name__
            self.failures[node.key] = Failure(node.stage.name, reason)
            log.warning("%s of %s failed; going on without it: %s", node.stage.name, node.key.scene, reason)

    def _built(self, node: Node) -> Artifact:
        lists, failed = self._inputs(node)
        inputs = {name: found[0] for name, found in lists.items() if found}

        def make(folder: Path) -> Mapping[str, Any]:
            context = StageContext(node.config, inputs, lists, folder, failures=failed)
            # Photographs are read where they are by whatever is made of them, and hours may have passed.
            _check_unchanged(foreign_behind(node))
            node.stage.run(context)
            try:
                _check_unchanged(node.recipe["foreign"])
            except InputError:
                for path in list(folder.iterdir()):
                    remove_any(path)
                raise
            gpu = gpu_in_use()
            return context.facts if gpu is None else {**context.facts, "gpu": gpu}

        log.info("%s: %s", node.stage.name, node.stage.help)
        for remark in node.stage.remarks(node.config, inputs):
            if remark not in self.said.get(node.key, ()):
                log.info("  %s", remark)
        start = time.perf_counter()
        artifact, made = self.store.build(node.key, node.recipe, make, self.names[node.key])
        verb = "made" if made else "made by another process"
        log.info("%s: %s in %.1f s: %s", node.stage.name, verb, time.perf_counter() - start, artifact.path)
        return artifact

    def _inputs(self, node: Node) -> tuple[dict[str, list[Artifact]], dict[str, dict[int, Failure]]]:
        """By stage, the artifacts that a node is made from, and by their place those that it is made without."""
        lists: dict[str, list[Artifact]] = {}
        failed: dict[str, dict[int, Failure]] = {}
        for needed in node.inputs:
            found, lost = lists.setdefault(needed.stage.name, []), failed.setdefault(needed.stage.name, {})
            if needed.key in self.failures:
                lost[len(found) + len(lost)] = self.failures[needed.key]
            else:
                found.append(self.artifacts[needed.key])
        return lists, failed


def foreign_digest(path: Path) -> str:
    """That of a file or folder outside the store that a result depends on.

    Raises:
        InputError: it, or something in it, cannot be read.
    """
    try:
        return tree_digest(path)
    except OSError as error:
        where, remedy = error.filename or path, f"Have its owner let you read it, or take it out of {path}."
        raise InputError(where, expected="a file to read", found=str(error.strerror), remedy=remedy) from error


def _check_unchanged(foreign: Mapping[str, str]) -> None:
    """Refuse what is made of other files than those that its fingerprint is of.

    Raises:
        InputError: a file or folder has changed since the run began.
    """
    changed = [path for path, digest in foreign.items() if foreign_digest(Path(path)) != digest]
    if changed:
        remedy = "Run again once nothing writes to it: nothing that was made of it is kept."
        raise InputError(changed[0], expected="what it was when the run began", found="other content", remedy=remedy)
