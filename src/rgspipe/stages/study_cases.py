"""What the rows of a study change in the configuration, checked before anything is made."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence

from rgspipe.config import RgspipeConfig, get_value, with_changes
from rgspipe.config.core import describe
from rgspipe.errors import InputError
from rgspipe.studies.cases import Case, parse_case

#: What a case cannot change: how the study itself is run.
OPERATION = ("stage", "upstream", "outputs", "study", "light_study", "report", "overview", "debug")


def chosen_scenes(config: RgspipeConfig, kinds: Sequence[str]) -> Iterator[tuple[dict[str, object], RgspipeConfig]]:
    """The configuration changes of each kind of scene, and the configuration with them.

    Without kinds that is the one that is configured.
    """
    for kind in kinds or [None]:
        changes: dict[str, object] = {} if kind is None else {"scene.kind": kind, "scene.name": None}
        yield changes, with_changes(config, changes)


def checked_cases(config: RgspipeConfig, listed: str, texts: Sequence[str], section: str = "") -> list[Case]:
    """The cases that the key `listed` lists, their values in the types of the configuration.

    A value means the same artifact as on the command line: 1 for a number with a fraction becomes 1.0.

    Args:
        section: where keys without a dot belong, see `parse_case`.

    Raises:
        InputError: a case is unclear, two have one name, or a key or value is none of the configuration.
    """
    cases = [_checked(config, listed, text, parse_case(text, listed, section)) for text in texts]
    names = [case.name for case in cases]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                listed, expected="a name of its own for each case", found=f"{name!r} twice", remedy="Name them apart."
            )
    return cases


def _checked(config: RgspipeConfig, listed: str, text: str, case: Case) -> Case:
    known = [key for key, _, _ in describe(config)]
    for key in case.changes:
        if key not in known:
            raise _unknown(listed, text, key, known)
        if key.partition(".")[0] in OPERATION:
            raise InputError(
                listed,
                expected="settings of what is studied",
                found=f"{text!r}: {key} says how the study is run",
                remedy="Give it beside the study, not in a case.",
            )
    try:
        changed = with_changes(config, case.changes)
        changed.scene.check_path()
    except InputError as error:
        raise InputError(
            f"{listed}: {text!r}: {error.where}", expected=error.expected, found=error.found, remedy=error.remedy
        ) from None
    return Case(case.name, {key: get_value(changed, key) for key in case.changes})


def _unknown(listed: str, text: str, key: str, known: Sequence[str]) -> InputError:
    near = difflib.get_close_matches(key, known, n=2, cutoff=0.6)
    return InputError(
        listed,
        expected="keys of the configuration",
        found=f"{text!r}: no key {key}",
        remedy=f"Did you mean {' or '.join(near)}?" if near else "python -m rgspipe --help lists the keys.",
    )
