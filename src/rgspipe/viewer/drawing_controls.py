"""Which kinds of things are drawn into a visitor's picture."""

from __future__ import annotations

from collections.abc import Callable

import viser

from rgspipe.viewer.actions import Action, by_visitor, keys
from rgspipe.viewer.drawings import KINDS, Drawings


class DrawingControls:
    """A box to tick for each kind; digits do the same."""

    def __init__(self, client: viser.ClientHandle, drawings: Drawings) -> None:
        self._drawings = drawings
        for digit, (kind, (label, hint)) in enumerate(KINDS.items(), start=1):
            box = client.gui.add_checkbox(label, True, hint=f"{hint} Key {digit}.")
            box.on_update(by_visitor(self._shown(kind, box)))
            keys(client, Action(f"show or hide: {label}", str(digit), hint, self._turned(kind, box)))

    def _shown(self, kind: str, box: viser.GuiInputHandle[bool]) -> Callable[[], None]:
        return lambda: self._drawings.show(kind, box.value)

    def _turned(self, kind: str, box: viser.GuiInputHandle[bool]) -> Callable[[], None]:
        def turn() -> None:
            box.value = not box.value
            self._drawings.show(kind, box.value)

        return turn
