"""From a configuration to the graph of artifacts that it asks for, each with its fingerprint; nothing is made."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rgspipe.config import RgspipeConfig, get_value, with_changes
from rgspipe.graph.nodes import Node, foreign_digest
from rgspipe.graph.source_code import SourceCode
from rgspipe.machine.threads import order_of_sums
from rgspipe.stages.base import Stage
from rgspipe.store.artifacts import Key
from rgspipe.store.fingerprints import fingerprint

StageLoader = Callable[[str], Stage]

#: Code that runs stages and talks to people: it decides over no result but by what the configuration and inputs are.
NO_RESULT = (
    "rgspipe.cli",
    "rgspipe.config",
    "rgspipe.datasets.reading_limits",
    "rgspipe.errors",
    "rgspipe.fitting.course",
    "rgspipe.graph",
    "rgspipe.machine.description",
    "rgspipe.options",
    "rgspipe.progress",
    "rgspipe.stages.base",
    "rgspipe.stages.sources",
    "rgspipe.store.artifacts",
    "rgspipe.store.files",
    "rgspipe.store.locks",
    "rgspipe.store.manifest",
    "rgspipe.store.partial",
    "rgspipe.store.status",
    "rgspipe.store.unwritable",
    "rgspipe.store.whole_files",
)


@dataclass
class Resolver:
    """Builds the graph; every module and foreign file is read once."""

    load_stage: StageLoader
    code: SourceCode = field(default_factory=lambda: SourceCode(NO_RESULT))
    files: dict[str, str] = field(default_factory=dict)

    def resolve(self, name: str, config: RgspipeConfig, changes: Mapping[str, object]) -> Node:
        """A stage with all that it needs, where `changes` of the command's configuration led to `config`."""
        stage = self.load_stage(name)
        needs = stage.needs(config)
        inputs = tuple(
            self.resolve(need.stage, with_changes(config, need.changes), {**changes, **need.changes}) for need in needs
        )
        recipe = {
            "config": {key: get_value(config, key) for key in sorted(stage.keys(config))},
            "inputs": _input_fingerprints(inputs),
            "foreign": {str(path): self._file(path) for path in stage.files(config)},
            "code": self.code.fingerprints(stage.run.__module__),
            "sums": order_of_sums(),
        }
        key = Key(stage.place(config), stage.name, fingerprint({"stage": stage.name, **recipe}))
        return Node(stage, config, changes, key, recipe, inputs, tuple(need.may_fail for need in needs))

    def _file(self, path: Path) -> str:
        if str(path) not in self.files:
            self.files[str(path)] = foreign_digest(path)
        return self.files[str(path)]


def _input_fingerprints(inputs: Sequence[Node]) -> dict[str, list[str]]:
    names = dict.fromkeys(node.stage.name for node in inputs)
    return {name: [node.key.fingerprint for node in inputs if node.stage.name == name] for name in names}


def resolve(config: RgspipeConfig, load_stage: StageLoader) -> Node:
    """The graph that ends in `config.stage`."""
    return Resolver(load_stage).resolve(config.stage, config, {})
