"""What the rows of a study change in the configuration, checked before anything is made."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override, OverrideType
from hydra.errors import HydraException

from rgspipe.config import RgspipeConfig, get_value, with_changes
from rgspipe.config.core import describe
from rgspipe.errors import InputError
from rgspipe.program import typed
from rgspipe.studies.captures import CLEAN

#: The key that lists cases.
LISTED = "study.cases"

#: What a case cannot change: how the study itself is run.
OPERATION = ("stage", "upstream", "outputs", "study", "report", "overview", "debug")

#: One override: what stands in brackets or quotes may have spaces in it.
OVERRIDE = re.compile(r"""(?:\[[^\]]*\]|'[^']*'|"[^"]*"|\S)+""")


@dataclass(frozen=True)
class StudyCase:
    """One row of a study.

    Attributes:
        name: what tables and figures call it.
        changes: values by dotted configuration key.
    """

    name: str
    changes: dict[str, Any]


def chosen_scenes(config: RgspipeConfig) -> Iterator[tuple[dict[str, object], RgspipeConfig]]:
    """The configuration changes of each scene of a study, and the configuration with them.

    Without any that is the one that is configured.
    """
    for kind in config.study.scenes or [None]:
        changes: dict[str, object] = {} if kind is None else {"scene.kind": kind, "scene.name": None}
        yield changes, with_changes(config, changes)


def checked_cases(config: RgspipeConfig) -> list[StudyCase]:
    """The cases that the configuration lists, their values in the types of the configuration.

    A value means the same artifact as on the command line: 1 for a number with a fraction becomes 1.0.

    Raises:
        InputError: a case is unclear, two have one name, or a key or value is none of the configuration.
    """
    cases = [_checked(config, text, parse_case(text)) for text in config.study.cases]
    names = [case.name for case in cases]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                LISTED, expected="a name of its own for each case", found=f"{name!r} twice", remedy="Name them apart."
            )
    return cases


def parse_case(text: str) -> StudyCase:
    """A case: overrides as on the command line, with a name in front if wanted, or `CLEAN`.

    "train.steps=0 capture.views=50", "few views: capture.views=25", "as it is: clean".

    Raises:
        InputError: it is neither `CLEAN` nor overrides of single values.
    """
    name, colon, settings = text.partition(": ")
    if not colon:
        name, settings = text, text
    if not name.strip() or not settings.strip():
        raise _unclear(text)
    overrides = [] if settings.strip() == CLEAN else OVERRIDE.findall(settings)
    return StudyCase(" ".join(name.split()), dict(_change(override, text) for override in overrides))


def _change(override: str, text: str) -> tuple[str, Any]:
    """Key and value of an override, as Hydra reads it."""
    try:
        parsed: Override = OverridesParser.create().parse_override(override)
    except HydraException:
        raise _unclear(text) from None
    plain = parsed.type == OverrideType.CHANGE and not parsed.is_sweep_override()
    if not plain or not parsed.key_or_group or parsed.value() == "":
        raise _unclear(text)
    return parsed.key_or_group, parsed.value()


def _unclear(text: str) -> InputError:
    return InputError(
        LISTED,
        expected=f"{CLEAN}, or key=value as on the command line, several joined by spaces, with a name in front where "
        "wanted",
        found=repr(text),
        remedy='Write it like "target_capture.noise=0.03" or "noise 3 %: target_capture.noise=0.03".',
    )


def _checked(config: RgspipeConfig, text: str, case: StudyCase) -> StudyCase:
    known = [key for key, _, _ in describe(config)]
    for key in case.changes:
        if key not in known:
            raise _unknown(text, key, known)
        if key.partition(".")[0] in OPERATION:
            raise InputError(
                LISTED,
                expected="settings of what is studied",
                found=f"{text!r}: {key} says how the study is run",
                remedy="Give it beside the study, not in a case.",
            )
    try:
        changed = with_changes(config, case.changes)
        changed.scene.check_path()
    except InputError as error:
        raise InputError(
            f"{LISTED}: {text!r}: {error.where}", expected=error.expected, found=error.found, remedy=error.remedy
        ) from None
    return StudyCase(case.name, {key: get_value(changed, key) for key in case.changes})


def _unknown(text: str, key: str, known: Sequence[str]) -> InputError:
    near = difflib.get_close_matches(key, known, n=2, cutoff=0.6)
    return InputError(
        LISTED,
        expected="keys of the configuration",
        found=f"{text!r}: no key {key}",
        remedy=f"Did you mean {' or '.join(near)}?" if near else f"{typed('--help')} lists the keys.",
    )


def target_limit(config: RgspipeConfig) -> int | None:
    """How many targets of each class a study takes; None for all."""
    return config.study.limit if config.fit.limit is None else config.fit.limit
