"""What `import rgspipe as rg` offers, and that it is offered quickly."""

from __future__ import annotations

import subprocess
import sys

import pytest

import rgspipe as rg
from rgspipe.datasets.views import View
from rgspipe.scene.lights import KINDS
from tiny_dataset import tiny_camera


@pytest.mark.parametrize("name", rg.__all__)
def test_every_public_name_is_there_and_explains_itself(name: str) -> None:
    found = getattr(rg, name)
    assert name in dir(rg)
    assert isinstance(found, str) or (found.__doc__ and found.__name__ == name)


def test_every_kind_of_light_is_public() -> None:
    assert {kind.__name__ for kind in KINDS.values()} <= {*rg.__all__}


def test_names_that_are_not_there_are_told_as_of_any_module() -> None:
    with pytest.raises(AttributeError, match="no attribute 'FrozenScenes'"):
        _ = rg.FrozenScenes


def test_nothing_is_loaded_before_it_is_used(child_environment: dict[str, str]) -> None:
    script = "import sys, rgspipe; print([name for name in ('torch', 'numpy', 'warp', 'hydra') if name in sys.modules])"
    run = subprocess.run([sys.executable, "-c", script], env=child_environment, capture_output=True, text=True)
    assert run.stdout == "[]\n", run.stderr


def test_views_of_datasets_and_targets_are_loaded(dataset) -> None:
    for folder, split, name in ((dataset, "train", "train/r_0000"), (dataset, "test", "test/r_0000")):
        (view,) = rg.load_views(folder, split)
        assert isinstance(view, View) and view.name == name and view.light is not None
    (view,) = rg.load_views(dataset / "targets" / "one")
    assert view.light is None and view.camera.width == tiny_camera().width
    with pytest.raises(rg.InputError, match="no such folder"):
        rg.load_views(dataset / "nowhere")


def test_what_holds_much_prints_little(dataset) -> None:
    surfels = rg.exact_surfels(rg.CornellBox(), 60)
    scene = rg.FrozenScene.freeze(surfels, gather_rays=8, patches=8)
    count = len(surfels)
    assert repr(surfels) == f"Surfels({count}, none of them glossy, torch.float32, cpu)"
    assert repr(scene) == f"FrozenScene({surfels!r}, 8 patches, size 1)"
    (view,) = rg.load_views(dataset)
    assert repr(view) == "View('train/r_0000', 6 × 4, light, depth, normal, albedo)"


def test_surfels_are_made_from_views_where_none_are_given() -> None:
    with pytest.raises(rg.InputError, match="depth"):
        rg.train([], 100)
