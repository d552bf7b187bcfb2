"""How long freezing, training, images and fits take on the CPU and on a GPU, and whether they agree: `make devices`.

Everything is made here: a Cornell box of 10 000 surfels, its photographs under known lamps and under unknown ones.
Times are medians after a first run, which compiles kernels and fills caches; all of one run of this program.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import torch

import rgspipe as rg
from rgspipe.datasets.views import View
from rgspipe.machine.device import finish
from rgspipe.viewer.lamp_images import LampImages

#: Runs that are counted, and seconds from which on one is enough.
REPEATS, LONG = 3, 5.0

SURFELS, VIEWS, STEPS = 10_000, 30, 20

#: Standard deviation of the photographs' noise, part of what each pixel holds.
NOISE = 0.01

LAMP = rg.PointLight([-0.3, 0.28, -0.1], [0.6, 0.8, 0.8])


@dataclass(frozen=True)
class Room:
    """The box, and what cameras see of it.

    Attributes:
        surfels: true ones.
        photographs: under one known lamp each, for a training.
        cameras: three that look in.
        images: of `LAMP` in them.
    """

    surfels: rg.Surfels
    photographs: tuple[View, ...]
    cameras: tuple[rg.Camera, ...]
    images: tuple[torch.Tensor, ...]

    @classmethod
    def made(cls) -> Room:
        surfels, generator = rg.exact_surfels(rg.CornellBox(), SURFELS), torch.Generator().manual_seed(0)
        scene = rg.FrozenScene.freeze(surfels)

        def photograph(camera: rg.Camera, lamp: rg.PointLight) -> torch.Tensor:
            image = scene.render(camera, lamp).detach()
            return image * (1.0 + NOISE * torch.randn(image.shape, generator=generator))

        views = []
        for index in range(VIEWS):
            eye, lamp = (0.8 * (torch.rand(3, generator=generator) - 0.5) for _ in range(2))
            camera = rg.Camera.look_at([2 * eye[0], -1.5, eye[2]], [0, 0, 0], width=128, height=128)
            known = rg.PointLight(lamp.double(), [1.0, 0.8, 1.2])
            views.append(View(f"train/{index}", camera, photograph(camera, known), torch.ones(128, 128), known))
        cameras = tuple(rg.Camera.look_at([x, -1.5, 0.05], [0, 0, 0], width=128, height=128) for x in (0.0, -0.3, 0.3))
        return cls(surfels, tuple(views), cameras, tuple(photograph(camera, LAMP) for camera in cameras))


def main() -> None:
    """Print a table: seconds on each device, and the ratio."""
    devices = ["cpu", "cuda"] if torch.cuda.is_available() else ["cpu"]
    named = {"cpu": f"{torch.get_num_threads()} threads"}
    if "cuda" in devices:
        named["cuda"] = torch.cuda.get_device_name()
    print(", ".join(f"{device}: {named[device]}" for device in devices), flush=True)
    room = Room.made()
    scenes = {device: rg.FrozenScene.freeze(room.surfels.to(device)).with_dictionary() for device in devices}
    works: dict[str, Callable[[str], object]] = {
        "freeze": lambda device: rg.FrozenScene.freeze(room.surfels.to(device)).with_dictionary(),
        "image of 128², prepared": _prepared(scenes, room),
        "picture of 256² as a lamp moves, soft": _dragged(scenes, "soft"),
        "picture of 256² as a lamp moves, sharp": _dragged(scenes, "sharp"),
        "fit of a point, 1 view": lambda device: _fit(scenes[device], room, 1),
        "fit of a point, 3 views": lambda device: _fit(scenes[device], room, 3),
        f"training: {VIEWS} views of 128², {STEPS} steps": lambda device: _trained(room, device),
    }
    for name, work in works.items():
        times, told = zip(*(_median(work, device) for device in devices), strict=True)
        shown = " ".join(f"{device} {1e3 * seconds:.1f} ms" for device, seconds in zip(devices, times, strict=True))
        ratio = f", {times[0] / times[1]:.1f} times" if len(times) > 1 else ""
        print(f"{name}: {shown}{ratio}{_agreement(told)}", flush=True)


def _median(work: Callable[[str], object], device: str) -> tuple[float, object]:
    """Seconds of one run, after one that is not counted, and what came out."""
    times, began = [], time.perf_counter()
    found = work(device)
    finish(torch.device(device))
    for _ in range(1 if time.perf_counter() - began > LONG else REPEATS):
        began = time.perf_counter()
        found = work(device)
        finish(torch.device(device))
        times.append(time.perf_counter() - began)
    return statistics.median(times), found


def _prepared(scenes: dict[str, rg.FrozenScene], room: Room) -> Callable[[str], object]:
    views = {device: scene.view(room.cameras[0]) for device, scene in scenes.items()}
    return lambda device: scenes[device].render(views[device], LAMP)


def _dragged(scenes: dict[str, rg.FrozenScene], quality: str) -> Callable[[str], object]:
    camera = rg.Camera.look_at([0, -1.5, 0.05], [0, 0, 0], width=256, height=256)
    images = {device: LampImages(scene) for device, scene in scenes.items()}
    moved = dict.fromkeys(scenes, 0)

    def picture(device: str) -> torch.Tensor:
        moved[device] += 1
        lamp = replace(LAMP, position=LAMP.position + 0.002 * moved[device])
        return images[device].image(camera, (lamp,), quality)

    return picture


def _fit(scene: rg.FrozenScene, room: Room, count: int) -> object:
    return rg.fit_lights(scene, room.cameras[:count], room.images[:count])


def _trained(room: Room, device: str) -> object:
    start = replace(room.surfels, albedo=torch.full_like(room.surfels.albedo, 0.5))
    return rg.train(room.photographs, start, rg.TrainOptions(steps=STEPS, unseen=False), device=device)


def _agreement(told: Sequence[object]) -> str:
    """How far apart what came out is."""
    if len(told) < 2:
        return ""
    if isinstance(told[0], rg.FitResult):
        first, second = (one.lights[0].position.cpu() for one in told)
        return f"; places {float((first - second).norm()):.1e} apart"
    if isinstance(told[0], torch.Tensor):
        first, second = (one.detach().cpu() for one in told)
        return f"; {float((first - second).abs().max() / first.abs().max()):.1e} of the brightest pixel apart"
    if isinstance(told[0], rg.Trained):
        return "; " + " and ".join(f"{one.records[-1].psnr:.2f} dB" for one in told)
    return ""


if __name__ == "__main__":
    main()
