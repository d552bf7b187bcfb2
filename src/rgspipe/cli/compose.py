"""From the command line's overrides to the typed configuration, with errors for people."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from functools import cache
from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_dir
from hydra._internal.hydra import Hydra
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override, QuotedString
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from rgspipe.cli import DRY_RUN
from rgspipe.cli.commands import COMMANDS
from rgspipe.cli.hydra_settings import check_hydra
from rgspipe.cli.sweep_values import first_value, job_overrides
from rgspipe.config import RgspipeConfig
from rgspipe.config.core import build, plain, unknown_key
from rgspipe.datasets.json_file import shown
from rgspipe.errors import InputError
from rgspipe.graph import commands
from rgspipe.graph.pipeline import Usual
from rgspipe.graph.variants import plain_overrides
from rgspipe.machine.resources import resource_folder
from rgspipe.stages import NAMES, load_stage, near_stage
from rgspipe.store.files import LONGEST_NAME

CONFIG_NAME = "config"
HYDRA_VERSION_BASE = "1.3"

#: Parts of Hydra's own configuration that may hold any key.
FREE_SECTIONS = (
    "hydra.job.env_set.",
    "hydra.job_logging.",
    "hydra.hydra_logging.",
    "hydra.callbacks.",
    "hydra.sweeper.params.",
    "hydra.launcher.additional_parameters.",
)

#: How a launcher is chosen: by the group of this program or by Hydra's own.
LAUNCHER_GROUPS = ("launcher", "hydra/launcher")

#: The launcher that sends jobs to a cluster.
SLURM_LAUNCHER = "hydra_plugins.rgspipe_slurm.SlurmLauncher"


@cache
def register_schema() -> None:
    """Let the files under conf/ extend the defaults. Hydra composes plain values; `typed` knows what they may be."""
    ConfigStore.instance().store(name="schema", node=plain(RgspipeConfig()), provider="rgspipe")
    # Hydra copies all that is registered whenever it composes, and what it takes of that once more: a quarter of its
    # time. The store of a process is one.
    ConfigStore.__deepcopy__ = lambda store, memo: store
    # Before a run it composes everything to ask for `hydra.mode`, and finds None: `check_hydra` lets nobody set it.
    Hydra.get_mode = lambda *_, **__: None


def config_folder() -> str:
    """The absolute path of conf/."""
    return str(resource_folder("conf"))


def typed(values: DictConfig) -> RgspipeConfig:
    """The configuration as plain dataclasses, checked.

    Raises:
        InputError: a value is missing or out of range.
    """
    if OmegaConf.is_missing(values, "stage"):
        raise InputError(
            "stage", expected=f"one of {', '.join(NAMES)}", found="nothing", remedy="Say which: stage=NAME."
        )
    try:
        content = OmegaConf.to_container(values, resolve=True)
    except OmegaConfBaseException as error:
        raise _composition_error(error, ()) from None
    assert isinstance(content, dict)
    config = build(RgspipeConfig, content)
    config.scene.check_path()
    return config


def compose_config(overrides: Sequence[str]) -> RgspipeConfig:
    """The checked configuration of one run.

    Raises:
        InputError: an override is misspelt, of the wrong type or out of range.
    """
    return typed(composed_values(overrides))


def composed_values(overrides: Sequence[str]) -> DictConfig:
    """The configuration of one run as Hydra composes it; what it holds is not looked at yet.

    Raises:
        InputError: an override is misspelt, or not for a single run.
    """
    parsed = parsed_overrides(overrides)
    _check_single(parsed)
    # Before the keys: which of them exist depends on the launcher that is chosen.
    _check_choices(parsed)
    _check_keys(parsed)
    check_hydra(parsed)
    try:
        return _compose(overrides)
    except (HydraException, OmegaConfBaseException) as error:
        raise _composition_error(error, overrides) from None


def usual_command(overrides: Sequence[str], config: RgspipeConfig, is_all: bool = True) -> Usual:
    """What a command, or each job of a sweep, would make if nothing varied.

    Args:
        config: of these overrides, or of a sweep's first job.
        is_all: see `Usual`.
    """
    swept = frozenset(
        str(override.key_or_group) for override in parsed_overrides(overrides) if override.is_sweep_override()
    )
    plain = plain_overrides(overrides, swept)
    return Usual(config if plain == list(overrides) else compose_config(plain), swept, is_all)


def sweep_jobs(overrides: Sequence[str]) -> list[list[str]]:
    """The overrides of each job of a sweep, in their order."""
    return list(job_overrides(parsed_overrides(overrides)))


def given_folder(overrides: Sequence[str], mode: str) -> Path | None:
    """What `hydra.run.dir` or `hydra.sweep.dir` says, for `mode` "run" or "sweep"; None if it is not among them."""
    parsed = parsed_overrides(overrides)
    if not any(override.key_or_group == f"hydra.{mode}.dir" for override in parsed):
        return None
    chosen = [first_value(override) for override in parsed]
    try:
        return Path(str(_compose(chosen, hydra=True).hydra[mode].dir))
    except (HydraException, OmegaConfBaseException) as error:
        raise _composition_error(error, chosen) from None


def leaves_machine(overrides: Sequence[str]) -> bool:
    """Whether the command line names a launcher that sends jobs to a cluster, where single runs are to go too."""
    launchers = [override for override in parsed_overrides(overrides) if override.key_or_group in LAUNCHER_GROUPS]
    if not launchers:
        return False
    _check_choices(override for override in launchers if not override.is_sweep_override())
    named = [override.input_line or "" for override in launchers]
    try:
        return str(_compose(named, hydra=True).hydra.launcher._target_) == SLURM_LAUNCHER
    except HydraException as error:
        raise _composition_error(error, named) from None


def _compose(overrides: Sequence[str], hydra: bool = False) -> DictConfig:
    register_schema()
    # Within a job Hydra is at work already, with the same folder.
    running = GlobalHydra.instance().is_initialized()
    folder = {"version_base": HYDRA_VERSION_BASE, "config_dir": config_folder(), "job_name": "rgspipe"}
    with nullcontext() if running else initialize_config_dir(**folder):
        return compose(CONFIG_NAME, overrides=list(overrides), return_hydra_config=hydra)


def parsed_overrides(overrides: Sequence[str]) -> list[Override]:
    """The overrides of a command line as Hydra reads them.

    Raises:
        InputError: one is none.
    """
    for text in overrides:
        if "=" not in text and not text.startswith("~"):
            named, stage = difflib.get_close_matches(text, COMMANDS, n=1), near_stage(text)
            near = named[0] if named else stage and f"stage={stage}"
            remedy = f"Did you mean {near}?" if near else f"See {commands.typed('--help')}."
            raise InputError(repr(text), expected="a command or key=value", found="neither", remedy=remedy)
    parsed = []
    for text in overrides:
        try:
            parsed += OverridesParser.create().parse_overrides([text])
        except OverrideParseException:
            raise InputError(
                shown(text),
                expected="key=value",
                found="text that does not parse",
                remedy="Quote values with special characters, such as key='\"a b\"'; lists are written [1,2].",
            ) from None
    return parsed


def _check_keys(overrides: Sequence[Override]) -> None:
    """Refuse what Hydra lets through: keys that `+` would add, and deletions."""
    if not any(override.is_add() or override.is_force_add() or override.is_delete() for override in overrides):
        return
    known = _known_keys(overrides)
    for override in overrides:
        key = override.key_or_group
        if override.is_delete():
            raise InputError(
                f"~{key}", expected="key=value", found="a deletion", remedy=f"Set {key} instead: no key can go."
            )
        if (override.is_add() or override.is_force_add()) and not key.startswith(FREE_SECTIONS) and key not in known:
            raise _unknown(key, known)


def _unknown(key: str, known: Sequence[str]) -> InputError:
    """Of a key that may be an option's name, too."""
    return unknown_key(key, [*known, DRY_RUN])


def _known_keys(overrides: Sequence[Override]) -> list[str]:
    """Every dotted key, section and group; the launcher among the overrides decides about `hydra.launcher`."""
    launchers = [override.input_line or "" for override in overrides if override.key_or_group in LAUNCHER_GROUPS]
    try:
        composed = _compose(launchers, hydra=True)
    except HydraException:
        # The launcher itself is what is wrong, and is told about elsewhere.
        composed = _compose([], hydra=True)
    values = OmegaConf.to_container(composed, resolve=False)
    assert isinstance(values, dict)
    folders = [path for path in resource_folder("conf").iterdir() if path.is_dir()]
    return [*_flat(values), *(path.name for path in folders), "hydra/launcher", "hydra/sweeper", "pipeline"]


def _flat(values: Mapping[Any, Any], prefix: str = "") -> Iterator[str]:
    for key, value in values.items():
        yield f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")


def _check_single(overrides: Sequence[Override]) -> None:
    """Refuse values that only a sweep may have."""
    for override in overrides:
        if override.is_sweep_override():
            key, _, found = (override.input_line or "").partition("=")
            remedy = "Add -m to run one job for each value, or write a list as [a,b]."
            raise InputError(key, expected="one value", found=found, remedy=remedy)


def _check_choices(overrides: Iterable[Override]) -> None:
    """Refuse what is no name as the choice of a group: Hydra raises a bare error, or none."""
    for override in overrides:
        key = override.key_or_group
        folder = resource_folder("conf") / key
        is_group = key.startswith("hydra/") or ("." not in key and folder.is_dir())
        if not is_group or override.is_delete() or _may_be_name(override.value()):
            continue
        options = ", ".join(sorted(path.stem for path in folder.glob("*.yaml"))) or "those that Hydra has"
        found = shown((override.input_line or "").partition("=")[2])
        raise InputError(key, expected=f"one of {options}", found=found, remedy=f"Choose one: {key}=NAME.")


def _may_be_name(value: object) -> bool:
    return isinstance(value, str | QuotedString) and "${" not in str(value) and len(str(value)) <= LONGEST_NAME


def _composition_error(error: Exception, overrides: Sequence[str]) -> InputError:
    if isinstance(error, MissingConfigException):
        return _unknown_choice(error)
    known = _known_keys(parsed_overrides(overrides))
    for override in parsed_overrides(overrides):
        if override.key_or_group not in known and not override.key_or_group.startswith(FREE_SECTIONS):
            return _unknown(override.key_or_group or repr(override.input_line), known)
    return InputError(
        "the command line",
        expected="overrides that fit the configuration",
        found=" ".join(str(error).split()),
        remedy=f"See {commands.typed('--help')}.",
    )


def _unknown_choice(error: MissingConfigException) -> InputError:
    """Hydra lists the options of the group in its message and names the missing file."""
    group, _, found = str(error.missing_cfg_file).rpartition("/")
    options = list(error.options or [])
    near = difflib.get_close_matches(found, options, n=1)
    remedy = f"Did you mean {group}={near[0]}?" if near else f"Choose one of them: {group}=NAME."
    return InputError(group, expected=f"one of {', '.join(options)}", found=repr(found), remedy=remedy)


def check_stage(name: str) -> None:
    """Refuse a stage that does not exist; imports nothing heavy when it does not."""
    if name not in NAMES:
        load_stage(name)
