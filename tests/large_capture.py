"""How long a large capture takes from its files to the frozen scene, and how much memory: `make large-capture`.

Usage: large_capture.py [PHOTOGRAPHS WIDTH SURFELS [FOLDER]]

The photographs are of a closed room with furniture under two lamps: 8 bits of unknown exposure, of which the brightest
hundredth is clipped, with depth in millimetres that has 1 % of noise in each pixel, in nerfstudio's layout. They are
rendered by our own renderer, with shadows where pixels look, of exact surfels: path tracing so many takes days. Each
stage then runs in a process of its own, as from the command line, with its wall time, processor time and memory.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch

from rgspipe.benchmark.rooms import ROOMS
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.degradation.model_error import with_error
from rgspipe.degradation.options import ModelError
from rgspipe.evaluation.rig_errors import match_positions
from rgspipe.machine.description import machine
from rgspipe.progress import progress_bar
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.renderer.kernels.mesh_rays import MeshRays
from rgspipe.renderer.mesh_passes import MeshPasses
from rgspipe.scene import Camera, PointLight, look_at
from rgspipe.scene.mesh import Paint, TriangleMesh
from rgspipe.scene.rectangles import Rectangles, surfels_on
from scan_layouts import write_depth, write_photograph

#: Metres of the room's longest side, and surfels that it is rendered of.
SIDE, TRUE_SURFELS = 5.0, 20_000

#: Standard deviations of depth over depth, of exposures in stops, and of the paint's logarithm over half a metre or so.
DEPTH_NOISE, STOPS, MOTTLED = 0.01, 0.5, 0.2

#: Of all values this part is not clipped at mean exposure.
WHITE = 0.99

#: Places of the lamps in the room of unit size, and their colours.
LAMPS = ((-0.05, -0.1, 0.28), (0.3, -0.05, 0.1)), ((1.0, 0.9, 0.7), (0.5, 0.6, 0.8))

#: Distance of cameras from all surfaces, metres, and their field of view, radians.
CLEAR, FIELD_OF_VIEW = 0.4, 1.2

STAGES = ("import_scan", "init_depth", "capture_surfels", "freeze")


def mesh_of(rectangles: Rectangles) -> TriangleMesh:
    corners = rectangles.corners.numpy()
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate([first + np.array(part) for part in ([0, 1, 2], [0, 2, 3])])
    paint = Paint(np.full((len(faces), 3, 3), np.nan), np.zeros((len(faces), 3, 2)), np.full(len(faces), -1))
    return TriangleMesh(corners.reshape(-1, 3), faces, paint)


def cameras(mesh: TriangleMesh, count: int, width: int, rng: np.random.Generator) -> Iterator[Camera]:
    """In the air of the room, looking all over it."""
    rays, every = MeshRays(mesh), torch.from_numpy(rng.standard_normal((256, 3)))
    every = every / every.norm(dim=1, keepdim=True)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    while count:
        eye = torch.from_numpy(rng.uniform(low + CLEAR, high - CLEAR))
        hits = rays.hits(eye.expand(256, 3), every)
        facing = (torch.from_numpy(mesh.normals)[hits.face] * every).sum(dim=1) < 0.0
        if bool(facing.all()) and float(hits.distance.min()) > CLEAR:
            aim = torch.from_numpy(rng.uniform(0.8 * low, 0.8 * high))
            yield Camera.from_field_of_view(look_at(eye.float(), aim.float()), FIELD_OF_VIEW, width, width * 3 // 4)
            count -= 1


def photograph(folder: Path, count: int, width: int) -> None:
    """Write the capture, and the lamps as they are in the photographs' unit."""
    rng, unit = np.random.default_rng(0), ROOMS["clutter"]().surfaces
    sides = (SIDE * part for part in (unit.origins, unit.sides_a, unit.sides_b))
    rectangles = Rectangles(*sides, unit.albedo)
    mesh = mesh_of(rectangles)
    passes = MeshPasses(mesh)
    surfels = with_error(surfels_on(rectangles, TRUE_SURFELS).to(torch.float32), ModelError(albedo=MOTTLED))
    frozen = FrozenScene.freeze(surfels)
    pairs = zip(*LAMPS, strict=True)
    lamps = [PointLight([SIDE * x for x in place], [SIDE**2 * c for c in colour]) for place, colour in pairs]
    taken = list(cameras(mesh, count, width, rng))
    with torch.no_grad():
        every = [frozen.render(camera.reduced(64), lamps).reshape(-1) for camera in taken[::10]]
        white = float(np.quantile(torch.cat(every).numpy(), WHITE))
        frames = []
        for index, camera in enumerate(progress_bar(taken, "photographs", unit="photograph")):
            image, depth = frozen.render(camera, lamps).numpy() / white, passes.seen_by(camera).depth
            noise = 1.0 + DEPTH_NOISE * rng.standard_normal(depth.shape)
            write_photograph(folder / f"images/{index}.png", 2.0 ** (STOPS * rng.standard_normal()) * image)
            write_depth(folder / f"depth/{index}.png", depth * noise, 1000.0)
            files = {"file_path": f"images/{index}.png", "depth_file_path": f"depth/{index}.png"}
            frames.append(files | {"transform_matrix": camera.camera_to_world.tolist()})
    lens = {"fl_x": camera.fx, "fl_y": camera.fy, "cx": camera.cx, "cy": camera.cy, "w": width, "h": width * 3 // 4}
    (folder / "transforms.json").write_text(json.dumps(lens | {"camera_model": "OPENCV", "frames": frames}))
    write_lights(folder / "lamps.json", [PointLight(one.position, one.intensity / white) for one in lamps])


def measured(stage: str, folder: Path, width: int, surfels: int) -> None:
    """Run one stage, whose inputs are there, and say what it took."""
    arguments = [f"stage={stage}", "scene=rgbd", f"scene.path={folder}", "scene.name=large", f"init.surfels={surfels}"]
    arguments += ["scene.rgbd.frames=100000", f"scene.rgbd.resolution={width}", "lamps.exposure=free"]
    begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-m", "rgspipe", *arguments], cwd=folder, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    wall, memory = time.perf_counter() - begin, after.ru_maxrss / 2**20
    print(f"{stage}: {wall:.0f} s, {spent:.0f} s of a core, at most {memory:.2f} GiB up to here", flush=True)


def answer(folder: Path) -> None:
    """Say how far the lamps are off."""
    found = read_lights(folder / "outputs/large/capture_surfels/latest/lamps.json")
    truth = read_lights(folder / "lamps.json")
    for own, true in match_positions(*(np.stack([one.position.numpy() for one in rig]) for rig in (found, truth))):
        off = float((found[own].position - truth[true].position).norm()) / SIDE
        ratio = found[own].intensity / truth[true].intensity
        print(f"a lamp {100 * off:.2f} % of the room off, intensities {ratio.numpy().round(2)} times the true ones")
    print(f"{len(found)} lamps found of {len(truth)}")


if __name__ == "__main__":
    given = sys.argv[1:]
    photographs, wide, wanted = (int(part) for part in given[:3] or ("200", "640", "50000"))
    where = Path(given[3] if len(given) > 3 else f"outputs/large_capture/{photographs}_{wide}").resolve()
    print({**machine(), "load": os.getloadavg()}, flush=True)
    if not (where / "lamps.json").exists():
        photograph(where, photographs, wide)
    for name in STAGES:
        measured(name, where, wide, wanted)
    answer(where)
