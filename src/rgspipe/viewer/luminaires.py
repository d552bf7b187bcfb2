"""What there is of a lamp beside its numbers: words, and the file of a measured luminaire."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rgspipe.datasets.photometric_file import READERS, photometry_of
from rgspipe.errors import InputError
from rgspipe.scene.lights import Light, Photometry
from rgspipe.viewer.actions import BESIDE, Action
from rgspipe.viewer.lamp_kinds import words
from rgspipe.viewer.visit import Visit

_HELP = "A measured luminaire, of an IES or EULUMDAT file."
_KEY = "shift+K"
_HINT = f"{_HELP} Key Shift-K."


class Luminaires:
    """A button that asks for a luminaire's file, where the chosen lamp is one, and a line about that lamp.

    Args:
        visit: the visitor.
        take: is called with the table of a file.
    """

    def __init__(self, visit: Visit, take: Callable[[Photometry], None]) -> None:
        self._images, gui = visit.session.images, visit.client.gui
        self._told = gui.add_markdown("", visible=False)
        # viser 1.1.1 shows such buttons, though they are not visible, and nothing on hovering.
        self._folder = gui.add_folder("luminaire", visible=False)
        with self._folder:
            gui.add_markdown(_HINT)
            button = gui.add_upload_button("luminaire file", hint=_HINT, color=BESIDE, mime_type=",".join(READERS))
        self._press = lambda: visit.actions.press(button)
        visit.actions.keys(Action(button.label, _KEY, _HELP, self._ask))
        visit.actions.file(button, lambda file: take(photometry_of(file.content, Path(file.name))))

    def show(self, light: Light | None) -> None:
        """Of the chosen lamp, if there is one."""
        told = "" if light is None else words(light, self._images)
        self._told.content, self._told.visible = told, bool(told)
        self._folder.visible = light is not None and light.tabulated

    def _ask(self) -> None:
        if not self._folder.visible:
            remedy = "Make it one first: key K."
            raise InputError("luminaire file", expected="a lamp that is a profile", found="another", remedy=remedy)
        self._press()
