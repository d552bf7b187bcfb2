"""The message of an error is text and no more."""

from __future__ import annotations

import pytest

from rgspipe.errors import InputError


@pytest.mark.parametrize(
    ("found", "told"), [("\x1b]0;a\x07\x1b[31m", r"\x1b]0;a\x07\x1b[31m"), ("\udcff", r"\udcff"), ("ρ · ²", "ρ · ²")]
)
def test_what_would_steer_a_terminal_is_escaped(found: str, told: str) -> None:
    error = InputError("a.json", expected="a number", found=found, remedy="Repair it.")
    assert str(error) == f"a.json: expected a number, found {told}. Repair it." and error.found == found
