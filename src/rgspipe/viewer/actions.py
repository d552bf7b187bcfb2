"""What a visitor can do: each thing is a button and a key, with a line of help."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import viser

from rgspipe.errors import InputError

#: Of buttons beside the main one: white words on it are read on dark and light pages (contrast 8.2). On light ones
#: viser's own grey looks as if they were disabled.
BESIDE = (73, 80, 87)


@dataclass(frozen=True)
class Action:
    """Something that a visitor can do.

    Attributes:
        key: a letter; W, A, S, D, Q and E fly.
        help: a sentence.
    """

    name: str
    key: str
    help: str
    run: Callable[[], None]


def offer(client: viser.ClientHandle, *actions: Action, chief: bool = False) -> list[viser.GuiButtonHandle]:
    """A button and a key for each; the buttons, of a brighter colour where they are what a visitor is here for."""
    keys(client, *actions)
    colour, gui = None if chief else BESIDE, client.gui
    hints = [f"{action.help} Key {action.key}." for action in actions]
    buttons = [gui.add_button(one.name, hint=hint, color=colour) for one, hint in zip(actions, hints, strict=True)]
    for action, button in zip(actions, buttons, strict=True):
        button.on_click(_told(client, action))
    return buttons


def keys(client: viser.ClientHandle, *actions: Action) -> None:
    """A key for each; all are in the list that Ctrl-K opens."""
    for action in actions:
        command = client.gui.add_command(action.name, description=action.help, hotkey=action.key)
        command.on_trigger(_told(client, action))


def by_visitor(action: Callable[[], None]) -> Callable[[object], None]:
    """For fields, which also tell of values that the program gave them: these change nothing."""
    return lambda event: action() if event.client is not None else None


def _told(client: viser.ClientHandle, action: Action) -> Callable[[object], None]:
    """The action; what cannot be done is told in a note."""

    def run(event: object) -> None:
        try:
            action.run()
        except InputError as error:
            client.add_notification(action.name, str(error), color="red", auto_close_seconds=15.0)

    return run
