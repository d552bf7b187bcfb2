"""Files with bytes changed, cut off or put in are read, finite, or refused by name: nothing else, and at once."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from ply_files import gaussian_columns, write_ply
from rgspipe.datasets.exr import write_image
from rgspipe.datasets.images import read_colour
from rgspipe.datasets.light_file import read_lights, write_lights
from rgspipe.datasets.ply import read_ply
from rgspipe.datasets.ply_options import PlyOptions
from rgspipe.datasets.surfel_file import load_surfels, save_surfels
from rgspipe.errors import InputError
from rgspipe.scene import PointLight, SpotLight

#: Mutants of each kind of file; seeded, so that every run sees the same.
MUTANTS = 60

#: Seconds for one of them; measured: 0.02.
LONGEST = 5.0


def _png(path: Path) -> None:
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (8, 8, 4), dtype=np.uint8)).save(path)


def _lights(path: Path) -> None:
    write_lights(path, (PointLight([0, 0, 1], 1.0), SpotLight([0, 1, 0], 2.0, [0, 0, -1], "linear", 0.5, 0.2)))


def _surfels(path: Path) -> None:
    save_surfels(path, read_ply(write_ply(path.with_suffix(".ply"), gaussian_columns()), PlyOptions()).surfels)


KINDS: dict[str, tuple[Callable[[Path], object], Callable[[Path], list[torch.Tensor]]]] = {
    "a.exr": (lambda path: write_image(path, np.ones((8, 8, 3)), np.ones((8, 8))), lambda path: [*read_colour(path)]),
    "a.png": (_png, lambda path: [*read_colour(path)]),
    "a.json": (_lights, lambda path: [x for light in read_lights(path) for x in (light.position, light.intensity)]),
    "a.ply": (
        lambda path: write_ply(path, gaussian_columns()),
        lambda path: [*read_ply(path, PlyOptions()).surfels.tensors().values()],
    ),
    "a.safetensors": (_surfels, lambda path: [*load_surfels(path).tensors().values()]),
}


def _mutated(content: bytes, random_: random.Random) -> bytes:
    place = random_.randrange(len(content))
    if random_.random() < 0.15:
        return content[:place]
    # Headers are short, and most of what can go wrong is in them.
    place = place if random_.random() < 0.4 else random_.randrange(min(len(content), 400))
    other = random_.choice([bytes([random_.randrange(256)]), b"\xff" * 4, b"\0" * 4, b"9" * 9, b"[" * 5000])
    return content[:place] + other + content[place + random_.choice([0, len(other)]) :]


@pytest.mark.parametrize("name", KINDS)
def test_a_mutant_is_read_or_refused(tmp_path: Path, name: str) -> None:
    make, read = KINDS[name]
    make(tmp_path / name)
    content, random_ = (tmp_path / name).read_bytes(), random.Random(f"mutants of {name}")
    refused = 0
    for _ in range(MUTANTS):
        (tmp_path / name).write_bytes(_mutated(content, random_))
        begin = time.perf_counter()
        try:
            tensors = read(tmp_path / name)
        except InputError as error:
            assert name in str(error)
            refused += 1
        else:
            assert all(bool(tensor.isfinite().all()) for tensor in tensors)
        assert time.perf_counter() - begin < LONGEST
    assert refused > 0
