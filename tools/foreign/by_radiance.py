"""Radiance (through `pyradiance`): the program that daylight is planned with."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyradiance

from foreign.cameras import PIXELS, Shot
from foreign.shapes import Lamp, Shape

#: Radius of the ball that stands for a lamp [m]: Radiance has no points. Rays of its own aim at the ball's middle.
BULB = 1e-3
#: Where `rtrace` says that a ray met nothing [m].
NOTHING = 1e9


def photograph(shapes: Mapping[str, Shape], shot: Shot, lamps: Sequence[Lamp], samples: int, seed: int) -> np.ndarray:
    """(H, W, 4) linear radiance, premultiplied, and alpha."""
    within = np.random.default_rng(seed).random((samples, PIXELS * PIXELS, 2))
    ways = np.stack([shot.rays(places) for places in within])
    rays = np.concatenate([np.broadcast_to(shot.eye, ways.shape), ways], axis=-1)
    with tempfile.TemporaryDirectory() as folder:
        octree = Path(folder) / "scene.oct"
        described = "\n".join([*_lamps(lamps), *_surfaces(shapes)])
        octree.write_bytes(_run(["oconv", "-"], described.encode()))
        traced = _run([*_TRACE, str(octree)], rays.astype(np.float32).tobytes())
    values = np.frombuffer(traced, np.float32).reshape(samples, PIXELS, PIXELS, 4)
    met = values[..., 3:] < NOTHING
    return np.concatenate([values[..., :3] * met, met], axis=-1).mean(axis=0).astype(np.float32)


# Paths instead of interpolated light (-aa 0), one at a time (-ad 1), that end by chance once they carry less than a
# tenth (-lr -64 -lw 0.1). Each lamp is asked at its middle and never left out (-dt 0 -dj 0 -ds 0 -dc 1), and chance
# differs from ray to ray (-u+).
_TRACE = (
    f"rtrace -h -fff -n {os.cpu_count()} -u+ -ab 64 -ad 1 -as 0 -aa 0 -lr -64 -lw 0.1 -dt 0 -dj 0 -ds 0 -dc 1 -ovL"
).split()


def _lamps(lamps: Sequence[Lamp]) -> Iterator[str]:
    for index, lamp in enumerate(lamps):
        # A small ball of as much light, that is not seen itself, stands for a point.
        ball, kind, seen = (lamp, "light", "0") if lamp.radius else (replace(lamp, radius=BULB), "illum", "1 void")
        yield f"void {kind} of_lamp_{index} {seen} 0 3 {_numbers(ball.radiance)}"
        yield f"of_lamp_{index} sphere lamp_{index} 0 0 4 {_numbers(ball.place)} {ball.radius!r}"


def _surfaces(shapes: Mapping[str, Shape]) -> Iterator[str]:
    for name, shape in shapes.items():
        yield f"void plastic of_{name} 0 0 5 {_numbers(shape.colour)} 0 0"
        if shape.kind == "sphere":
            yield f"of_{name} sphere {name} 0 0 4 {_numbers(shape.middle)} {shape.radius!r}"
            continue
        vertices, faces = shape.triangles()
        for index, corners in enumerate(vertices[faces]):
            yield f"of_{name} polygon {name}.{index} 0 0 9 {_numbers(corners.ravel())}"


def _numbers(values: Sequence[float] | np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _run(command: Sequence[str], given: bytes) -> bytes:
    """What a program of Radiance makes of its input."""
    programs = Path(pyradiance.BINPATH)
    done = subprocess.run([str(programs / command[0]), *command[1:]], input=given, capture_output=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{command[0]} failed: {done.stderr.decode(errors='replace')}")
    return done.stdout
