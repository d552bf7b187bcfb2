"""Whether this machine computes what it should, and how fast: small scenes in memory whose light is known.

Nothing is read or written. The lamps are looked for in a scene of 2000 surfels, in images of one of 8000 with other
rays: so the errors are those of a discretised scene, and not the last bits of the same one.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass

import torch

from rgspipe.fitting.fit import fit_lights
from rgspipe.machine.device import finish
from rgspipe.renderer.effects import Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Camera, PointLight
from rgspipe.scene.models.cornell import CornellBox
from rgspipe.scene.models.exact import exact_surfels
from rgspipe.scene.rectangles import inside_of_box, surfels_on

#: Where lamps are, in a room of side 1: in the open, beside and behind the boxes.
LAMPS = ((-0.3, 0.28, -0.1), (0.1, -0.2, 0.3), (0.3, 0.1, 0.0))

#: Reflectance of the empty room.
ALBEDO = 0.5


@dataclass(frozen=True)
class Figure:
    """A figure of accuracy or speed.

    Attributes:
        name: what was measured.
        value: as it was.
        documented: what the docs say, measured on the laboratory's machine (docs/reference/doctor.md).
        limit: from which on something is wrong; infinite for times.
        unit: of the three: "", "%" or "s".
    """

    name: str
    value: float
    documented: float
    limit: float = math.inf
    unit: str = ""

    @property
    def is_right(self) -> bool:
        """False for NaN, too."""
        return self.value <= self.limit


def self_check(device: torch.device | str = "cpu") -> Iterator[Figure]:
    """Measure, one figure after the other: direct light and bounces in an empty room against their closed forms, a
    scene that is frozen, and three lamps that are found. Five seconds, and seven more where kernels are compiled.
    """
    device = torch.device(device)
    yield from _closed_forms(device)
    begin = time.perf_counter()
    scene = FrozenScene.freeze(exact_surfels(CornellBox(), 2000).to(device))
    finish(device)
    yield Figure("a scene of 2000 surfels frozen", time.perf_counter() - begin, 1.1, unit="s")
    yield from _lamps(scene)


def _closed_forms(device: torch.device) -> Iterator[Figure]:
    walls = inside_of_box([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [ALBEDO] * 3)
    room = FrozenScene.freeze(surfels_on(walls, 1000).to(device), gather_rays=64, patches=150)
    towards = -room.surfels.centers.double()
    distance = towards.norm(dim=1)
    cosine = (towards * room.surfels.normals).sum(dim=1) / distance
    # L = ρ/π I cosθ/r², of a lamp in the middle of the room.
    expected = ALBEDO / math.pi * cosine / distance**2
    light = (PointLight([0.0, 0.0, 0.0], 1.0),)
    direct = room.radiance_of(light, Effects(interreflection=False))[:, 0]
    name = "direct light in an empty room, relative error of the worst surfel"
    yield Figure(name, float((direct / expected - 1.0).abs().max()), 3.4e-6, 1e-4)
    # B = E/(1 − ρ) where all surfaces emit E.
    emission = torch.ones(len(room.surfels), 3, 1, device=device)
    radiosity = emission + room.transport.indirect(emission)
    error = float(((1.0 - ALBEDO) * radiosity - 1.0).abs().max())
    yield Figure("all bounces in an empty room, relative error of the worst surfel", error, 7.2e-7, 3e-5)


def _lamps(scene: FrozenScene) -> Iterator[Figure]:
    surfels = exact_surfels(CornellBox(), 8000).to(scene.device)
    fine = FrozenScene.freeze(surfels, gather_rays=128, seed=1)
    camera = Camera.look_at([0.0, -1.5, 0.05], [0.0, 0.0, 0.0], fov_degrees=40.0, width=96, height=96)
    errors, seconds = [], []
    for place in LAMPS:
        image = fine.render(camera, PointLight(place, [0.6, 0.8, 0.8]))
        begin = time.perf_counter()
        lights = fit_lights(scene, camera, image).lights
        seconds.append(time.perf_counter() - begin)
        errors.append(min(math.dist(light.position.tolist(), place) for light in lights))
    yield Figure("three lamps found in a Cornell box, the worst", 100.0 * max(errors), 0.11, 0.5, "% of the room")
    # The first of them builds the dictionary of the scene.
    yield Figure("a lamp found, median", statistics.median(seconds), 0.28, unit="s")
