"""What a visitor can do: each thing is a button and a key, with a line of help, and is done in its turn."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import viser
from viser._messages import RunJavascriptMessage

from rgspipe.errors import InputError

#: Of buttons beside the main one: white words on it are read on dark and light pages (contrast 8.2). On light ones
#: viser's own grey looks as if they were disabled.
BESIDE = (73, 80, 87)


@dataclass(frozen=True)
class Action:
    """Something that a visitor can do.

    Attributes:
        key: a letter, or shift+ and a letter; W, A, S, D, Q and E fly.
        help: a sentence.
    """

    name: str
    key: str
    help: str
    run: Callable[[], None]


class Actions:
    """Offers what can be done, and does what one visitor asks for one after the other, in the order of asking.

    viser runs plain functions side by side, where two presses of a key would both read what the first one changes; it
    awaits the others in order, so that these put what is asked for into a queue.
    """

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._queue = ThreadPoolExecutor(max_workers=1, thread_name_prefix="rgspipe-page-visitor")
        self._beside = ThreadPoolExecutor(max_workers=1, thread_name_prefix="rgspipe-page-search")

    def offer(self, *actions: Action, chief: bool = False) -> list[viser.GuiButtonHandle]:
        """A button and a key for each; the buttons, of a brighter colour where they are what a visitor is here for."""
        self.keys(*actions)
        colour, gui = None if chief else BESIDE, self._client.gui
        hints = [f"{action.help} Key {action.key}." for action in actions]
        buttons = [gui.add_button(one.name, hint=hint, color=colour) for one, hint in zip(actions, hints, strict=True)]
        for action, button in zip(actions, buttons, strict=True):
            button.on_click(self._asked(action))
        return buttons

    def keys(self, *actions: Action) -> None:
        """A key for each; all are in the list that Ctrl-K opens."""
        for action in actions:
            modifier, _, key = action.key.rpartition("+")
            command = self._client.gui.add_command(
                action.name, description=action.help, hotkey=key, modifier=modifier or None
            )
            command.on_trigger(self._asked(action))

    def field(self, field: Any, run: Callable[[], None]) -> None:
        """What is done where the visitor changes a field; values that the program gave it change nothing."""

        async def changed(event: Any) -> None:
            if event.client is not None:
                self.do(field.label, run)

        field.on_update(changed)

    def file(self, button: viser.GuiUploadButtonHandle, take: Callable[[viser.UploadedFile], None]) -> None:
        """What is done with a file that the visitor opens with a button."""

        async def opened(_: object) -> None:
            file = button.value
            self.do(button.label, lambda: take(file))

        button.on_upload(opened)

    def press(self, button: viser.GuiUploadButtonHandle) -> None:
        """Have the browser press a button that asks for a file.

        Browsers let a page ask within seconds of a key, but a program only through what it runs in the page, to which
        viser 1.1.1 has no door of its own.
        """
        script = f'document.getElementById("{button._impl.uuid}")?.click()'
        self._client.gui._websock_interface.queue_message(RunJavascriptMessage(source=script))

    def do(self, name: str, run: Callable[[], None]) -> Future:
        """Do something after all that was asked for before; what cannot be done is told in a note."""
        return self._put(self._queue, lambda: self._told(name, run))

    def beside(self, name: str, work: Callable[[], Any], take: Callable[[Future], None]) -> None:
        """Work that takes long, while the visitor goes on; `take` gets its end in its turn."""
        future = self._put(self._beside, work)
        future.add_done_callback(lambda ended: self.do(name, lambda: take(ended)))

    def stop(self) -> None:
        """The visitor is gone, and what is still to be done with them."""
        for pool in (self._beside, self._queue):
            pool.shutdown(wait=False, cancel_futures=True)

    def _asked(self, action: Action) -> Callable[[object], Any]:
        async def asked(event: object) -> None:
            self.do(action.name, action.run)

        return asked

    def _told(self, name: str, run: Callable[[], None]) -> None:
        try:
            run()
        except InputError as error:
            self._client.add_notification(name, str(error), color="red", auto_close_seconds=15.0)
        except Exception:
            traceback.print_exc()
            raise

    @staticmethod
    def _put(pool: ThreadPoolExecutor, run: Callable[[], Any]) -> Future:
        try:
            return pool.submit(run)
        except RuntimeError:  # the visitor is gone
            gone: Future = Future()
            gone.cancel()
            return gone
