"""The command line: what to do with the arguments of `python -m rgspipe` (or `rgspipe`)."""

from __future__ import annotations

import difflib
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from rgspipe.cli.commands import COMMANDS
from rgspipe.cli.completion import FLAGS as COMPLETION_FLAGS
from rgspipe.cli.completion import answered
from rgspipe.cli.help import help_text, topics, version_text
from rgspipe.cli.messages import EXIT_INPUT, EXIT_INTERRUPTED, EXIT_UNREAD, show_input_error
from rgspipe.errors import InputError
from rgspipe.graph.resolver import StageLoader
from rgspipe.plain_values import as_typed
from rgspipe.program import typed
from rgspipe.stages import load_stage
from rgspipe.store.files import NO_ROOM

__all__ = ["main"]

MULTIRUN_FLAGS = ("-m", "--multirun")

ASKS_FOR_HELP = ("-h", "--help", "help")

DRY_RUN = "--dry-run"

#: What Hydra knows beside them.
HYDRA_OPTIONS = (
    *("--cfg", "--config-dir", "--config-name", "--config-path", "--experimental-rerun", "--hydra-help", "--info"),
    *("--package", "--resolve", "--run", "--shell-completion", "--version", "-c", "-cd", "-cn", "-cp", "-i", "-p"),
    *("-r", "-sc"),
)


def main(arguments: Sequence[str] | None = None, stage_loader: StageLoader = load_stage) -> int:
    """Do what the arguments say and return the exit status: 0 done, 1 failed, 2 input that cannot be used.

    Args:
        arguments: those after the program's name; by default the process's own.
        stage_loader: gives a stage by name.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who started us: what is said goes nowhere
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8"))
    for stream in (sys.stdout, sys.stderr):
        # A terminal that knows ASCII alone shows the rest as escapes.
        stream.reconfigure(errors="backslashreplace")
    # A log that finds no room, or no reader, is told once, where the output ends, not line by line.
    logging.raiseExceptions = False
    # The configuration may be what is wrong, so the wish for a traceback is read from the words themselves.
    traceback = "debug.traceback=true" in arguments
    try:
        code = _dispatch(arguments, stage_loader)
        sys.stdout.flush()
        return code
    except BrokenPipeError:  # nobody reads on, as with `| head`
        _say_no_more()
        return EXIT_UNREAD
    except InputError as error:
        show_input_error(error, traceback)
        return EXIT_INPUT
    except OSError as error:
        if error.filename is not None or error.errno not in NO_ROOM:
            raise
        _say_no_more()
        show_input_error(_no_room(error), traceback)
        return EXIT_INPUT
    except KeyboardInterrupt:
        print("\nInterrupted. What is done is kept, and the next run goes on from there.", file=sys.stderr)
        return EXIT_INTERRUPTED


def _say_no_more() -> None:
    """Let what is still to be written at the end go nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _no_room(error: OSError) -> InputError:
    return InputError(
        "standard output",
        expected="room for what is said there",
        found=f"none ({error.strerror})",
        remedy="Free some, or send it elsewhere (> FILE). What is done is kept.",
    )


def _check_letters(arguments: Sequence[str]) -> None:
    """Refuse arguments that are no text: files could not be written about them."""
    for text in arguments:
        if any("\ud800" <= letter <= "\udfff" for letter in text):
            encoding = sys.getfilesystemencoding()
            raise InputError(
                "the command line",
                expected=f"letters that {encoding} knows, as this terminal's locale says",
                found=ascii(text),
                remedy="Set a locale that knows them, such as LC_ALL=C.UTF-8, or use other names.",
            )


def _dispatch(arguments: list[str], stage_loader: StageLoader) -> int:
    _check_letters(arguments)
    if not arguments or arguments[0] in ASKS_FOR_HELP:
        print(help_text(arguments[1:]))
        return 0
    if arguments[0] in COMMANDS and any(text in ASKS_FOR_HELP for text in arguments[1:]):
        print(COMMANDS[arguments[0]].text)
        return 0
    if arguments[0] == "--version":
        print(version_text())
        return 0
    if arguments[0] in COMPLETION_FLAGS:
        answer, is_open = answered(arguments)
        if answer:
            print(answer)
        if not is_open:
            return 0
    _check_working_folder()
    if arguments[0] in COMMANDS:
        return COMMANDS[arguments[0]].load()(arguments[1:])
    arguments = [as_typed(text) for text in arguments]
    if DRY_RUN in arguments:
        from rgspipe.cli.dry_run import dry_run

        return dry_run([text for text in arguments if text != DRY_RUN], stage_loader)
    if "stage=view" in arguments:
        from rgspipe.cli.view_stage import view_stage

        return view_stage(arguments, stage_loader)
    name = next((text.partition("=")[2] for text in arguments if text.startswith("pipeline=")), None)
    if name is not None:
        from rgspipe.cli.sequence import run_sequence

        return run_sequence(name, [text for text in arguments if not text.startswith("pipeline=")])
    # Hydra and the schema take a third of a second to import, which help and status need not wait for.
    from rgspipe.cli.jobs import run_hydra, run_jobs

    if any(text.startswith("-") and text not in MULTIRUN_FLAGS for text in arguments):
        _check_options(arguments)
        return run_hydra(arguments, stage_loader)
    overrides = [text for text in arguments if text not in MULTIRUN_FLAGS]
    return run_jobs(overrides, stage_loader, multirun=len(overrides) < len(arguments))


def _check_options(arguments: Sequence[str]) -> None:
    """Refuse options that nobody knows: Hydra would answer with a list of its own."""
    known = (*MULTIRUN_FLAGS, *ASKS_FOR_HELP, DRY_RUN, *HYDRA_OPTIONS)
    for text in arguments:
        name = text.partition("=")[0]
        if name.startswith("-") and name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            remedy = f"Did you mean {near[0]}?" if near else f"{typed('--help', 'options')} lists them."
            setting = name.lstrip("-").replace("-", "_")
            if setting.partition(".")[0] in ("stage", "pipeline", *topics()):
                remedy = f"Write {setting}={text.partition('=')[2] or 'VALUE'}, without dashes."
            raise InputError(repr(name), expected="an option", found="none of this name", remedy=remedy)


def _check_working_folder() -> None:
    """Refuse to work in a folder that was removed: nothing can be found from there, and some libraries do not load."""
    try:
        Path.cwd()
    except OSError as error:
        raise InputError(
            "working folder",
            expected="one that is there",
            found=f"one that was removed ({error.strerror})",
            remedy="Go to another one (cd).",
        ) from error
