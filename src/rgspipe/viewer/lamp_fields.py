"""The fields of one lamp, and keys that choose one of its numbers and change it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from rgspipe.scene.lights import Light
from rgspipe.viewer.actions import Action, Actions
from rgspipe.viewer.lamp_numbers import RGB, Number, colour_of, numbers_of, with_colour

#: Before the label of the number that keys change.
CHOSEN = "▸ "

_COLOUR = "colour"
_KEYS = "Keys End and Home choose a number, Page Up and Page Down change it."


class LampFields:
    """Fields of a lamp, below those that were there before.

    Args:
        gui: of the visitor's page.
        actions: what the visitor can do.
        size: of the scene.
        take: is called with the lamp as it is now, and the name of what was changed.
    """

    def __init__(self, gui: viser.GuiApi, actions: Actions, size: float, take: Callable[[Light, str], None]) -> None:
        self._gui, self._actions, self._size, self._take = gui, actions, size, take
        self._folder = gui.add_folder("this lamp")
        self._light: Light | None = None
        self._numbers: list[Number] = []
        self._fields: dict[str, Any] = {}
        self._chosen = 0
        actions.keys(
            Action("next number", "end", "Choose the next number of the lamp; it is marked.", lambda: self._walk(1)),
            Action("number before", "home", "Choose the number of the lamp before.", lambda: self._walk(-1)),
            Action("more", "pageup", "Raise the chosen number of the lamp.", lambda: self._step(1)),
            Action("less", "pagedown", "Lower the chosen number of the lamp.", lambda: self._step(-1)),
        )

    def show(self, light: Light | None) -> None:
        """Show a lamp, or none."""
        chosen = self._label
        self._light, self._numbers = light, [] if light is None else numbers_of(light, self._size)
        labels = [number.label for number in self._numbers]
        self._chosen = labels.index(chosen) if chosen in labels else 0
        for field in self._fields.values():
            field.visible = False
        for order, number in enumerate(self._numbers):
            self._fill(self._field(number), number, order)
        self._mark()

    @property
    def _label(self) -> str:
        """Of the chosen number."""
        return self._numbers[self._chosen].label if self._numbers else ""

    def _field(self, number: Number) -> Any:
        """Of a number; made once, and hidden where a lamp has no such number: channels have one for all three."""
        name = _COLOUR if number.label in RGB else number.label
        if name not in self._fields:
            with self._folder:
                self._fields[name] = self._colour() if name == _COLOUR else self._number(name, number.help)
        return self._fields[name]

    def _fill(self, field: Any, number: Number, order: int) -> None:
        field.visible, field.order = True, order
        if number.label in RGB:
            field.value = colour_of(self._light)
        else:
            field.step, field.precision = number.step, number.decimals
            field.value = round(number.of(self._light), number.decimals)

    def _colour(self) -> Any:
        hint = f"Colour of the lamp; its brightest channel is 255. {_KEYS}"
        field = self._gui.add_rgb(_COLOUR, (255, 255, 255), hint=hint)
        self._actions.field(field, lambda: self._changed(with_colour(self._light, field.value), _COLOUR))
        return field

    def _number(self, label: str, hint: str) -> Any:
        field = self._gui.add_number(label, 0.0, hint=f"{hint} {_KEYS}")
        self._actions.field(field, lambda: self._set(label, field.value))
        return field

    def _set(self, label: str, value: float) -> None:
        number = next(one for one in self._numbers if one.label == label)
        try:
            changed = number.with_value(self._light, value)
        except ValueError:  # a number on the way to the one that is meant, such as -, or an impossible one
            return
        self._changed(changed, label)

    def _changed(self, light: Light, name: str) -> None:
        self._light = light
        self._take(light, name)

    def _walk(self, steps: int) -> None:
        if self._numbers:
            self._chosen = (self._chosen + steps) % len(self._numbers)
            self._mark()

    def _mark(self) -> None:
        for name, field in self._fields.items():
            field.label = f"{CHOSEN}{name}" if name == self._label else name
        if self._label in RGB:
            self._fields[_COLOUR].label = f"{CHOSEN}{_COLOUR}: {self._label}"

    def _step(self, sign: int) -> None:
        if self._light is not None:
            number = self._numbers[self._chosen]
            self._set(number.label, number.of(self._light) + sign * number.step)
            self.show(self._light)
