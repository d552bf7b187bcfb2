"""What a training and a fit come to with other numbers of threads, and with other instructions: `make bits`.

For 1, 2 and 4 threads every bit must be the same. Other instructions round otherwise, which training makes larger; what
is said of the light must be the same, and its place to a ten thousandth of the room.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

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

#: How far apart lights may be, as a share of the room, whose side is 1.
APART = 1e-4


def outcome(changes: Mapping[str, str]) -> list[str]:
    """The lines of the program in a changed environment."""
    path = os.pathsep.join(str(Path(__file__).parents[1] / name) for name in ("src", "tests"))
    environment = os.environ | {"PYTHONPATH": path, **changes}
    run = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout.splitlines()


def main() -> int:
    """Compare with one thread; the exit status."""
    expected, wrong = outcome(THREADS[0]), 0
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
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
