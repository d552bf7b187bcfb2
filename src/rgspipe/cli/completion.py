"""What a shell completes of a command line beyond what Hydra knows: commands, stages and pipelines."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from rgspipe.cli.commands import COMMANDS
from rgspipe.cli.help import pipelines, topics
from rgspipe.errors import InputError
from rgspipe.program import typed
from rgspipe.stages import NAMES

#: How a shell asks, and where it says for which line.
FLAGS, LINE = ("-sc", "--shell-completion"), "COMP_LINE"

#: Words that begin a line without a stage, and what may follow them; nothing stands for files.
FIRST: Mapping[str, Sequence[str]] = {
    **{name: command.words for name, command in COMMANDS.items()},
    "--help": (),
    "--version": (),
}

#: What is asked about a shell: what makes its tab key complete, what ends that, and, by itself, how a line can go on.
VERBS, SHELLS = ("install", "uninstall", "query"), ("bash", "zsh", "fish")

#: Lets zsh take bash's function.
ZSH = """\
(( $+functions[compdef] )) || { autoload -Uz compinit && compinit -i }
autoload -Uz bashcompinit && bashcompinit
"""

#: Of its own: Hydra's has no files, and takes them from Python's lines too.
FISH = """\
function hydra_fish_completion
    set -lx COMP_LINE (commandline -cp)
    set -l words (rgspipe --shell-completion query=fish)
    if test -n "$words"
        printf '%s\\n' $words
    else
        set -l key (string match -r '^[^=]*=' -- (commandline -ct))
        set -l path (string replace -r '^[^=]*=' '' -- (commandline -ct))
        __fish_complete_path $path | string replace -r '^' "$key"
    end
end
complete -c rgspipe -f -a '(hydra_fish_completion)'
"""


def answered(arguments: Sequence[str]) -> tuple[str, bool]:
    """What a shell is told, empty for nothing, and whether Hydra, which knows groups, keys and bash, adds to it.

    Args:
        arguments: those of the command line, from one of FLAGS on.

    Raises:
        InputError: nobody knows that shell, or what is wanted of it.
    """
    verb, _, shell = arguments[1].partition("=") if len(arguments) == 2 else ("", "", "")
    if verb not in VERBS or shell not in SHELLS:
        raise InputError(
            arguments[0],
            expected=f"install or uninstall, and one of {', '.join(SHELLS)}",
            found=" ".join(arguments[1:]) or "nothing",
            remedy=f"Try {typed(FLAGS[1], 'install=bash')}; other shells are not known, and work without the tab key.",
        )
    if verb == "query":
        words, is_open = completed(os.environ.get(LINE, ""))
        return "\n".join(words), is_open
    if verb == "install":
        return {"zsh": ZSH, "fish": FISH}.get(shell, ""), shell != "fish"
    return "", True


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
