"""Sums, and what is decided by them, are the same for any number of threads."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from rgspipe.sums import CHUNK, average, total

#: Trains a toy room on images of 96 x 96, freezes it and finds a light; prints every bit of what comes out.
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
for values in (*trained.tensors().values(), image, found.lights[0].position, found.covariance[0]):
    print(values.detach().numpy().tobytes().hex()[-4000:])
print(found.loss.hex())
"""


@pytest.fixture
def threads() -> Iterator[None]:
    """torch's number of threads as it was, afterwards."""
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


def test_a_sum_is_the_same_for_any_number_of_threads(threads: None) -> None:
    """That torch's own sum is not shows that the sizes are large enough to tell."""
    values = torch.randn(10 * CHUNK + 123, generator=torch.Generator().manual_seed(0))
    found, theirs = set(), set()
    for count in (1, 2, 3, 4):
        torch.set_num_threads(count)
        found.add((float(total(values)), float(average(values.reshape(-1, 1)))))
        theirs.add(float(values.sum()))
    assert len(found) == 1 and len(theirs) > 1


@given(st.lists(st.floats(-1e6, 1e6), max_size=50), st.integers(1, 400))
def test_a_sum_is_that_of_the_numbers(numbers: list[float], repeats: int) -> None:
    values = torch.tensor(numbers * repeats, dtype=torch.float64)
    exact = math.fsum(values.tolist())
    # Measured: 2e-16 of the sum of magnitudes.
    assert abs(float(total(values)) - exact) <= 1e-14 * float(values.abs().sum()) + 1e-300


def test_a_mean_has_the_gradient_of_a_mean() -> None:
    values = torch.randn(2, CHUNK, 3, dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad(average(values), values)
    torch.testing.assert_close(gradient, torch.full_like(values, 1.0 / values.numel()), rtol=1e-14, atol=0.0)


def test_training_and_fits_are_the_same_for_any_number_of_threads() -> None:
    """Else a sweep of several jobs would make other artifacts than a plain run, under the same fingerprint."""
    path = os.pathsep.join(str(Path(__file__).parents[1] / name) for name in ("src", "tests"))
    found = []
    for count in ("1", "2", "4"):
        environment = os.environ | {"OMP_NUM_THREADS": count, "PYTHONPATH": path}
        run = subprocess.run(
            [sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False
        )
        assert run.returncode == 0, run.stderr
        found.append(run.stdout)
    assert len(found[0]) > 1000
    assert found[0] == found[1] == found[2]
