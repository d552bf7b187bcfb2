"""Make the pictures of the guides that need no training: `python tools/guide_pictures.py [NAME …]`, some minutes.

Nearly all are of the small room that comes with the package. NAME is one of PICTURES; all of them if none is named.
`settings` needs Chromium and Playwright, `cluster` Slurm (Debian: slurm-wlm and munge).
"""

from __future__ import annotations

import io
import math
import os
import re
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
import torch
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, Patch, Rectangle
from PIL import Image

import rgspipe as rg
from rgspipe.cli import main
from rgspipe.cli.compose import compose_config
from rgspipe.datasets.exr import read_image
from rgspipe.datasets.gs3 import load_target
from rgspipe.datasets.light_file import read_lights
from rgspipe.demo import GATHER_RAYS, PATCHES, ROOM, TARGET, demo_scene
from rgspipe.evaluation.calibration import half_axes
from rgspipe.evaluation.images import Bytes, beside, display_gain, signed_difference, stack, tone_map
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import LightRig
from rgspipe.stages import Stage, load_stage
from rgspipe.viewer.lamp_images import LampImages
from rgspipe.viewer.session import SHOWN, Session

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"

#: Pixels along a side of a panel.
SIDE = 160

#: What the guide on sweeps varies.
SWEPT = ("views.count=1,3", "target_capture.noise=0,0.1,0.3,1")

#: What a job of it may do, and the colours of that.
DOING = {
    "waits for a core": "#e4e7eb",
    "starts": "#aab2bd",
    "freezes the scene": "#e8a33d",
    "waits for it": "#f6dcb2",
    "fits": "#4a7fb5",
}

#: In what a job prints: when it began and ended, and how long each stage took that it made or waited for.
STAMP = re.compile(r"^submitit INFO \(([^)]+)\)", re.MULTILINE)
MADE = re.compile(r"^(\w+): made( by another process)? in ([\d.]+) s", re.MULTILINE)

#: A row of the laboratory's table of times, CPU before GPU, and its units.
TIMED = re.compile(r"^\| (.+?) \| ([\d.]+) (m?s) \| ([\d.]+) (m?s) \| ([\d.]+) times \|$", re.MULTILINE)
SECONDS = {"s": 1.0, "ms": 1e-3}

#: The stage that the guide adds: the first block of Python on its page.
ADDED = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)

#: The row of Settings that is shown with those around it, and how wide the page is, pixels.
SETTING, WIDE = "fit.search.starts", 1000

#: The room that is captured: its surfels, pixels along a side of its photographs, and the lamps that are on in them.
SMALL, COARSE = 1500, 48
TWO_LAMPS = (rg.PointLight([-0.25, -0.1, 0.3], [0.5, 0.42, 0.3]), rg.PointLight([0.3, 0.3, 0.1], [0.12, 0.16, 0.2]))

#: How bright albedo is shown: white is no white page.
ALBEDO_GAIN = 0.7

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


def camera(eye: Sequence[float], aim: Sequence[float], degrees: float = 40.0, side: int = SIDE) -> rg.Camera:
    return rg.Camera.look_at(list(eye), list(aim), fov_degrees=degrees, width=side, height=side)


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
        _from_above(axes, scene, result.lights, result.covariance, truth)
    return drawn(figure)


def _from_above(axes, scene: FrozenScene, lights: LightRig, covariances, truth: LightRig) -> None:
    """The room without floor and ceiling, lamps with their regions, and crosses where they are in truth."""
    places, albedo = scene.surfels.centers.numpy(), scene.surfels.albedo.numpy()
    low = np.abs(places[:, 2]) < 0.45  # neither floor nor ceiling
    axes.scatter(places[low, 0], places[low, 1], s=1.0, c=albedo[low].clip(0.0, 0.9), linewidths=0)
    for light, covariance in zip(lights, covariances, strict=True):
        # The shadow of the ellipsoid on the plane: its covariance is the part of x and y.
        flat = torch.zeros(3, 3, dtype=torch.float64)
        flat[:2, :2] = torch.as_tensor(covariance)[:2, :2]
        lengths, turns = half_axes(flat, scene.size)
        first, second = np.argsort(lengths)[::-1][:2]
        degrees = float(np.degrees(np.arctan2(turns[1, first], turns[0, first])))
        sides = 2.0 * lengths[first], 2.0 * lengths[second]
        axes.add_patch(Ellipse(tuple(light.position[:2].tolist()), *sides, angle=degrees, color="#ff8c00", alpha=0.5))
        axes.plot(*light.position[:2].tolist(), "o", color="#b35f00", markersize=4)
    for light in truth:
        axes.plot(*light.position[:2].tolist(), "+", color="#00804d", markersize=10)
    axes.set(aspect="equal", xlim=(-0.6, 0.6), ylim=(-0.6, 0.6), xticks=[-0.5, 0, 0.5], yticks=[-0.5, 0, 0.5])


def exported(scene: FrozenScene) -> Bytes:
    """The target whose lamp is hidden, Blender under the lamp that was found and exported, and the difference."""
    target = load_target(TARGET)
    cameras, images = zip(*((one.camera, one.image) for one in target.views), strict=True)
    found = rg.fit_lights(scene, list(cameras), list(images))
    with TemporaryDirectory() as name:
        folder = Path(name)
        rg.export_lights(found.lights, folder, ["blend"], covariances=found.covariance)
        path = folder / "rendered.exr"
        program = Path(__file__).with_name("render_exported.py")
        subprocess.run([sys.executable, str(program), str(folder / "lamps_blender.py"), str(path)], check=True)
        rendered = torch.as_tensor(read_image(path)[0])
    gain = display_gain(images[0])
    shown = [tone_map(image, gain) for image in (images[0], rendered)]
    return beside([*shown, signed_difference(images[0], rendered, gain)])


def scan(scene: FrozenScene) -> Bytes:
    """What a scan gives: photographs of a walk under one lamp, and below them their depth (near: bright)."""
    lamp, cameras = rg.PointLight([0.1, -0.1, 0.35], 0.6), [camera(*look) for look in WALK]
    images = [scene.render(one, lamp) for one in cameras]
    gain = display_gain(torch.cat(images))
    depths = torch.cat([_depth(scene, one) for one in cameras])
    nearness = (depths.max() - depths) / (depths.max() - depths[depths > 0.0].min())
    grey = (255.0 * nearness * (depths > 0.0)).byte().expand(-1, -1, 3).split(SIDE)
    return stack([beside([tone_map(image, gain) for image in images]), beside([one.numpy() for one in grey])])


def _depth(scene: FrozenScene, one: rg.Camera) -> torch.Tensor:
    """(H, W, 1) planar depth; 0 where there is no surface."""
    pose = one.camera_to_world
    ahead = -(scene.surfels.centers.double() - pose[:3, 3]) @ pose[:3, 2]
    return scene.view(one).image(ahead.float()[:, None])


def photographs(_: FrozenScene) -> Bytes:
    """Photographs under two lamps that nobody measured; the albedo that was found with them, and they from above.

    They are of the same room, but of few surfels whose albedo is known, as captures take minutes of many.
    """
    scene = FrozenScene.freeze(rg.exact_surfels(rg.CornellBox(), SMALL), gather_rays=64, patches=200)
    cameras = [camera(*look, 48.0, COARSE) for look in _half_around()]
    images = [scene.render(one, TWO_LAMPS) for one in cameras]
    pairs = enumerate(zip(cameras, images, strict=True))
    views = [rg.View(f"view {k}", *pair, torch.ones(COARSE, COARSE)) for k, pair in pairs]
    unknown = replace(scene.surfels, albedo=torch.full_like(scene.surfels.albedo, 0.5))
    found = rg.capture_scene(views, unknown, rg.CaptureOptions(gather_rays=64))
    # What closes the room where no camera saw it stands behind the surfels that were given.
    painted = replace(scene, surfels=replace(scene.surfels, albedo=found.surfels.albedo[: len(scene.surfels)]))
    gain, middle = display_gain(torch.cat(images)), len(images) // 2
    albedo = tone_map(scene.view(cameras[middle]).image(painted.surfels.albedo), ALBEDO_GAIN)
    figure = Figure(figsize=(8.4, 2.5), dpi=100, layout="constrained")
    places = figure.subplots(1, 4)
    shown = [tone_map(images[index], gain) for index in (0, middle)]
    titles = ("a photograph", "another one", "its albedo, as found", "lamps, from above")
    for axes, title, picture in zip(places, titles, (*shown, albedo, None), strict=True):
        axes.set_title(title, fontsize=9)
        if picture is not None:
            axes.imshow(picture)
            axes.set_axis_off()
    _from_above(places[-1], painted, found.lamps, found.certainty.places, TWO_LAMPS)
    return drawn(figure)


def _half_around() -> Iterator[tuple[tuple[float, float, float], tuple[float, float, float]]]:
    """Eight places on half a circle in front of the room, and what is looked at from there."""
    for k in range(8):
        angle = math.radians(-50.0 + 100.0 * k / 7)
        eye = 1.25 * math.sin(angle), 0.1 - 1.3 * math.cos(angle), (-0.2, 0.25, 0.0)[k % 3]
        yield eye, (0.05 * math.sin(3 * k), 0.0, -0.05)


def ply(scene: FrozenScene) -> Bytes:
    """What a PLY file holds: the albedo, or the light of a lamp; and the file read back, under another lamp."""
    view, lamp = camera(*FRONT), rg.PointLight([0.1, -0.1, 0.3], 0.6)
    with TemporaryDirectory() as name:
        path = Path(name) / "surfels.ply"
        rg.save_ply(path, scene.surfels)
        read, _ = rg.load_ply(path)
    back = FrozenScene.freeze(read, gather_rays=GATHER_RAYS, patches=PATCHES)
    seen = scene.view(view)
    lit = [seen.image(scene.radiance_of((lamp,))), back.render(view, rg.PointLight([-0.3, 0.28, -0.1], 0.6))]
    return beside([tone_map(seen.image(scene.surfels.albedo), ALBEDO_GAIN), *map(tone_map, lit)])


def sweep(scene: FrozenScene) -> Bytes:
    """What the guide's sweep of the demo's target finds: errors of the hidden lamp over noise, by views."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        if main(["-m", "stage=evaluate", *_of_room(scene, folder), "launcher=basic", *SWEPT]):
            sys.exit("the sweep failed")
        [path] = folder.glob("outputs/runs/*_sweep/table.csv")
        table = pd.read_csv(path)
    errors = table.pivot(index="target_capture.noise", columns="views.count", values="position_error")
    figure = Figure(figsize=(4.2, 2.6), dpi=100, layout="constrained")
    axes = figure.add_subplot()
    (100.0 * errors).plot(ax=axes, marker="o", ylim=(0.0, None), ylabel="position error, % of the room")
    return drawn(figure)


def _of_room(scene: FrozenScene, folder: Path) -> list[str]:
    """Words of a command that finds the hidden lamp in the room, which is written as a file into the folder."""
    rg.save_ply(folder / "room.ply", scene.surfels)
    words = ["scene=ply", f"scene.path={folder / 'room.ply'}", f"outputs={folder / 'outputs'}", f"fit.target={TARGET}"]
    words += [f"fit.truth={ROOM / 'truth' / TARGET.name}.json"]
    return [*words, f"freeze.gather_rays={GATHER_RAYS}", f"freeze.patches={PATCHES}"]


def cluster(scene: FrozenScene) -> Bytes:
    """What became of each job of the same sweep on a cluster of this machine, which runs four at a time."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        words = [*_of_room(scene, folder), *SWEPT, "launcher=slurm", "hydra.launcher.cpus_per_task=1"]
        command = [sys.executable, "-m", "rgspipe", "-m", "stage=evaluate", *words]
        subprocess.run([sys.executable, str(ROOT / "tests" / "slurm" / "cluster.py"), *command], check=True)
        jobs = sorted(folder.glob("outputs/runs/*_sweep/[0-9]*"), key=lambda job: int(job.name))
        parts = [_parts(job) for job in jobs]
    figure = Figure(figsize=(8.4, 2.8), dpi=100, layout="constrained")
    axes = figure.add_subplot(xlabel="seconds since the jobs were sent", ylabel="job", yticks=range(len(parts)))
    for number, job in enumerate(parts):
        ends = np.cumsum([seconds for _, seconds in job])
        for (words, seconds), end in zip(job, ends, strict=True):
            axes.barh(number, seconds, left=end - seconds, color=DOING[words])
    axes.invert_yaxis()
    handles = [Patch(color=colour, label=words) for words, colour in DOING.items()]
    figure.legend(handles=handles, ncols=len(handles), loc="outside upper center", fontsize=9, frameon=False)
    return drawn(figure)


def _parts(job: Path) -> list[tuple[str, float]]:
    """What a job did, one after the other, and for how many seconds, as what it printed says."""
    text = (job / "slurm.log").read_text()
    began, *_, ended = (datetime.fromisoformat(stamp).timestamp() for stamp in STAMP.findall(text))
    [script] = job.parent.glob("slurm/*_submission.sh")
    stages = [
        ("fits" if name in ("fit_light", "evaluate") else "waits for it" if other else "freezes the scene", float(took))
        for name, other, took in MADE.findall(text)
    ]
    starts = ended - began - sum(seconds for _, seconds in stages)
    return [("waits for a core", began - script.stat().st_mtime), ("starts", starts), *stages]


def gpu(_: FrozenScene) -> Bytes:
    """What the laboratory measured on a GPU, and on the processor beside it."""
    rows = TIMED.findall((ROOT / "docs" / "laboratory" / "gpu.md").read_text())
    figure = Figure(figsize=(8.4, 2.8), dpi=100, layout="constrained")
    axes = figure.add_subplot(xscale="log", xlabel="seconds")
    axes.set_yticks(range(len(rows)), [what for what, *_ in rows], fontsize=9)
    for row, (_, slow, slow_unit, fast, fast_unit, ratio) in enumerate(rows):
        ends = float(fast) * SECONDS[fast_unit], float(slow) * SECONDS[slow_unit]
        axes.plot(ends, (row, row), color=DOING["waits for a core"], linewidth=11, solid_capstyle="butt", zorder=0)
        axes.annotate(f"{ratio} times", (math.sqrt(math.prod(ends)), row), ha="center", va="center", fontsize=8)
        for end, of in zip(ends, ("fits", "freezes the scene"), strict=True):
            axes.plot(end, row, "o", color=DOING[of])
    axes.margins(y=0.12)
    axes.invert_yaxis()
    handles = [Patch(color=DOING[of], label=what) for what, of in (("GPU", "fits"), ("CPU", "freezes the scene"))]
    figure.legend(handles=handles, ncols=2, loc="outside upper center", fontsize=9, frameon=False)
    return drawn(figure)


def drawn(figure: Figure) -> Bytes:
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3])


def kinds(scene: FrozenScene) -> Bytes:
    """One lamp of each kind in the same place, or from where its light comes in; all shown as bright as each other."""
    down, place, unit = [0.3, 0.2, -1.0], [0.05, -0.05, 0.3], [1.0, 1.0, 1.0]
    lamps = {
        "point": rg.PointLight(place, unit),
        "sphere, radius 0.12": rg.SphereLight(place, unit, 0.12),
        "spot, cone 30°": rg.SpotLight(place, unit, down, "gaussian", math.radians(30.0), math.radians(2.0)),
        "led, exponent 4": rg.LedLight(place, unit, down, 4.0),
        "panel, 0.4 × 0.3": rg.PanelLight(place, unit, down, 0.4, 0.3),
        "sun": rg.SunLight([0.0, 0.0, 0.0], unit, [0.5, 1.0, -0.7]),
    }
    figure = Figure(figsize=(7.2, 5.1), dpi=100, layout="constrained")
    for axes, (title, lamp) in zip(figure.subplots(2, 3).flat, lamps.items(), strict=True):
        image = scene.render(camera(*FRONT, side=2 * SIDE), lamp)
        axes.imshow(tone_map(image, display_gain(image)))
        axes.set_title(title, fontsize=9)
        axes.set_axis_off()
    return drawn(figure)


def exponents(scene: FrozenScene) -> Bytes:
    """One LED under three exponents, and what it sends into each direction."""
    figure, angles = Figure(figsize=(8.4, 2.3), dpi=100, layout="constrained"), torch.linspace(-90.0, 90.0, 181)
    *pictures, profile = figure.subplots(1, 4)
    for axes, exponent in zip(pictures, (1.0, 8.0, 64.0), strict=True):
        lamp = rg.LedLight([0.0, -0.1, 0.35], [1.0, 1.0, 1.0], [0.0, 0.4, -1.0], exponent)
        image = scene.render(camera(*FRONT, side=2 * SIDE), lamp)
        axes.imshow(tone_map(image, display_gain(image)))
        axes.set_title(f"exponent {exponent:.0f}", fontsize=9)
        axes.set_axis_off()
        value, _ = lamp.profile_at(torch.deg2rad(angles), {"exponent": torch.tensor(exponent)})
        profile.plot(angles, value, label=f"{exponent:.0f}")
    profile.set_xlabel("angle to the axis (°)", fontsize=8)
    profile.set_title("part of its intensity", fontsize=9)
    profile.set_xticks([-90, -45, 0, 45, 90])
    profile.tick_params(labelsize=8)
    profile.legend(fontsize=7, frameon=False)
    return drawn(figure)


def viewer_shows(scene: FrozenScene) -> Bytes:
    """What a picture of the viewer may show: photograph, irradiance and illuminance in colours, and a section."""
    session, view = Session(LampImages(scene)), camera((0.5, -1.35, 0.45), (0.0, 0.05, -0.05), side=2 * SIDE)
    session.lights = (rg.PointLight([-0.3, 0.28, -0.1], [0.6, 0.8, 0.8]),)
    figure = Figure(figsize=(8.4, 2.6), dpi=100, layout="constrained")
    axes = figure.subplots(1, 3)
    for place, shown in zip(axes, (*SHOWN[::2], "a section across x"), strict=True):
        session.shown = shown if shown in SHOWN else SHOWN[0]
        session.section = None if shown in SHOWN else (0, 0.2)
        picture, top = session.picture(session.seen(view))
        place.imshow(picture)
        place.set_title(shown if shown != SHOWN[2] else f"{shown}: yellow is {round(top, -2):.0f}", fontsize=9)
        place.set_axis_off()
    return drawn(figure)


def stages(_: FrozenScene) -> Bytes:
    """The stages that the guide's added one is made after, and which of them makes what another reads."""
    names: dict[str, object] = {}
    exec(ADDED.search((ROOT / "docs" / "guides" / "add_stage.md").read_text())[1], names)
    added, config, found = names["STAGE"], compose_config(["stage=fit_light", "scene=cornell"]), {}

    def visit(stage: Stage) -> None:
        needed = [load_stage(name) for name in dict.fromkeys(need.stage for need in stage.needs(config))]
        for one in needed:
            visit(one)
        found.setdefault(stage.name, (stage, [one.name for one in needed]))

    visit(added)
    figure, order = Figure(figsize=(8.4, 2.1), dpi=100), list(found)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(-0.5, len(found) - 0.5), ylim=(-1.3, 1.0))
    axes.set_axis_off()
    for place, (stage, needed) in enumerate(found.values()):
        colour, side = ("#e8a33d", 1.0) if stage is added else ("#7f8b99", -1.0)
        axes.add_patch(Rectangle((place - 0.44, -0.5), 0.88, 1.0, facecolor=colour, alpha=0.3))
        axes.text(place, 0.33, stage.name, ha="center", va="center", fontsize=8.5, weight="bold")
        axes.text(place, -0.14, textwrap.fill(stage.help, 19), ha="center", va="center", fontsize=7.5)
        for start in map(order.index, needed):
            # From box to box, or around those that stand between.
            near = place == start + 1
            ends = ((start + 0.44, 0.0), (place - 0.44, 0.0)) if near else ((start, side / 2), (place, side / 2))
            arrow = {"arrowstyle": "-|>", "color": colour, "connectionstyle": f"arc3,rad={0.0 if near else -side / 4}"}
            axes.annotate("", ends[1], ends[0], arrowprops=arrow)
    return drawn(figure)


def settings(_: FrozenScene) -> Bytes:
    """A row of the site's page of settings, and those around it, as a browser shows them."""
    from playwright.sync_api import sync_playwright

    from viewer_picture import ARGUMENTS

    with TemporaryDirectory() as folder, sync_playwright() as playwright:
        build = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", folder]
        subprocess.run(build, check=True, cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"})
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        page = browser.new_page(viewport={"width": WIDE, "height": 700})
        page.goto(f"file://{folder}/reference/settings.html")
        row = page.locator("tr", has_text=SETTING)
        row.evaluate("row => row.scrollIntoView({block: 'center'})")
        last = row.locator("xpath=following-sibling::tr[2]").bounding_box()
        place = row.bounding_box() | {"y": row.locator("xpath=preceding-sibling::tr[2]").bounding_box()["y"]}
        place["height"] = last["y"] + last["height"] - place["y"]
        picture = page.screenshot(clip=place)
        browser.close()
    return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"))


PICTURES: dict[str, Callable[[FrozenScene], Bytes]] = {
    "captures": captures,
    "other_light": other_light,
    "target_classes": target_classes,
    "gradients": gradients,
    "kinds": kinds,
    "exponents": exponents,
    "regions": regions,
    "exported": exported,
    "gpu": gpu,
    "photographs": photographs,
    "ply": ply,
    "scan": scan,
    "settings": settings,
    "stages": stages,
    "sweep": sweep,
    "cluster": cluster,
    "viewer_shows": viewer_shows,
}

#: Of lines and letters, which are kept as they are.
DRAWN = ("cluster", "gpu", "photographs", "regions", "settings", "stages", "sweep")


if __name__ == "__main__":
    room = demo_scene()
    for name in sys.argv[1:] or PICTURES:
        path = IMAGES / f"{name}{'.png' if name in DRAWN else '.jpg'}"
        Image.fromarray(PICTURES[name](room)).save(path, optimize=True, quality=90)
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")
