"""What a visitor takes home: lamps, also for other programs, a still and a video."""

from __future__ import annotations

import io
import math
import tempfile
import zipfile
from collections.abc import Sequence
from concurrent.futures import Future
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.evaluation.images import png_bytes
from rgspipe.light_export.export import export_lights
from rgspipe.light_export.world import World
from rgspipe.relighting.pictures import video
from rgspipe.scene import Camera, LightRig, look_at
from rgspipe.viewer.actions import Action
from rgspipe.viewer.visit import Visit

#: Frames of a turntable, its length in seconds, and how far to each side it swings, degrees.
FRAMES, SECONDS, SWING = 24, 4.0, 20.0


class Saving:
    """Buttons that have the browser save something."""

    def __init__(self, visit: Visit) -> None:
        self._visit, self._session, self._turn = visit, visit.session, visit.exhibit.turn
        actions = (
            Action("lights.json", "B", "Save the lamps as a light file.", self._lights),
            Action("lamps.zip", "H", "The lamps for Blender, USD, glTF, Mitsuba, three.js and as IES.", self._export),
            Action("still.png", "M", "Save the sharp picture.", self._still),
            Action("swing.webp", "Y", "Save a video in which the camera swings around what it looks at.", self._video),
        )
        visit.actions.offer(*actions)

    def _lights(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "lights.json"
            self._session.save(path)
            self._send("lights.json", path.read_bytes())

    def _export(self) -> None:
        session = self._session
        exhibit, found = self._visit.exhibit, session.found_now
        regions, doubt = ((), "") if found is None else (found.covariance, found.doubt)
        notes = [*filter(None, [doubt]), *exhibit.notes]
        self._send("lamps.zip", exported(session.lights, exhibit.world, session.ambient, regions, notes))

    def _still(self) -> None:
        if (camera := self._visit.camera()) is not None:
            with self._turn:
                picture, _ = self._session.picture(self._session.seen(camera))
            self._send("still.png", png_bytes(picture))

    def _video(self) -> None:
        if (camera := self._visit.camera()) is None:
            return
        told = self._visit.client.add_notification(
            "swing.webp", "Making the video …", loading=True, auto_close_seconds=None
        )
        lower, upper = (corner.double().cpu() for corner in self._session.images.frozen.bounds)

        def made() -> bytes:
            images = [self._image(one) for one in swing(camera, 0.5 * (lower + upper))]
            return video(self._session.pictures(images)[0], SECONDS)

        def take(ended: Future) -> None:
            told.remove()
            self._send("swing.webp", ended.result())

        self._visit.actions.beside("swing.webp", made, take)

    def _image(self, camera: Camera) -> Tensor:
        with self._turn:  # Between two frames others have their turn.
            return self._session.image(self._session.seen(camera), "soft")

    def _send(self, name: str, content: bytes) -> None:
        self._visit.client.send_file_download(name, content, save_immediately=True)


def exported(
    lights: LightRig,
    world: World,
    ambient: Tensor | None = None,
    covariances: Sequence[Tensor] = (),
    notes: Sequence[str] = (),
) -> bytes:
    """A zip file of lamps in the formats of other programs, with what `export_lights` takes beside them."""
    buffer = io.BytesIO()
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        export_lights(lights, folder, world=world, ambient=ambient, covariances=covariances, notes=notes)
        for path in sorted(Path(folder).iterdir()):
            archive.write(path, path.name)
    return buffer.getvalue()


def swing(camera: Camera, middle: torch.Tensor) -> list[Camera]:
    """The camera on an arc around the vertical through `middle` (3,), there and back, aimed at what it looks at."""
    forward = -camera.camera_to_world[:3, 2]
    distance = max(float((middle - camera.origin) @ forward), 1e-3 * float((middle - camera.origin).norm()) + 1e-9)
    aim = camera.origin + distance * forward
    turns = [math.radians(SWING) * math.sin(2.0 * math.pi * frame / FRAMES) for frame in range(FRAMES)]
    return [_turned(camera, aim, turn) for turn in turns]


def _turned(camera: Camera, aim: torch.Tensor, turn: float) -> Camera:
    away, cos, sin = camera.origin - aim, math.cos(turn), math.sin(turn)
    moved = torch.stack([cos * away[0] - sin * away[1], sin * away[0] + cos * away[1], away[2]])
    pose = look_at(aim + moved, aim)
    numbers = (camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height)
    return Camera(pose, *numbers)
