"""What a training and a fit come to with other numbers of threads, and with other instructions: `make bits`.

For 1, 2 and 4 threads every bit must be the same, and so what a plain run makes and what a sweep of two jobs at once
does; with MKL_CBWR, where it is STRICT. Other instructions round otherwise, which training makes larger; what is said
of the light must be the same, and its place to a ten thousandth of the room.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from whole_way import TINY, end_state

#: Trains a toy room on images of 96 x 96, freezes it and finds a light; prints what is said, where the light is, and
#: every bit of what comes out.
PROGRAM = """
from dataclasses import replace
import torch
import rgspipe as rg
from painted_room import LIGHT, painted_box, painted_views

views = painted_views()
start = replace(painted_box(), albedo=torch.full((864, 3), 0.5))
pixels = {"views_per_step": 4, "interior_pixels": 2000, "subsamples": 4}
options = replace(LIGHT, rounds=1, steps=2, relight_every=2, tilt_rate=0.01, height_rate=0.01, **pixels)
trained = rg.train(views, start, options).surfels
scene = rg.FrozenScene.freeze(trained, patches=100)
camera = rg.Camera.look_at([0.0, -1.8, 0.1], [0.0, 0.0, 0.0], fov_degrees=40, width=128, height=128)
view = scene.view(camera)
image = scene.render(view, [rg.PointLight([0.2, -0.1, 0.2], [1.0, 2.0, 0.5])])
found = rg.fit_lights(scene, view, image)
print(found.status.value, *found.lights[0].position.tolist())
for values in (*trained.tensors().values(), image, found.lights[0].position, found.covariance[0]):
    print(values.detach().numpy().tobytes().hex()[-4000:])
print(found.loss.hex())
"""

#: Environments with other numbers of threads, and with other instructions.
THREADS = tuple({"OMP_NUM_THREADS": count} for count in ("1", "2", "4"))
INSTRUCTIONS = (
    *({"ATEN_CPU_CAPABILITY": name} for name in ("default", "avx2", "avx512")),
    *({"MKL_CBWR": name} for name in ("COMPATIBLE", "AVX2")),
)
#: What MKL_CBWR may be for bits to be those of any number of threads (`machine/threads.py`); others are in the recipe.
STRICT = ("AUTO,STRICT", "AVX2,STRICT", "AVX512,STRICT")

PATH = os.pathsep.join(str(Path(__file__).parents[1] / name) for name in ("src", "tests"))

#: How far apart lights may be, as a share of the room, whose side is 1.
APART = 1e-4


def outcome(changes: Mapping[str, str]) -> list[str]:
    """The lines of the program in a changed environment.

    Whoever set MKL_CBWR has asked MKL for bits that it promises for one number of threads alone, but for its STRICT.
    """
    environment = {name: value for name, value in os.environ.items() if name != "MKL_CBWR"}
    environment |= {"PYTHONPATH": PATH, **changes}
    run = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout.splitlines()


def swept_otherwise() -> list[str]:
    """What a sweep of two jobs at once makes otherwise than a plain run, which has all threads to itself."""
    words = [f"{key}={value}" for key, value in {**TINY, "stage": "fit_light", "occlusion": "visible"}.items()]
    ways = {"plain": ["seed=0"], "sweep": ["-m", "seed=0,1", "hydra.launcher.n_jobs=2"]}
    environment = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    environment["PYTHONPATH"] = PATH
    found = {}
    with tempfile.TemporaryDirectory() as place:
        for name, given in ways.items():
            folder = Path(place, name)
            command = [sys.executable, "-m", "rgspipe", *words, *given, f"outputs={folder}"]
            subprocess.run(
                command, cwd=place, env=environment | {"PYTHONPATH": PATH}, stdout=subprocess.DEVNULL, check=True
            )
            found[name] = {path: what for path, what in end_state(folder).items() if not what.startswith("leads to")}
    return sorted(name for name, what in found["plain"].items() if found["sweep"].get(name) != what)


def main() -> int:
    """Compare with one thread; the exit status."""
    other = swept_otherwise()
    print(f"a sweep and a plain run: {'every bit is the same' if not other else ', '.join(other)}", flush=True)
    expected, wrong = outcome(THREADS[0]), int(bool(other))
    status, *place = expected[0].split()
    print(f"{THREADS[0]}: {status} at {', '.join(place)}", flush=True)
    for changes in (*THREADS[1:], *INSTRUCTIONS):
        found = outcome({**THREADS[0], **changes})
        other, *there = found[0].split()
        apart = max(abs(float(one) - float(two)) for one, two in zip(place, there, strict=True))
        right = found == expected if changes in THREADS else other == status and apart < APART
        bits = "every bit is the same" if found == expected else f"{apart:.1e} of the room apart"
        print(f"{changes}: {other}, {bits}{'' if right else '  WRONG'}", flush=True)
        wrong += not right
    for name in STRICT:
        one, four = (outcome({"MKL_CBWR": name, "OMP_NUM_THREADS": count}) for count in ("1", "4"))
        bits = "every bit is the same" if one == four else "bits differ  WRONG"
        print(f"MKL_CBWR={name}, one thread and four: {bits}", flush=True)
        wrong += one != four
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
