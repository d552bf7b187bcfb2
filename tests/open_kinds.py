"""How often `light=auto` tells which kind a light is: right, said to be open, or wrong (minutes).

    python tests/open_kinds.py NUMBER SEED

Lights of all kinds in turn are drawn in the room of `open_room`, and fitted to two views of 40² that the model makes of
a room whose albedo is smoothly 3 % different, with 1 % of noise. Seconds are of this process alone.
"""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import torch
from torch import Tensor

from lit_room import BOX_CENTER, BOX_SIZE
from open_room import frozen_open_room, open_room_cameras, open_surfels
from rgspipe.evaluation.rig_errors import rig_errors
from rgspipe.fitting import FitResult, FitViews, LightSpec
from rgspipe.fitting.findings import ExtentOpen, KindOpen
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Light, PointLight, SpotLight
from rgspipe.scene.lights import LedLight, PanelLight, SphereLight, SunLight

RESOLUTION, WRONG_ALBEDO, NOISE = 40, 0.03, 0.01

#: Lights keep so far away from walls, and from the box.
WALL, BOX = 0.42, 0.08


class Draw:
    """Lights of one seed."""

    def __init__(self, seed: int) -> None:
        self.generator = torch.Generator().manual_seed(seed)

    def between(self, low: float, high: float) -> float:
        return low + (high - low) * float(torch.rand((), generator=self.generator, dtype=torch.float64))

    def place(self) -> list[float]:
        while True:
            place = [self.between(-WALL, WALL) for _ in range(3)]
            if any(abs(a - b) > 0.5 * BOX_SIZE + BOX for a, b in zip(place, BOX_CENTER, strict=True)):
                return place

    def colour(self) -> list[float]:
        return [math.exp(self.between(-0.7, 0.7)) for _ in range(3)]

    def axis(self, place: list[float]) -> Tensor:
        """Towards the floor."""
        aim = [self.between(-0.3, 0.3), self.between(-0.3, 0.3), -0.5]
        return torch.nn.functional.normalize(torch.tensor(aim).double() - torch.tensor(place).double(), dim=0)

    def light(self, kind: str) -> Light:
        place, colour = self.place(), self.colour()
        x, y, _ = place
        make: dict[str, Callable[[], Light]] = {
            "point": lambda: PointLight(place, colour),
            "sun": lambda: SunLight([0.0, 0.0, 0.0], colour, self._through_the_opening()),
            "spot": lambda: SpotLight(place, colour, self.axis(place), "smoothstep", self.between(0.31, 0.7), 0.15),
            "led": lambda: LedLight(place, colour, self.axis(place), self.between(1.0, 16.0)),
            "sphere": lambda: SphereLight(place, colour, self.between(0.02, 0.08)),
            "panel": lambda: PanelLight(
                [0.7 * x, 0.7 * y, 0.498],
                colour,
                [0.0, 0.0, -1.0],
                self.between(0.1, 0.3),
                self.between(0.1, 0.3),
                self.between(-1.5, 1.5),
            ),
        }
        return make[kind]()

    def _through_the_opening(self) -> Tensor:
        ahead = torch.tensor([self.between(-0.5, 0.5), 1.0, self.between(-0.9, 0.2)], dtype=torch.float64)
        return torch.nn.functional.normalize(ahead, dim=0)

    def other_albedo(self, centers: Tensor, albedo: Tensor) -> Tensor:
        waves = 2.0 * math.pi * torch.randn(3, 3, generator=self.generator, dtype=torch.float64)
        phases = 2.0 * math.pi * torch.rand(3, generator=self.generator, dtype=torch.float64)
        error = math.sqrt(2.0) * WRONG_ALBEDO * torch.sin(centers.double() @ waves.T + phases)
        return (albedo.double() * (1.0 + error)).clamp(0.0, 1.0).to(albedo)

    def noisy(self, image: Tensor) -> Tensor:
        return (image + NOISE * image.mean() * torch.randn(image.shape, generator=self.generator)).clamp(min=0.0)


def verdict(result: FitResult, truth: Light) -> str:
    """Right, open or wrong: open where another kind is named, or a sphere as large as the true one."""
    if result.lights and result.lights[0].kind == truth.kind:
        return "right"
    kinds = [one.kind for one in result.findings if isinstance(one, KindOpen)]
    sizes = [one.size for one in result.findings if isinstance(one, ExtentOpen)]
    sphere = isinstance(truth, SphereLight) and any(size >= truth.radius for size in sizes)
    return "open" if truth.kind in kinds or sphere else "wrong"


def main(number: int, seed: int) -> None:
    draw, surfels = Draw(seed), open_surfels()
    wrong = replace(surfels, albedo=draw.other_albedo(surfels.centers, surfels.albedo))
    true = FrozenScene.freeze(wrong, gather_rays=64, patches=150, seed=1)
    cameras, tally = open_room_cameras(RESOLUTION)[:2], Counter()
    views = FitViews.prepare(frozen_open_room(), cameras, lights=LightSpec("auto", shape_free=True))
    kinds = ("point", "sun", "spot", "led", "sphere", "panel")
    for index in range(number):
        truth = draw.light(kinds[index % len(kinds)])
        images = [draw.noisy(true.render(camera, truth)) for camera in cameras]
        began = time.process_time()
        result = views.fit(images)
        seconds, said = time.process_time() - began, verdict(result, truth)
        tally[said] += 1
        found = ", ".join(light.kind for light in result.lights)
        error = 100.0 * rig_errors(result.lights, (truth,), views.prepared.frozen.size).position
        print(f"{truth.kind:6} as {found:6} {said:5} {error:6.2f} % off, {result.status}, {seconds:.1f} s", flush=True)
    print(dict(tally))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
