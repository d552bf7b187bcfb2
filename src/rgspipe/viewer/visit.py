"""What visitors are shown, and what the parts of one visitor's page share."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from torch import Tensor

from rgspipe.light_export.world import World
from rgspipe.scene import Camera, LightRig
from rgspipe.viewer.lamp_images import LampImages
from rgspipe.viewer.material import Case, Photograph
from rgspipe.viewer.search import Finder
from rgspipe.viewer.session import Session

if TYPE_CHECKING:
    import viser

    from rgspipe.viewer.actions import Actions


@dataclass(frozen=True)
class Exhibit:
    """What all visitors are shown.

    Attributes:
        images: of the scene.
        finder: searches.
        camera: where the first picture is taken from.
        lights: the lamps at first; if None those of the first case's fit, or one above the middle.
        ambient: (3,) radiance that comes from all around at first; if None, that of the fit whose lamps are shown.
        cases: photographs that can be opened.
        references: photographs under lamps that are known.
        resolution: pixels along the longer side of pictures at rest.
        world: how scene units came about, for lamps that are exported.
        notes: of the scene, for those as well.
        turn: is held while images are made, as several visitors share the processor and what is kept of images.
    """

    images: LampImages
    finder: Finder
    camera: Camera
    lights: LightRig | None = None
    ambient: Tensor | None = None
    cases: Sequence[Case] = ()
    references: Sequence[Photograph] = ()
    resolution: int = 256
    world: World = field(default_factory=World)
    notes: Sequence[str] = ()
    turn: threading.Lock = field(default_factory=threading.Lock)

    def session(self) -> Session:
        """A new visitor's."""
        session = Session(self.images)
        if self.cases:
            session.open(self.cases[0])
        if self.lights is not None:
            session.lights, session.ambient = self.lights, None
        if self.ambient is not None:
            session.ambient = self.ambient
        if not session.lights:
            session.add()
        session.forget()
        return session


@dataclass(frozen=True)
class Visit:
    """One visitor.

    Attributes:
        client: the browser.
        session: of this visitor alone.
        exhibit: what all are shown.
        actions: offers what can be done, and does it.
        camera: the visitor's, for a picture at rest; None before the browser told.
        go_to: looks through a camera.
        changed: something is to be seen that the picture does not show.
    """

    client: viser.ClientHandle
    session: Session
    exhibit: Exhibit
    actions: Actions
    camera: Callable[[], Camera | None]
    go_to: Callable[[Camera], None]
    changed: Callable[[], None]
