"""The stage graph: what a stage needs, which of it is there, and making what is missing.

Every fingerprint follows from the configuration, the code and the foreign files, so the whole plan is known before
anything is made.
"""

from __future__ import annotations

import logging
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.config.spoken import told_with_keys
from rgspipe.datasets.reading_limits import reading_within
from rgspipe.errors import InputError
from rgspipe.graph.commands import as_override, command
from rgspipe.graph.earlier import last_made, nearest
from rgspipe.graph.expected_time import EarlierRuns, Expected, in_words
from rgspipe.graph.nodes import Making, Node, indispensable
from rgspipe.graph.resolver import Resolver, StageLoader
from rgspipe.graph.variants import variant_name
from rgspipe.graph.without_effect import without_effect
from rgspipe.plain_values import as_shown
from rgspipe.renderer.device import chosen_device
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key
from rgspipe.store.fingerprints import differences
from rgspipe.store.unwritable import told_below

#: At most this many causes are named for one stage in the plan.
SHOWN_CAUSES = 3

#: Letters of a line of a remark in the plan.
WIDTH = 80

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PlannedStep:
    """One line of the plan: a node, whether it is there already, and if not, why not; and what its stage remarks.

    Attributes:
        expected: what making it will take; None where it is there or nobody knows.
    """

    node: Node
    reused: bool
    reason: str
    remarks: tuple[str, ...] = ()
    expected: Expected | None = None


@dataclass(frozen=True)
class Usual:
    """What a command would make if nothing varied; see `variants`.

    Attributes:
        config: its configuration.
        swept: keys and groups of which a sweep tries several values.
        is_all: whether nothing but the stage hears the command, so that it can be said what has no effect.
    """

    config: RgspipeConfig
    swept: frozenset[str] = frozenset()
    is_all: bool = True


def plan(root: Node, store: ArtifactStore) -> list[PlannedStep]:
    """What has to be made and what is reused for `root`, inputs first.

    Nothing is listed below an artifact that is there: it holds all that it was made from.
    """
    steps: dict[Key, PlannedStep] = {}
    earlier = EarlierRuns(store)

    def visit(node: Node) -> None:
        if node.key in steps:
            return
        reused = store.usable(node.key) is not None
        if not reused:
            for needed in node.inputs:
                visit(needed)
        reason, time = ("", None) if reused else (_reason(node, store), _expected(node, earlier, steps))
        steps[node.key] = PlannedStep(node, reused, reason, _remarks(node, store), time)

    visit(root)
    return list(steps.values())


def _reason(node: Node, store: ArtifactStore) -> str:
    """Why a node is made: what tells it from what was made before and differs least, or from nothing."""
    if (damage := store.damage(node.key)) is not None:
        return f"{damage.where} is damaged: {damage.found}"
    if store.partial(node.key).exists():
        return "goes on where it was interrupted"
    made = last_made(store, node.key.scene, node.key.stage)
    if not made:
        return "not made yet"
    _, causes = nearest(made, lambda one: differences(node.recipe, one))
    shown = ", ".join(causes[:SHOWN_CAUSES]) or "the one that was made is gone"
    return shown + (f" and {len(causes) - SHOWN_CAUSES} more" if len(causes) > SHOWN_CAUSES else "")


def _expected(node: Node, earlier: EarlierRuns, steps: Mapping[Key, PlannedStep]) -> Expected | None:
    """What making a node will take. It takes another time, too, where what it is made from has other settings."""
    found = earlier.expected(node.key, node.recipe["config"])
    before = [steps[needed.key].expected for needed in node.inputs]
    others = any(time is not None and not time.same for time in before)
    return found._replace(same=False) if found and others else found


def _remarks(node: Node, store: ArtifactStore) -> tuple[str, ...]:
    own = store.usable(node.key)
    found = {needed.stage.name: store.usable(needed.key) for needed in reversed(node.inputs)} if own is None else {}
    made = {name: artifact for name, artifact in {**found, node.stage.name: own}.items() if artifact is not None}
    return tuple(node.stage.remarks(node.config, made))


def told_plan(config: RgspipeConfig, load_stage: StageLoader, overrides: Sequence[str]) -> str:
    """What `run` would make and reuse, of which nothing is made, and which overrides have no effect; as a text.

    Raises:
        InputError: an input cannot be used, or the store cannot be read.
    """
    with told_below(Path(config.outputs)), reading_within(config.limits):
        resolver = Resolver(load_stage)
        root = resolver.resolve(config.stage, config, {})
        text = describe_plan(plan(root, ArtifactStore(Path(config.outputs))))
        return "\n".join([text, *_told_idle(without_effect(root, overrides, resolver))])


def _told_idle(overrides: Sequence[str]) -> list[str]:
    """The line about overrides that have no effect, if there are any."""
    told = ", ".join(map(as_shown, overrides))
    return [f"No effect on this stage, nor on what it needs: {told}"] if told else []


def describe_plan(steps: Sequence[PlannedStep]) -> str:
    """The plan as a table for people."""
    width = max(len(step.node.stage.name) for step in steps)
    times = [str(step.expected or "") for step in steps]
    longest = max(map(len, times))
    lines = [f"Plan for {steps[-1].node.key.scene}:"]
    for step, time in zip(steps, times, strict=True):
        row = [step.node.stage.name.ljust(width), "reuse" if step.reused else "make ", step.node.key.fingerprint]
        lines.append(f"  {'  '.join([*row, *([time.rjust(longest)] if longest else []), step.reason])}".rstrip())
        for remark in step.remarks:
            parts = textwrap.wrap(remark, WIDTH - width - 11, break_long_words=False, break_on_hyphens=False)
            lines += [f"  {'':<{width}}         {part}" for part in parts]
    return "\n".join([*lines, *_total(steps)])


def _total(steps: Sequence[PlannedStep]) -> list[str]:
    """What all that is made will take, as far as earlier runs tell."""
    made = [step for step in steps if not step.reused]
    known = [step.expected for step in made if step.expected]
    if not known:
        return []
    unknown = dict.fromkeys(step.node.stage.name for step in made if not step.expected)
    rest = f", and what {' and '.join(unknown)} will take" if unknown else ""
    other = "" if all(time.same for time in known) else "; ~: with other settings, or in other scenes"
    return [f"Expected: {in_words(sum(time.seconds for time in known))}{rest} (from earlier runs here{other})"]


def run(
    config: RgspipeConfig, load_stage: StageLoader, overrides: Sequence[str] = (), usual: Usual | None = None
) -> Artifact:
    """Make `config.stage`, and before it what is missing of its inputs; reuse what is there.

    Args:
        config: the whole configuration, checked.
        load_stage: gives a stage by name.
        overrides: the command line's overrides, for the commands that messages suggest, and for names of variants.
        usual: what is called `latest`; None calls everything so.

    Raises:
        InputError: an input cannot be used, or is missing under `upstream=require`; the store cannot be read or
            written to, or its disk is full.
    """
    with told_with_keys(), told_below(Path(config.outputs)), reading_within(config.limits):
        return _run(config, load_stage, overrides, usual)


def _run(config: RgspipeConfig, load_stage: StageLoader, overrides: Sequence[str], usual: Usual | None) -> Artifact:
    if config.device == "cuda":
        # Where there is none, that is told before anything is made.
        chosen_device("cuda")
    store = ArtifactStore(Path(config.outputs))
    resolver = Resolver(load_stage)
    root = resolver.resolve(config.stage, config, {})
    steps = plan(root, store)
    log.info(describe_plan(steps))
    for line in _told_idle(without_effect(root, overrides, resolver) if usual is not None and usual.is_all else ()):
        log.warning(line)
    if config.upstream == "require":
        _refuse_missing(steps, overrides)
    store.remove_unfinished_links()
    names = {step.node.key: _variant(step.node, resolver, overrides, usual) for step in steps}
    artifacts = {step.node.key: _take(step.node, store, names[step.node.key]) for step in steps if step.reused}
    said = {step.node.key: step.remarks for step in steps}
    made = Making(store, names, indispensable(root), artifacts, said=said)
    for step in steps:
        if not step.reused:
            made.make(step.node)
    return artifacts[root.key]


def _variant(node: Node, resolver: Resolver, overrides: Sequence[str], usual: Usual | None) -> str:
    """What tells a node from the one that is called `latest`; empty for that one."""
    if usual is None:
        return ""
    try:
        plain = resolver.resolve(node.stage.name, usual.config, {})
    except InputError:  # what varies cannot be left away, so no variant is plainer than the others
        return ""
    if plain.key == node.key:
        return ""
    changes = {key: as_override(value) for key, value in node.changes.items()}
    return variant_name(overrides, usual.swept, changes, _keys(node))


def _keys(node: Node) -> set[str]:
    """What a node and all behind it depend on."""
    return set(node.recipe["config"]).union(*map(_keys, node.inputs))


def _take(node: Node, store: ArtifactStore, variant: str) -> Artifact:
    artifact = store.find(node.key)
    assert artifact is not None
    artifact.check_sizes()
    store.point_at(node.key, variant)
    return artifact


def _refuse_missing(steps: Sequence[PlannedStep], overrides: Sequence[str]) -> None:
    missing = [step.node for step in steps[:-1] if not step.reused]
    if not missing:
        return
    wanted = command(missing[-1].stage.name, overrides, missing[-1].changes)
    raise InputError(
        f"upstream=require: {missing[-1].stage.name}",
        expected=f"its artifact {missing[-1].key.fingerprint} for this configuration",
        found="none",
        remedy=f"Make it with `{wanted}`, or leave upstream=require away.",
    )
