"""LuxCore: each photograph in a process of its own, as the library replaces `malloc` and does not end cleanly."""

from __future__ import annotations

import math
import multiprocessing
import os
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from foreign.cameras import PIXELS, Shot
from foreign.shapes import Lamp, Shape


def photograph(shapes: Mapping[str, Shape], shot: Shot, lamps: Sequence[Lamp], samples: int, seed: int) -> np.ndarray:
    """(H, W, 4) linear radiance, premultiplied, and alpha.

    Raises:
        ValueError: a lamp is a ball. Of triangles that glow, single pixels come out thousands of times too bright.
    """
    if any(lamp.radius for lamp in lamps):
        raise ValueError("LuxCore photographs points alone here; ask Mitsuba or Radiance for lamps with a radius.")
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder) / "image.npy"
        given = (shapes, shot, lamps, samples, seed, image)
        process = multiprocessing.get_context("spawn").Process(target=_photograph, args=given)
        process.start()
        process.join()
        if not image.exists():
            raise RuntimeError(f"LuxCore ended with {process.exitcode} and without an image; what it wrote is above.")
        return np.load(image)


def _camera(shot: Shot) -> dict[str, list[Any]]:
    # LuxCore counts rows of the film from below, the first of them as row 1: its images stand a pixel too low.
    up = 2.0 / PIXELS
    return {
        "type": ["perspective"],
        "lookat.orig": shot.eye.tolist(),
        "lookat.target": shot.aim.tolist(),
        "up": [0.0, 0.0, 1.0],
        "fieldofview": [shot.degrees],
        "screenwindow": [-1.0, 1.0, -1.0 - up, 1.0 - up],
        "autofocus.enable": [False],
        "cliphither": [1e-3],
    }


def _point(lamp: Lamp) -> dict[str, list[Any]]:
    """Its intensity is gain · colour / 4π where no power is given."""
    return {
        "type": ["point"],
        "position": lamp.place.tolist(),
        "color": [1.0, 1.0, 1.0],
        "gain": (4.0 * math.pi * lamp.intensity).tolist(),
        "power": [0.0],
        "normalizebycolor": [False],
    }


def _rows(values: np.ndarray) -> list[tuple[float, ...]]:
    return [tuple(row) for row in values.tolist()]


def _engine(samples: int, seed: int) -> dict[str, list[Any]]:
    return {
        "renderengine.type": ["PATHCPU"],
        "renderengine.seed": [1 + seed % 1_000_000],
        "native.threads.count": [os.cpu_count() or 1],
        "sampler.type": ["RANDOM"],
        "film.width": [PIXELS],
        "film.height": [PIXELS],
        "film.filter.type": ["NONE"],
        "film.imagepipelines.0.0.type": ["NOP"],
        "film.outputs.0.type": ["RGB"],
        "film.outputs.0.filename": ["rgb.exr"],
        "film.outputs.1.type": ["ALPHA"],
        "film.outputs.1.filename": ["alpha.exr"],
        "path.pathdepth.total": [64],
        "path.pathdepth.diffuse": [64],
        # Its roulette asks the mean of the colours, and what survives of a saturated one grows without bound.
        "path.russianroulette.depth": [64],
        "path.clamping.variance.maxvalue": [0.0],
        "batch.haltspp": [samples],
    }


def _photograph(
    shapes: Mapping[str, Shape],
    shot: Shot,
    lamps: Sequence[Lamp],
    samples: int,
    seed: int,
    path: Path,
) -> None:
    """What the process of its own does: it never returns."""
    # The library greets on standard output.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    import pyluxcore as lux

    def properties(prefix: str, values: Mapping[str, list[Any]]) -> Any:
        made = lux.Properties()
        for key, value in values.items():
            made.Set(lux.Property(f"{prefix}{key}", value))
        return made

    lux.Init(lambda *_: None)
    scene = lux.Scene()
    scene.Parse(properties("scene.camera.", _camera(shot)))
    for index, lamp in enumerate(lamps):
        scene.Parse(properties(f"scene.lights.lamp_{index}.", _point(lamp)))
    for name, shape in shapes.items():
        vertices, faces = shape.triangles()
        # What is round is lit as round.
        normals = _rows((vertices - shape.middle) / shape.radius) if shape.kind == "sphere" else None
        scene.DefineMesh(name, _rows(vertices), _rows(faces), normals, None, None, None)
        scene.Parse(properties(f"scene.materials.{name}.", {"type": ["matte"], "kd": shape.colour.tolist()}))
        scene.Parse(properties(f"scene.objects.{name}.", {"material": [name], "shape": [name]}))
    session = lux.RenderSession(lux.RenderConfig(properties("", _engine(samples, seed)), scene))
    session.Start()
    while not session.HasDone():
        time.sleep(0.05)
        session.UpdateStats()
    session.Stop()
    channels = []
    for kind, width in ((lux.FilmOutputType.RGB, 3), (lux.FilmOutputType.ALPHA, 1)):
        values = np.zeros(PIXELS * PIXELS * width, np.float32)
        session.GetFilm().GetOutputFloat(kind, values)
        channels.append(values.reshape(PIXELS, PIXELS, width)[::-1])
    np.save(path, np.concatenate(channels, axis=-1))
    os._exit(0)
