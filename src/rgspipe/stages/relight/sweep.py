"""The sweep of stage relight: from its configuration to the spots of its frames, and their pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import torch

from rgspipe.config.relight import RelightConfig
from rgspipe.errors import InputError
from rgspipe.evaluation.images import save_png
from rgspipe.progress import progress_bar
from rgspipe.relighting.pictures import developed, grid, video
from rgspipe.relighting.sweeps import (
    SpotKind,
    SweepPlaces,
    aim_sweep,
    default_places,
    orbit_sweep,
    spread_frames,
    there_and_back,
)
from rgspipe.scene import Camera, SpotLight
from rgspipe.stages.lights.shape import light_shape
from rgspipe.stages.relight.scene import Relighter
from rgspipe.store.files import write_bytes, write_text

STRIP, VIDEO, TABLE = "strip.png", "sweep.webp", "sweep.csv"

#: Frames of the strip, and of each of its rows.
SHOWN, A_ROW = 8, 4


def write_sweep(relighter: Relighter, camera: Camera, folder: Path) -> list[float]:
    """Write sweep.csv, strip.png and sweep.webp; the seconds of each frame.

    Raises:
        InputError: the spot's way makes no sense, or none of its light meets what the camera sees.
    """
    wanted = relighter.config.relight
    spots = sweep_lights(wanted, _places(relighter, camera))
    images, seconds = [], []
    for spot in progress_bar(spots, "sweeping", unit="frame"):
        (image,), took = relighter.render([camera], (spot,))
        images.append(image.numpy())
        seconds.append(took)
    black = sum(not image.any() for image in images)
    if 0 < black < len(images):
        print(f"{black} of {len(images)} frames are black: the spot may be behind a wall, see relight.path")
    if black == len(images):
        raise InputError(
            "relight.path",
            expected="a spot whose light meets what the camera sees",
            found="black frames",
            remedy="The spot may stand behind a wall: set relight.path.position, or center, radius and height.",
        )
    write_text(folder / TABLE, _table(spots).to_csv(index=False))
    frames = developed(images)
    # A spot that turns plays forth and back; one that goes around ends where it began.
    turns = wanted.sweep == "aim"
    chosen = spread_frames(len(frames), SHOWN, closed=not turns)
    save_png(folder / STRIP, grid([frames[index] for index in chosen], A_ROW))
    shown = there_and_back(frames) if turns else frames
    length = wanted.path.seconds * len(shown) / len(frames)
    write_bytes(folder / VIDEO, video(shown, length))
    return seconds


def sweep_lights(wanted: RelightConfig, places: SweepPlaces) -> list[SpotLight]:
    """The spot of every frame; `places` stand in for what the configuration leaves open.

    Raises:
        InputError: the spot's way makes no sense.
    """
    path = wanted.path
    shape = light_shape("spot", path.spot, "relight.path.spot")
    spot = SpotKind(shape, torch.tensor(path.intensity, dtype=torch.float64))
    if wanted.sweep == "orbit":
        height = places.height if path.height is None else path.height
        return orbit_sweep(_point(path.center, places.center), path.radius or places.radius, height, path.frames, spot)
    start, end = (places.start, places.end) if path.aims is None else (_point(path.aims[:3]), _point(path.aims[3:]))
    try:
        return aim_sweep(_point(path.position, places.position), start, end, path.frames, spot)
    except ValueError as error:
        raise InputError(
            "relight.path.aims",
            expected="two points in different directions from relight.path.position",
            found=str(error),
            remedy="Move one of them.",
        ) from None


def _places(relighter: Relighter, camera: Camera) -> SweepPlaces:
    frozen = relighter.frozen
    across = int(camera.camera_to_world[:2, 0].abs().argmax())
    return default_places(frozen.bounds, frozen.surroundings.open, across)


def _point(values: Sequence[float] | None, otherwise: torch.Tensor | None = None) -> torch.Tensor:
    return otherwise if values is None else torch.tensor(values, dtype=torch.float64)


def _table(spots: Sequence[SpotLight]) -> pd.DataFrame:
    """Where the spot of every frame stands and where it looks."""
    rows = [[frame, *spot.position.tolist(), *spot.direction.tolist()] for frame, spot in enumerate(spots)]
    return pd.DataFrame(rows, columns=["frame", "x", "y", "z", "direction_x", "direction_y", "direction_z"])
