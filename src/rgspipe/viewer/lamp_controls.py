"""A visitor's lamps: a gizmo at each, and the fields of the one that is chosen."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from rgspipe.scene import Camera
from rgspipe.scene.lights import KINDS, Light
from rgspipe.viewer.actions import Action
from rgspipe.viewer.cameras import axis_of, turned_to
from rgspipe.viewer.lamp_fields import LampFields
from rgspipe.viewer.lamp_kinds import HELP
from rgspipe.viewer.lamp_numbers import colour_of
from rgspipe.viewer.luminaires import Luminaires
from rgspipe.viewer.session import DOWN
from rgspipe.viewer.visit import Visit

#: Length of a gizmo's arms and radius of the ball in it, of the scene's size.
ARMS, BALL = 0.12, 0.012

#: Colour of the line along which a lamp with an axis shines.
AIM = (255, 220, 60)


class LampControls:
    """Gizmos and fields that change the lamps of a session."""

    def __init__(self, visit: Visit) -> None:
        self._client, self._session, self._changed = visit.client, visit.session, visit.changed
        self._actions, self._camera = visit.actions, visit.camera
        session, gui = visit.session, visit.client.gui
        self._chosen, self._gizmos = 0, []
        self._eye: Camera | None = None
        self._which = gui.add_dropdown("lamp", ["none"], hint="The lamp that the fields below are about. Key T.")
        actions = (
            Action("add a lamp", "N", "A lamp above the scene's middle.", self.add),
            Action("remove it", "X", "Take the chosen lamp away.", self.remove),
            Action("undo", "Z", "Take the last change of lamps back; a whole drag counts as one.", self.undo),
        )
        visit.actions.offer(*actions)
        further = (
            Action("next lamp", "T", "Choose the next lamp.", self._choose_next),
            Action("next kind", "K", "Make the chosen lamp one of the next kind.", self._next_kind),
        )
        visit.actions.keys(*further)
        self._kind = gui.add_dropdown("kind", [*KINDS], hint=f"{HELP} Key K.")
        self._luminaires = Luminaires(visit, lambda table: self._with(session.as_luminaire, table))
        self._fields = LampFields(gui, visit.actions, session.images.frozen.size, self._edited)
        visit.actions.field(self._which, self._choose)
        visit.actions.field(self._kind, lambda: self._make(self._kind.value))
        self.refresh()

    def add(self) -> None:
        """A further lamp, chosen."""
        self._chosen = self._session.add()
        self._renew()

    def remove(self) -> None:
        """Take the chosen lamp away."""
        self._with(self._session.remove)

    def undo(self) -> None:
        """Take the last change back."""
        if self._session.undo():
            self._renew()

    def seen_from(self, camera: Camera) -> None:
        """The visitor looks through another camera: a gizmo that it stands in would hide the picture."""
        self._eye = camera
        for gizmo in self._gizmos:
            away = float(np.linalg.norm(np.asarray(gizmo.position) - camera.origin.numpy()))
            gizmo.visible = away > ARMS * self._session.images.frozen.size

    def refresh(self) -> None:
        """Show the session's lamps, as after a search."""
        for gizmo in self._gizmos:
            gizmo.remove()
        lights = self._session.lights
        self._chosen = min(self._chosen, max(len(lights) - 1, 0))
        names = [f"{index + 1} {light.kind}" for index, light in enumerate(lights)] or ["none"]
        self._which.options = names
        self._which.value = names[self._chosen]
        self._gizmos = [self._gizmo(index, light) for index, light in enumerate(lights)]
        if self._eye is not None:
            self.seen_from(self._eye)
        self._show_fields()

    def _gizmo(self, index: int, light: Light) -> Any:
        size, scene = self._session.images.frozen.size, self._client.scene
        gizmo = scene.add_transform_controls(
            f"/lamps/{index}",
            scale=ARMS * size,
            disable_axes=light.distant,
            disable_sliders=light.distant,
            disable_rotations=light.axis is None,
            depth_test=False,
            position=tuple(light.position.tolist()),
            wxyz=_turn(light),
        )
        scene.add_icosphere(f"/lamps/{index}/ball", radius=BALL * size, color=colour_of(light))
        if light.axis is not None:
            aim = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, -ARMS * size]]])
            scene.add_line_segments(f"/lamps/{index}/aim", aim, AIM, thickness=3.0, thickness_units="screen")

        async def dragged(event: Any) -> None:
            phase = event.phase
            self._actions.do("drag", lambda: self._dragged(index, gizmo, phase))

        gizmo.on_update(dragged)
        return gizmo

    def _dragged(self, index: int, gizmo: Any, phase: str) -> None:
        if index >= len(self._session.lights):
            return
        light, self._session.held = self._session.lights[index], phase != "end"
        axis = None if light.axis is None else axis_of(gizmo.wxyz)
        self._session.replace(index, light.at(torch.tensor(np.asarray(gizmo.position)).double(), axis), f"drag {index}")
        if phase == "end":
            self._session.rest()
            self._chosen = index
            self._which.value = self._which.options[index]
            self._show_fields()
        self._changed()

    def _show_fields(self) -> None:
        lights = self._session.lights
        self._kind.disabled = not lights
        light = lights[self._chosen] if lights else None
        if light is not None:
            self._kind.value = light.kind
        self._luminaires.show(light)
        self._fields.show(light)

    def _edited(self, light: Light, what: str) -> None:
        self._session.replace(self._chosen, light, f"{what} {self._chosen}")
        gizmo = self._gizmos[self._chosen]
        gizmo.position, gizmo.wxyz = tuple(light.position.tolist()), _turn(light)
        self._changed()

    def _choose(self) -> None:
        self._chosen = self._which.options.index(self._which.value)
        self._show_fields()

    def _choose_next(self) -> None:
        if count := len(self._session.lights):
            self._chosen = (self._chosen + 1) % count
            self._which.value = self._which.options[self._chosen]
            self._show_fields()

    def _next_kind(self) -> None:
        if lights := self._session.lights:
            kinds = [*KINDS]
            self._make(kinds[(kinds.index(lights[self._chosen].kind) + 1) % len(kinds)])

    def _make(self, kind: str) -> None:
        """Another kind; a sun shines the way that the visitor looks, as that leads through openings."""
        eye = self._camera() if KINDS[kind].distant else None
        self._with(self._session.as_kind, kind, DOWN if eye is None else -eye.camera_to_world[:3, 2])

    def _with(self, action: Callable[..., None], *given: Any) -> None:
        if self._session.lights:
            action(self._chosen, *given)
            self._renew()

    def _renew(self) -> None:
        self.refresh()
        self._changed()


def _turn(light: Light) -> np.ndarray:
    """wxyz of a lamp's gizmo."""
    return np.array([1.0, 0.0, 0.0, 0.0]) if light.axis is None else turned_to(light.axis)
