"""Which kinds of things are drawn into a visitor's picture."""

from __future__ import annotations

from functools import partial

import viser

from rgspipe.viewer.actions import Action, Actions
from rgspipe.viewer.drawings import KINDS, Drawings


class DrawingControls:
    """A box to tick for each kind; digits do the same."""

    def __init__(self, gui: viser.GuiApi, actions: Actions, drawings: Drawings) -> None:
        for digit, (kind, (label, hint)) in enumerate(KINDS.items(), start=1):
            box, node = gui.add_checkbox(label, True, hint=f"{hint} Key {digit}."), drawings.kinds[kind]
            actions.field(box, partial(_take, box, node))
            actions.keys(Action(f"show or hide: {label}", str(digit), hint, partial(_turn, box, node)))


def _take(box: viser.GuiInputHandle[bool], node: viser.SceneNodeHandle) -> None:
    node.visible = box.value


def _turn(box: viser.GuiInputHandle[bool], node: viser.SceneNodeHandle) -> None:
    box.value = not box.value
    _take(box, node)
