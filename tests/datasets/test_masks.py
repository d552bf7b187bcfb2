"""Images of which pixels count, beside a view's image."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from rgspipe.datasets.exr import write_channels
from rgspipe.datasets.frames import read_entries
from rgspipe.datasets.gs3 import load_target
from rgspipe.errors import InputError

Change = Callable[[str, Callable[[dict], object]], None]
TARGET = "targets/one/transforms.json"

#: The left half of 6 × 4 pixels counts.
MASK = np.repeat([[255, 255, 255, 0, 0, 0]], 4, axis=0).astype(np.uint8)


def _name(change: Change, name: str) -> None:
    change(TARGET, lambda content: content["frames"][0].update(mask_path=name))


@pytest.mark.parametrize("kind", ["grey.png", "colour.png", "grey.exr"])
def test_a_mask_makes_alpha_and_the_premultiplied_image(dataset: Path, change: Change, kind: str) -> None:
    path = dataset / "targets/one" / kind
    if kind == "grey.exr":
        write_channels(path, {"Y": MASK.astype(np.float32) / 255.0})
    else:
        Image.fromarray(MASK if kind == "grey.png" else np.repeat(MASK[..., None], 3, axis=2)).save(path)
    _name(change, kind)
    (view,) = load_target(dataset / "targets/one").views
    assert view.alpha[:, :3].eq(1).all() and view.alpha[:, 3:].eq(0).all()
    assert view.image[:, :3].eq(0.25).all() and view.image[:, 3:].eq(0).all()


def test_broken_masks_are_named(dataset: Path, change: Change) -> None:
    _name(change, "mask.png")
    with pytest.raises(InputError, match=r"mask\.png.*no such file"):
        load_target(dataset / "targets/one")
    Image.fromarray(MASK[:2]).save(dataset / "targets/one/mask.png")
    with pytest.raises(InputError, match=r"mask\.png.*6 × 4"):
        load_target(dataset / "targets/one")
    _name(change, "mask.exr")
    write_channels(dataset / "targets/one/mask.exr", {"Y": 2.0 * MASK.astype(np.float32)})
    with pytest.raises(InputError, match=r"mask\.exr.*0 to 1"):
        load_target(dataset / "targets/one")
    write_channels(dataset / "targets/one/mask.exr", {"Y": 0.0 * MASK.astype(np.float32)})
    with pytest.raises(InputError, match=r"mask\.exr.*found black everywhere\. Invert it"):
        load_target(dataset / "targets/one")


def test_where_lamps_are_is_read_and_leaves_the_image_alone(dataset: Path, change: Change) -> None:
    (before,) = load_target(dataset / "targets/one").views
    assert before.emitters is None
    Image.fromarray(MASK).save(dataset / "targets/one/emitters.png")
    change(TARGET, lambda content: content["frames"][0].update(emitter_path="emitters.png"))
    (view,) = load_target(dataset / "targets/one").views
    assert view.emitters[:, :3].all() and not view.emitters[:, 3:].any()
    assert torch.equal(view.image, before.image) and torch.equal(view.alpha, before.alpha)
    assert dataset / "targets/one/emitters.png" in read_entries(dataset / TARGET, "a target")[0].files
