"""What a shell completes of a command line beyond what Hydra knows: commands, stages and pipelines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rgspipe.cli.commands import COMMANDS
from rgspipe.cli.help import pipelines, topics
from rgspipe.stages import NAMES

#: How a shell asks, and where it says for which line.
FLAGS, LINE = ("-sc", "--shell-completion"), "COMP_LINE"

#: Words that begin a line without a stage, and what may follow them; nothing stands for files.
FIRST: Mapping[str, Sequence[str]] = {
    **{name: command.words for name, command in COMMANDS.items()},
    "--help": (),
    "--version": (),
}


def is_question(arguments: Sequence[str]) -> bool:
    """Whether a shell asks how a line can go on."""
    return len(arguments) == 2 and arguments[0] in FLAGS and arguments[1].startswith("query=")


def completed(line: str) -> tuple[list[str], bool]:
    """What the last word of a line can become, and whether Hydra's groups and keys are to be added.

    Args:
        line: as far as it is typed, with the program's name; a blank at its end begins another word.
    """
    words = line.split()[1:]
    word = "" if line.endswith(" ") or not words else words.pop()
    if words == ["view"]:  # its folder
        return [], False
    if words[:1] == ["--help"]:
        return _those(list(topics()), word), False
    if words and words[0] in FIRST:
        return _those(FIRST[words[0]], word), False
    key, is_key, _ = word.partition("=")
    if is_key and key in ("stage", "pipeline"):
        names = (*NAMES, "view") if key == "stage" else pipelines()
        return _those([f"{key}={name}" for name in names], word), False
    return _those(["pipeline=", *([] if words else FIRST)], word), True


def _those(words: Sequence[str], begin: str) -> list[str]:
    return [word for word in words if word.startswith(begin)]
