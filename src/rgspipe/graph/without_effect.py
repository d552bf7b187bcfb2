"""Which settings of a command change nothing of what it makes: whoever typed them believes that they do."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence

import yaml

from rgspipe.config import RgspipeConfig, get_value, with_changes
from rgspipe.config.core import describe
from rgspipe.errors import InputError
from rgspipe.graph.nodes import Node
from rgspipe.graph.resolver import Resolver
from rgspipe.graph.variants import below, key_of
from rgspipe.machine.resources import resource_folder
from rgspipe.store.artifacts import Key

#: Keys and sections that say how a run is done, or whether at all; by design no result depends on them.
OPERATION = (
    *("stage", "upstream", "outputs", "device", "debug", "limits", "blender", "hydra", "launcher"),
    *("train.memory_mib", "train.scratch", "train.checkpoint_every", "lamps.memory_mib", "fit.poor_scene"),
)

#: The first line of a choice whose keys are those of all groups.
GLOBAL = "# @package _global_"


def without_effect(root: Node, overrides: Sequence[str], resolver: Resolver) -> list[str]:
    """Those overrides without which `root` would be the same: to the last fingerprint, with all that is behind it.

    An override that says what is so by default is none of them.

    Args:
        root: the graph of the configuration with all overrides.
        overrides: of the command: `key=value`, or `group=choice`.
        resolver: that made the graph.
    """
    asked = {text: keys for text in overrides if (keys := _keys(text))}
    if not asked:
        return []
    nodes = list(_nodes(root))
    return [text for text, keys in asked.items() if not _counts(keys, nodes) and not _changes(keys, root, resolver)]


def _keys(override: str) -> list[str]:
    """The dotted keys that an override sets, without those of operation; none of what is no key."""
    key, value = key_of(override), override.partition("=")[2].strip("'\"")
    file = resource_folder("conf") / key / f"{value}.yaml"
    keys = _keys_of_choice(key, file.read_text(encoding="utf-8")) if "/" not in key and file.is_file() else [key]
    known = {name for name, _, _ in describe(RgspipeConfig())}
    return [name for name in keys if name in known and not below(name, OPERATION)]


def _keys_of_choice(group: str, text: str) -> list[str]:
    content = {key: value for key, value in (yaml.safe_load(text) or {}).items() if key != "defaults"}
    return list(_flat(content, "" if text.startswith(GLOBAL) else f"{group}."))


def _flat(values: Mapping[str, object], prefix: str) -> Iterator[str]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}"


def _nodes(node: Node) -> Iterator[Node]:
    yield node
    for needed in node.inputs:
        yield from _nodes(needed)


def _counts(keys: Collection[str], nodes: Sequence[Node]) -> bool:
    """Whether one of the keys is in a recipe as the command has it, which is seen at once."""
    return any(below(key, _counted(node)) for node in nodes for key in keys if key not in node.changes)


def _counted(node: Node) -> Collection[str]:
    """Keys and sections that a node's own content depends on, more than by printing them."""
    return node.recipe["config"] if node.stage.own_keys is None else node.stage.own_keys


def _changes(keys: Collection[str], root: Node, resolver: Resolver) -> bool:
    """Whether with the defaults of the keys, where these are others, something else would be made, or nothing."""
    plain = {key: get_value(RgspipeConfig(), key) for key in keys}
    if all(get_value(root.config, key) == value for key, value in plain.items()):
        return True
    try:
        other = resolver.resolve(root.stage.name, with_changes(root.config, plain), {})
    except InputError:
        return True
    return _made_from(other) != _made_from(root)


def _made_from(root: Node) -> list[Key]:
    """What tells the same result: its key, or those of its inputs where that follows from what it only prints."""
    return [root.key] if root.stage.own_keys is None else [needed.key for needed in root.inputs]
