"""Make the pictures of the guides that need no training: `python tools/guide_pictures.py [NAME …]`, a minute or two.

All are of the small room that comes with the package. NAME is one of PICTURES; all of them if none is named.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import torch
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from PIL import Image

import rgspipe as rg
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.light_file import read_lights
from rgspipe.demo import ROOM, TARGET, demo_scene
from rgspipe.evaluation.calibration import half_axes
from rgspipe.evaluation.images import Bytes, beside, display_gain, signed_difference, stack, tone_map
from rgspipe.renderer.frozen import FrozenScene

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "images"

#: Pixels along a side of a panel.
SIDE = 160

#: A camera in front of the room's open side, and those of a walk around what it holds.
FRONT = ((0.0, -1.5, 0.05), (0.0, 0.0, 0.0))
WALK = (
    ((-0.35, -1.1, 0.2), (0.05, 0.1, -0.1)),
    ((0.0, -1.4, 0.0), (0.0, 0.0, 0.0)),
    ((0.3, -0.9, 0.3), (-0.1, 0.1, -0.2)),
    ((0.4, -1.2, -0.1), (0.0, 0.1, -0.1)),
)

#: Lamps of the photographs of a walk: in front of the room and in it, left and right, high and low.
WALK_LAMPS = ((-0.3, -0.5, 0.2), (0.3, -0.3, 0.35), (0.1, -0.6, -0.3), (-0.15, -0.1, 0.4))


def camera(eye: Sequence[float], aim: Sequence[float], degrees: float = 40.0) -> rg.Camera:
    return rg.Camera.look_at(list(eye), list(aim), fov_degrees=degrees, width=SIDE, height=SIDE)


def captures(scene: FrozenScene) -> Bytes:
    """Training photographs: the same room, each with another lamp and from elsewhere, all of one exposure."""
    pairs = zip(WALK, WALK_LAMPS, strict=True)
    images = [scene.render(camera(*look), rg.PointLight(list(place), 0.4)) for look, place in pairs]
    gain = display_gain(torch.cat(images))
    return beside([tone_map(image, gain) for image in images])


def other_light(scene: FrozenScene) -> Bytes:
    """A target, the same with its lamp off, and what is left: the light of the lamp that is looked for."""
    view = camera(*FRONT)
    on = scene.render(view, rg.PointLight([0.3, 0.25, -0.2], [0.35, 0.3, 0.2]))
    off = scene.render(view, rg.PointLight([0.0, -0.7, 0.3], [0.5, 0.6, 0.8]))
    gain = display_gain(on + off)
    return beside([tone_map(image, gain) for image in (on + off, off, on)])


def target_classes(scene: FrozenScene) -> Bytes:
    """Targets with the lamp in the picture, in front of it, and behind the tall box."""
    view = camera(*FRONT)
    places = ([0.15, -0.1, 0.2], [0.1, -1.3, 0.5], [-0.3, 0.28, -0.1])
    return beside([tone_map(scene.render(view, rg.PointLight(place, 0.6))) for place in places])


def gradients(scene: FrozenScene) -> Bytes:
    """The goal of the tutorial's descent by gradients, its start, 10 steps, and its end; differences below."""
    view, power = camera(*FRONT), [0.8, 0.7, 0.6]
    goal = scene.render(view, rg.PointLight([-0.25, -0.2, 0.25], power))
    position = torch.tensor([0.3, -0.2, -0.1], requires_grad=True)
    optimiser, seen = torch.optim.Adam([position], lr=0.04), []
    for _ in range(40):
        optimiser.zero_grad()
        seen.append(scene.render(view, rg.PointLight(position, power)))
        ((seen[-1] + 0.01).log() - (goal + 0.01).log()).square().mean().backward()
        optimiser.step()
    gain, shown = display_gain(goal), [seen[step].detach() for step in (0, 10, 39)]
    upper = [tone_map(image, gain) for image in (goal, *shown)]
    lower = [np.full_like(upper[0], 255), *(signed_difference(goal, image, gain) for image in shown)]
    return stack([beside(upper), beside(lower)])


def regions(scene: FrozenScene) -> Bytes:
    """The hidden lamp from above, as far as one and three photographs tell it, and where two lamps are asked for."""
    target, truth = load_target(TARGET), read_lights(ROOM / "truth" / f"{TARGET.name}.json")
    asked = (("one photograph", 1, 1), ("three photographs", 3, 1), ("three, two lamps asked for", 3, 2))
    figure = Figure(figsize=(8.4, 3.1), dpi=100, layout="constrained")
    for index, (title, views, count) in enumerate(asked, start=1):
        axes = figure.add_subplot(1, 3, index)
        cameras, images = zip(*((one.camera, one.image) for one in target.views[:views]), strict=True)
        result = rg.fit_lights(scene, list(cameras), list(images), lights=rg.LightSpec("point", count=count))
        axes.set_title(f"{title}:\n{result.status.replace('_', ' ')}", fontsize=9)
        _from_above(axes, scene, result, truth)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3])


def _from_above(axes, scene: FrozenScene, result: rg.FitResult, truth) -> None:
    places, albedo = scene.surfels.centers.numpy(), scene.surfels.albedo.numpy()
    low = np.abs(places[:, 2]) < 0.45  # neither floor nor ceiling
    axes.scatter(places[low, 0], places[low, 1], s=1.0, c=albedo[low].clip(0.0, 0.9), linewidths=0)
    for light, covariance in zip(result.lights, result.covariance, strict=True):
        # The shadow of the ellipsoid on the plane: its covariance is the part of x and y.
        flat = torch.zeros(3, 3, dtype=torch.float64)
        flat[:2, :2] = covariance[:2, :2]
        lengths, turns = half_axes(flat, scene.size)
        first, second = np.argsort(lengths)[::-1][:2]
        degrees = float(np.degrees(np.arctan2(turns[1, first], turns[0, first])))
        sides = 2.0 * lengths[first], 2.0 * lengths[second]
        axes.add_patch(Ellipse(tuple(light.position[:2].tolist()), *sides, angle=degrees, color="#ff8c00", alpha=0.5))
        axes.plot(*light.position[:2].tolist(), "o", color="#b35f00", markersize=4)
    for light in truth:
        axes.plot(*light.position[:2].tolist(), "+", color="#00804d", markersize=10)
    axes.set(aspect="equal", xlim=(-0.6, 0.6), ylim=(-0.6, 0.6), xticks=[-0.5, 0, 0.5], yticks=[-0.5, 0, 0.5])


PICTURES: dict[str, Callable[[FrozenScene], Bytes]] = {
    "captures": captures,
    "other_light": other_light,
    "target_classes": target_classes,
    "gradients": gradients,
    "regions": regions,
}

#: Of lines and letters, which are kept as they are.
DRAWN = ("regions",)


if __name__ == "__main__":
    room = demo_scene()
    for name in sys.argv[1:] or PICTURES:
        path = IMAGES / f"{name}{'.png' if name in DRAWN else '.jpg'}"
        Image.fromarray(PICTURES[name](room)).save(path, optimize=True, quality=90)
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")
