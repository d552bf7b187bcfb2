"""What is drawn into a visitor's picture: cameras, regions of lamps, their truth, and what a search came by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import viser

from rgspipe.datasets.alternatives_file import ToldAlternative
from rgspipe.relighting.sweeps import spread_frames
from rgspipe.scene import Camera, LightRig
from rgspipe.viewer.cameras import pose_of
from rgspipe.viewer.ellipsoids import region
from rgspipe.viewer.material import Found, Photograph

#: Lengths of the frustums of cameras whose photographs are searched and of others, and radii of the balls of true lamps
#: and of alternatives, of the scene's size.
FRUSTUM, FURTHER, TRUTH, OTHER = 0.06, 0.022, 0.015, 0.009

#: At most so many of the others are drawn: forty hid the scene.
MOST_FURTHER = 12

#: What can be hidden together: by the name of its node a label and a line of help.
KINDS = {
    "found": ("regions", "Where found lamps are with 95 % probability, in orange."),
    "others": ("alternatives", "Lamps that the search ruled out (grey) or could not (red); their numbers are listed."),
    "way": ("way", "Of the search from its start to the lamps that were found, or of lamps that move, in blue."),
    "truth": ("true lamps", "True places of the lamps where they are known, in green."),
    "cameras": (
        "cameras",
        "Of photographs that are searched (white) and of others (violet); a click looks through one.",
    ),
}

_FOUND, _TRUE, _WAY = (255, 140, 0), (0, 160, 80), (90, 170, 255)
_TAKEN, _FURTHER, _ADVISED = (230, 230, 230), (180, 130, 230), (255, 220, 60)
_RULED_OUT, _OPEN = (150, 150, 160), (220, 60, 60)


class Drawings:
    """Things in the scene of a visitor.

    Args:
        scene: the visitor's.
        size: of the frozen scene.
        go_to: is called with the camera that would tell most, where its frustum is clicked.

    Attributes:
        kinds: a node for each of KINDS, with what is of it below; hidden, it hides that.
    """

    def __init__(self, scene: viser.SceneApi, size: float, go_to: Callable[[Camera], None]) -> None:
        self._scene, self._size, self._go_to = scene, size, go_to
        self.kinds = {kind: scene.add_frame(f"/{kind}", show_axes=False) for kind in KINDS}
        self._lamps: list = []
        self._frusta: list = []
        self._advised: list = []
        self._eye: Camera | None = None

    def lamps(self, found: Found | None, truth: LightRig) -> None:
        """Regions of the lamps that were found, the way to them, what they were weighed against, and true lamps.

        Suns stand nowhere, so that nothing is drawn of them.
        """
        _clear(self._lamps)
        scene, size = self._scene, self._size
        if found is not None:
            for index, (light, covariance) in enumerate(zip(found.lights, found.covariance, strict=False)):
                if not light.distant:
                    mesh = region(light.position, covariance, size)
                    self._lamps.append(scene.add_mesh_simple(f"/found/{index}", *mesh, color=_FOUND, opacity=0.5))
            self._lamps += [self._way(index, way) for index, way in enumerate(ways(found.path))]
            for index, other in enumerate(found.alternatives, start=1):
                self._lamps += self._other(index, other)
            for index, light in enumerate(light for light in truth if not light.distant):
                place = tuple(light.position.tolist())
                self._lamps.append(scene.add_icosphere(f"/truth/{index}", TRUTH * size, _TRUE, position=place))

    def cameras(
        self, searched: Sequence[Photograph], others: Sequence[Photograph], look: Callable[[Photograph], None]
    ) -> None:
        """A frustum for each photograph that is searched, and a smaller one for some of the others.

        Args:
            look: is called with the photograph whose frustum is clicked.
        """
        _clear(self._frusta)
        some = [others[index] for index in spread_frames(len(others), MOST_FURTHER)]
        styles = [(one, _TAKEN, FRUSTUM, 2.0) for one in searched] + [(one, _FURTHER, FURTHER, 1.0) for one in some]
        for index, (one, *style) in enumerate(styles):
            self._frusta.append(self._frustum(f"/cameras/{index}", one.camera, partial(look, one), *style))
        self._hide()

    def advised(self, camera: Camera | None) -> None:
        """The camera that would tell most."""
        _clear(self._advised)
        if camera is not None:
            self._advised.append(self._frustum("/cameras/advised", camera, partial(self._go_to, camera), _ADVISED))

    def seen_from(self, camera: Camera) -> None:
        """The visitor looks through another camera, whose own frustum is hidden."""
        self._eye = camera
        self._hide()

    def _hide(self) -> None:
        for frustum in (*self._frusta, *self._advised) if self._eye is not None else ():
            away = float(np.linalg.norm(frustum.position - self._eye.origin.numpy()))
            frustum.visible = away > FRUSTUM * self._size

    def _other(self, number: int, other: ToldAlternative) -> list:
        """Balls at the lamps of an alternative, and the number under which it is told."""
        colour = _RULED_OUT if other.ruled_out else _OPEN
        places = [tuple(light.position.tolist()) for light in other.lights if not light.distant]
        names = [f"/others/{number}/{index}" for index in range(len(places))]
        pairs = zip(names, places, strict=True)
        balls = [self._scene.add_icosphere(name, OTHER * self._size, colour, position=place) for name, place in pairs]
        for name in names:  # goes with its ball
            self._scene.add_label(f"{name}/number", str(number), anchor="bottom-left", font_screen_scale=0.8)
        return balls

    def _way(self, index: int, way: np.ndarray) -> viser.LineSegmentsHandle:
        pairs = np.stack([way[:-1], way[1:]], axis=1)
        return self._scene.add_line_segments(f"/way/{index}", pairs, _WAY, thickness=2.0, thickness_units="screen")

    def _frustum(
        self,
        name: str,
        camera: Camera,
        clicked: Callable[[], None],
        colour: tuple[int, int, int],
        length: float = FRUSTUM,
        thickness: float = 2.0,
    ) -> viser.CameraFrustumHandle:
        position, wxyz, fov = pose_of(camera)
        frustum = self._scene.add_camera_frustum(
            name,
            fov,
            camera.width / camera.height,
            scale=length * self._size,
            thickness=thickness,
            thickness_units="screen",
            color=colour,
            wxyz=wxyz,
            position=position,
        )
        frustum.on_click(lambda _: clicked())
        return frustum


def ways(path: Sequence[LightRig]) -> list[np.ndarray]:
    """(steps, 3) places of each lamp but suns on a way, as far as it had as many lamps as at last."""
    end = next((rig for rig in reversed(path) if rig), ())
    kept = [rig for rig in path if len(rig) == len(end)]
    if len(kept) < 2:
        return []
    placed = [index for index, light in enumerate(end) if not light.distant]
    return [np.array([rig[index].position.tolist() for rig in kept]) for index in placed]


def _clear(drawn: list) -> None:
    for item in drawn:
        item.remove()
    drawn.clear()
