"""The Python of README.md, of the tutorial, of the guide to doubts and of the package's first lines runs as written."""

from __future__ import annotations

import re
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
import torch

import rgspipe as rg
from rgspipe.datasets.exr import write_channels, write_image
from rgspipe.datasets.gs3_write import frame_entry, write_info, write_transforms

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)

#: Frozen scenes that pages load.
SCENES = ("tutorial", "cornell")

#: Pixels of the photographs that the tutorial trains on: enough depth for the surfels that it asks for.
SIDE = 48

#: What is smaller here than in the tutorial and the guide, where nobody waits for it: images that are rendered, and
#: scenes that are made of photographs. The guide's capture takes 7 CPU seconds, and with 600 surfels 26; the tutorial
#: takes 22, and with the steps, rays and patches that it has by default 42.
SMALL_TUTORIAL = {
    "width=128, height=128": "width=40, height=40",
    "surfels=2000": "surfels=600",
    "steps=20": "steps=4, gather_rays=64, patches=100",
    "trained.surfels)": "trained.surfels, gather_rays=64, patches=100)",
}
SMALL_CAPTURE = {"5000": "300"}


@pytest.fixture(scope="module")
def scene() -> rg.FrozenScene:
    return rg.FrozenScene.freeze(rg.exact_surfels(rg.CornellBox(), 800), gather_rays=64, patches=60)


@pytest.fixture
def folder(scene: rg.FrozenScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder where code runs, with the frozen scenes that pages name."""
    for name in SCENES:
        scene.save(tmp_path / "outputs" / name / "freeze" / "latest")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(code: list[str], page: str, **names: object) -> dict[str, object]:
    """Pieces of code, one after the other as in a session that has `names`; the names that they leave."""
    for number, piece in enumerate(code, start=1):
        exec(compile(piece, f"{page}, block {number}", "exec"), names)
    return names


def blocks(page: str) -> list[str]:
    return BLOCK.findall((ROOT / page).read_text())


def smaller(page: str, changes: dict[str, str]) -> list[str]:
    """The blocks of a page, with numbers that are written there replaced."""
    code = blocks(page)
    for written, small in changes.items():
        assert any(written in block for block in code), f"{page} says {written} no longer"
        code = [block.replace(written, small) for block in code]
    return code


def photographs(scene: rg.FrozenScene, root: Path, known: bool = True) -> None:
    """A small dataset with depth, in which a lamp stands elsewhere in each image; or one and the same, not known."""
    entries = []
    for index, x in enumerate((-0.3, -0.1, 0.1, 0.3)):
        camera = rg.Camera.look_at([x, -1.5, 0.05], [0, 0, 0], width=SIDE, height=SIDE)
        view, light = scene.view(camera), rg.PointLight([-x if known else 0.1, -0.3, 0.2], 1.0)
        coverage = view.coverage.reshape(SIDE, SIDE)
        _, depth = camera.project(scene.surfels.centers)
        depth = view.image(depth.float()[:, None].expand(-1, 3).contiguous())[:, :, 0] / coverage.clamp(min=0.1)
        depth[coverage < 0.9] = 1e10
        name = f"train/r_{index:04}"
        write_image(root / f"{name}.exr", scene.render(view, light).numpy(), np.ones((SIDE, SIDE)))
        write_channels(root / f"{name}_depth.exr", {"Z": depth.numpy()})
        entries.append(frame_entry(name, camera, light if known else None, ("depth",)))
    write_transforms(root / "transforms_train.json", entries)
    write_info(root, "room", [[-0.5] * 3, [0.5] * 3], 1.0, [0.0] * 3)


def test_the_first_lines_of_the_package_run(folder: Path, capsys) -> None:
    _, _, code = rg.__doc__.partition("\n")
    run([code], "rgspipe.__doc__")
    assert capsys.readouterr().out.startswith("1 light, converged")


def test_readme_runs(folder: Path, capsys) -> None:
    code = blocks("README.md")
    assert len(code) == 1
    run(code, "README.md")
    assert capsys.readouterr().out.startswith("1 light, ")
    assert len(rg.read_lights(folder / "lights.json")) == 1


def test_thresholds_are_changed_as_the_guide_says(scene: rg.FrozenScene) -> None:
    page = "docs/guides/doubtful_answers.md"
    camera = rg.Camera.look_at([0, -1.5, 0.05], [0, 0, 0], width=32, height=32)
    image = scene.render(camera, rg.PointLight([-0.3, 0.28, -0.1], 0.8))
    names = run(blocks(page), page, rg=rg, scene=scene, camera=camera, image=image)
    assert names["search"].certainty.doubtful == 0.1
    assert len(names["result"].lights) == 1
    settings = re.findall(r"fit\.search\.(\S+)=0\.1", (ROOT / page).read_text())
    assert [attrgetter(name)(names["search"]) for name in settings] == [0.1]


@pytest.mark.slow
def test_the_tutorial_runs(folder: Path, scene: rg.FrozenScene, capsys) -> None:
    photographs(scene, folder / "my_room")
    page = "docs/tutorial/python.md"
    names = run(smaller(page, SMALL_TUTORIAL), page)
    assert names["image"].shape == (40, 40, 3)
    printed = capsys.readouterr().out
    assert printed.startswith("1 light, converged") and "may not be there" in printed and "light_spare" in printed
    assert len(names["scene"].surfels) == len(names["trained"].surfels) >= 600
    made = {path.name for path in folder.iterdir()}
    assert made == {"outputs", "my_room", "my_scene", "lights.json", "seen.png"}


@pytest.mark.slow
def test_a_capture_runs_as_the_guide_says(folder: Path, scene: rg.FrozenScene, capsys) -> None:
    photographs(scene, folder / "my_room", known=False)
    page = "docs/guides/photographs.md"
    names = run(smaller(page, SMALL_CAPTURE), page)
    assert capsys.readouterr().out.startswith("(PointLight(")
    assert torch.equal(names["scene"].surfels.albedo, names["found"].surfels.albedo)
