"""How the picture is shown: exposure, false colours, a section, dark or light."""

from __future__ import annotations

import numpy as np
import viser

from rgspipe.viewer.actions import Action
from rgspipe.viewer.false_colour import scale
from rgspipe.viewer.session import PICTURE, SHOWN
from rgspipe.viewer.visit import Visit

#: Stops of a press of a key, and of the slider at most.
STOPS, MOST_STOPS = 0.5, 6.0

#: By what part of the scene a press of a key moves the section.
SHIFT = 0.05

#: Sections that are offered: across which axis.
SECTIONS = ("none", "across x", "across y", "across z")

_AROUND = "What comes through openings, beside the lamps."


class PictureControls:
    """Fields of the picture."""

    def __init__(self, visit: Visit) -> None:
        self._session, self._changed = visit.session, visit.changed
        self._gui = gui = visit.client.gui
        self._exposure = gui.add_slider(
            "exposure", -MOST_STOPS, MOST_STOPS, 0.1, 0.0, hint="Stops; 2 is four times as bright. Keys U and J."
        )
        self._shown = gui.add_dropdown(
            "shows", SHOWN, hint="As a photograph, or what arrives on surfaces with all bounces, in colours. Key I."
        )
        self._section = gui.add_dropdown(
            "section", SECTIONS, hint="Cut away what is on your side of a plane, to look into closed rooms. Key L."
        )
        self._place = gui.add_slider(
            "section at", 0.0, 1.0, 0.01, 0.5, hint="From the lower to the upper end. Keys 6, 7."
        )
        self._place.visible = False
        self._around = gui.add_checkbox("light from all around", True, hint=f"{_AROUND} Key Shift-U.", visible=False)
        self._scale = gui.add_image(scale(), visible=False)
        self._legend = gui.add_markdown("")
        self._dark = gui.add_checkbox("dark page", True, hint="Of the page around the picture. Key 0.")
        for field in (self._exposure, self._shown, self._section, self._place, self._around):
            visit.actions.field(field, self._read)
        visit.actions.field(self._dark, self._paint_page)
        actions = (
            Action("brighter", "U", "Half a stop brighter.", lambda: self._expose(STOPS)),
            Action("darker", "J", "Half a stop darker.", lambda: self._expose(-STOPS)),
            Action("light from all around", "shift+U", _AROUND, self._turn_around),
            Action("next way to show", "I", "Picture, irradiance, illuminance in turn.", self._show_next),
            Action("next section", "L", "No section, then one across each axis.", self._cut_next),
            Action("section down", "6", "Move the section towards the lower end.", lambda: self._shift(-SHIFT)),
            Action("section up", "7", "Move the section towards the upper end.", lambda: self._shift(SHIFT)),
            Action("dark or light page", "0", "Of the page around the picture.", self._turn_page),
        )
        visit.actions.keys(*actions)

    def tell(self, top: float) -> None:
        """What the brightest colour of the picture stands for; whether there is more than lamps in it."""
        shown, self._around.visible = self._session.shown, self._session.ambient is not None
        unit = "W/(sr·m²)" if shown == PICTURE else shown.rpartition(" ")[2]
        self._legend.content = f"Brightest colour: {top:.3g} {unit}."
        self._scale.visible = shown != PICTURE

    def _expose(self, stops: float) -> None:
        self._exposure.value = float(np.clip(self._exposure.value + stops, -MOST_STOPS, MOST_STOPS))
        self._read()

    def _turn_around(self) -> None:
        self._around.value = not self._around.value
        self._read()

    def _show_next(self) -> None:
        self._shown.value = _next(SHOWN, self._shown.value)
        self._read()

    def _cut_next(self) -> None:
        self._section.value = _next(SECTIONS, self._section.value)
        self._read()

    def _shift(self, part: float) -> None:
        self._place.value = float(np.clip(self._place.value + part, 0.0, 1.0))
        self._read()

    def _turn_page(self) -> None:
        self._dark.value = not self._dark.value
        self._paint_page()

    def _paint_page(self) -> None:
        theme(self._gui, self._dark.value)

    def _read(self) -> None:
        session, axis = self._session, SECTIONS.index(self._section.value) - 1
        session.exposure, session.shown = self._exposure.value, self._shown.value
        session.is_open_to_it = self._around.value
        self._place.visible = axis >= 0
        lower, upper = (corner.double() for corner in session.images.frozen.bounds)
        # In one step: another thread makes pictures meanwhile, and one without the section would flash up.
        place = float(lower[axis] + self._place.value * (upper[axis] - lower[axis]))
        session.section = (axis, place) if axis >= 0 else None
        self._changed()


def theme(gui: viser.GuiApi, dark: bool) -> None:
    """Dark or light. Without viser's button for sharing: it would send the page through a server of its makers."""
    gui.configure_theme(show_logo=False, show_share_button=False, dark_mode=dark)


def _next(choices: tuple[str, ...], now: str) -> str:
    return choices[(choices.index(now) + 1) % len(choices)]
