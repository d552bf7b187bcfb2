"""`rgspipe view FOLDER`: what it is told, and that it serves a page until it is interrupted."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import pytest
import torch

from rgspipe.cli.commands import COMMANDS
from rgspipe.cli.view import DEMO, KEYS, PAGE_KEYS, Asked, parsed, serve, view_folder
from rgspipe.datasets.light_file import write_lights
from rgspipe.datasets.location import point_at_dataset
from rgspipe.demo import TARGET
from rgspipe.errors import InputError
from rgspipe.light_export.world import World
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import PointLight
from rgspipe.stages.scene.export import NO_WATTS
from rgspipe.viewer.serve import view
from rooms import closed_box


def test_what_the_demo_says_fits_a_terminal() -> None:
    assert max(map(len, DEMO.splitlines())) <= 80


def test_a_folder_and_keys_are_understood() -> None:
    words = ["a/b", "lights=l.json", "target=t", "fit=f", "port=0", "resolution=64", "address=::1"]
    words += ["browser=false", "device=cpu"]
    assert parsed(words) == Asked(Path("a/b"), "l.json", "t", "f", 0, 64, "::1", False, "cpu")
    assert parsed(["a"]) == Asked(Path("a"))


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ([], "view outputs/cornell/freeze/latest"),
        (["a", "b"], "a b"),
        (["a", "prt=3"], "Did you mean port="),
        (["a", "port=x"], "port: expected a whole number"),
        (["a", "port=70000"], "70000"),
        (["a", "device=gpu"], "device: expected auto or cpu or cuda, found 'gpu'"),
        (["a", "browser=firefox"], "browser: expected true or false, found 'firefox'"),
        (["a", "resolution=16"], "resolution: expected a whole number from 32 to 2048, found '16'"),
    ],
)
def test_what_cannot_be_meant_is_refused(words: list[str], found: str) -> None:
    with pytest.raises(InputError) as caught:
        parsed(words)
    assert found in str(caught.value)


@pytest.mark.parametrize("keys", [KEYS, PAGE_KEYS])
def test_help_names_every_key(keys: Mapping[str, str]) -> None:
    command = COMMANDS["view" if keys is KEYS else "demo"]
    for key in keys:
        assert f"[{key}=" in command.usage and f"\n  {key} " in command.usage
        assert any(word.startswith(f"{key}=") for word in command.words)


@pytest.mark.parametrize("browser", [True, False])
def test_the_page_is_opened_unless_that_is_not_wanted(browser: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("rgspipe.cli.view.open_page", opened.append)
    assert serve(Served(), 1, browser) == 0
    assert opened == [Served.url] * browser


def test_a_page_is_served_until_it_is_interrupted(tmp_path: Path) -> None:
    FrozenScene.freeze(closed_box(0.5).to(torch.float32)).save(tmp_path / "box")
    command = [sys.executable, "-m", "rgspipe", "view", str(tmp_path / "box"), "port=0"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "OMP_NUM_THREADS": "1"}
    # What runs in the background of a shell ignores interrupts, and so would its children.
    heeds = partial(signal.signal, signal.SIGINT, signal.default_int_handler)
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True, preexec_fn=heeds) as process:
        url = next((line for line in process.stdout if "Ctrl-C" in line), "").partition(" ")[0]
        assert url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(url, timeout=30) as page:
            assert page.status == 200 and b"<html" in page.read().lower()
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=30) == 0


def test_lamps_are_exported_to_where_they_are_in_the_scene_s_own_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for stage, inputs in (("generate_dataset", {}), ("freeze", {"generate_dataset": ["aa"]})):
        folder = tmp_path / "room" / stage / "aa"
        folder.mkdir(parents=True)
        told = {"schema": 1, "stage": stage, "fingerprint": "aa", "inputs": inputs, "files": {}, "facts": {}}
        (folder / "manifest.json").write_text(json.dumps(told))
    info = tmp_path / "room" / "generate_dataset" / "aa" / "dataset_info.json"
    info.write_text(json.dumps({"version": 1, "rescale": 0.25, "offset": [1.0, 2.0, -3.0]}))
    given = {}
    scene = FrozenScene.freeze(closed_box(0.5).to(torch.float32))
    monkeypatch.setattr(FrozenScene, "load", lambda folder: scene)
    monkeypatch.setattr("rgspipe.viewer.serve.view", lambda *_, **words: given.update(words) or Served())
    assert view_folder([str(folder), "browser=false"]) == 0
    assert given["world"] == World(1.0, 0.25, (1.0, 2.0, -3.0)) and given["notes"] == []
    (tmp_path / "room" / "generate_dataset").rename(tmp_path / "room" / "capture_surfels")
    told = {"schema": 1, "stage": "capture_surfels", "fingerprint": "aa", "inputs": {}, "files": {}, "facts": {}}
    (tmp_path / "room" / "capture_surfels" / "aa" / "manifest.json").write_text(json.dumps(told))
    told |= {"stage": "freeze", "inputs": {"capture_surfels": ["aa"]}}
    (folder / "manifest.json").write_text(json.dumps(told))
    assert view_folder([str(folder), "browser=false"]) == 0
    assert given["notes"] == [NO_WATTS]


def frozen_from(dataset: Path, outputs: Path) -> Path:
    """The folder of a frozen scene that was made from a dataset."""
    for stage, inputs in (("generate_dataset", {}), ("freeze", {"generate_dataset": ["aa"]})):
        folder = outputs / "room" / stage / "aa"
        folder.mkdir(parents=True)
        told = {"schema": 1, "stage": stage, "fingerprint": "aa", "inputs": inputs, "files": {}, "facts": {}}
        (folder / "manifest.json").write_text(json.dumps(told))
    point_at_dataset(folder.parents[1] / "generate_dataset" / "aa", dataset)
    return folder


def test_cameras_of_the_dataset_are_offered_held_out_ones_first(
    dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, given = frozen_from(dataset, tmp_path / "outputs"), {}
    monkeypatch.setattr(FrozenScene, "load", lambda folder: FrozenScene.freeze(closed_box(0.5).to(torch.float32)))
    monkeypatch.setattr("rgspipe.viewer.serve.view", lambda *_, **words: given.update(words) or Served())
    assert view_folder([str(folder), "browser=false"]) == 0
    assert [one.name for one in given["references"]] == ["test/r_0000", "train/r_0000"]
    assert "cameras" not in capsys.readouterr().out
    monkeypatch.setattr("rgspipe.cli.view_references.MOST_OFFERED", 1)
    assert view_folder([str(folder), "browser=false"]) == 0
    assert [one.name for one in given["references"]] == ["test/r_0000"]
    assert "1 of the dataset's 2 cameras are offered, held-out ones first; 1 are left out." in capsys.readouterr().out
    shutil.rmtree(dataset)  # the scene is shown all the same
    assert view_folder([str(folder), "browser=false"]) == 0
    assert given["references"] == [] and "cameras are not offered" in capsys.readouterr().out


def test_lamps_of_another_scene_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for scene in ("hall", "room"):
        folder = tmp_path / scene / "freeze" / "aa"
        folder.mkdir(parents=True)
        told = {"schema": 1, "stage": "freeze", "fingerprint": "aa", "inputs": {}, "files": {}, "facts": {}}
        (folder / "manifest.json").write_text(json.dumps(told))
        write_lights(folder / "lights.json", PointLight([0.0, 0.0, 0.1], 1.0))
    monkeypatch.setattr(FrozenScene, "load", lambda folder: FrozenScene.freeze(closed_box(0.5).to(torch.float32)))
    monkeypatch.setattr("rgspipe.viewer.serve.view", lambda *_, **words: Served())
    for scene, said in (("hall", 1), ("room", 0)):
        lights = tmp_path / scene / "freeze" / "aa" / "lights.json"
        assert view_folder([str(folder), f"lights={lights}", "browser=false"]) == 0
        assert capsys.readouterr().out.count("its lights are those of the scene hall") == said
    target = target_in(tmp_path / "hall" / "freeze" / "aa")
    assert view_folder([str(folder), f"target={target}", "browser=false"]) == 0
    assert "targets/evening: its cameras are those of the scene hall" in capsys.readouterr().out
    # A track has no lights.json.
    (tmp_path / "hall/freeze/aa/frames").mkdir()
    lights.rename(lights.with_name("kept"))
    write_lights(tmp_path / "hall/freeze/aa/frames/1.json", PointLight([0.0, 0.0, 0.1], 1.0), {"status": "tracked"})
    assert view_folder([str(folder), f"fit={tmp_path / 'hall/freeze/aa'}", "browser=false"]) == 0
    assert "aa/frames: its lights are those of the scene hall" in capsys.readouterr().out


def target_in(result: Path) -> Path:
    """The photographs that come with the package, as a target in the folder of a result."""
    return Path(shutil.copytree(TARGET, result / "targets" / "evening"))


class Served:
    """A page that nobody waits for."""

    url = "http://127.0.0.1:1"

    def wait(self) -> None:
        pass


@pytest.mark.parametrize(("port", "told"), [(1, ""), (0, ""), (8080, "Port 8080 is taken")])
def test_another_port_than_was_asked_for_is_told(port: int, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert serve(Served(), port, browser=False) == 0
    *said, last = capsys.readouterr().out.splitlines()
    assert last.startswith(Served.url) and " ".join(said).startswith(told) and bool(said) is bool(told)


def test_an_interrupt_before_the_wait_begins_ends_it_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    viewer = view(FrozenScene.freeze(closed_box(0.5).to(torch.float32)), port=0)
    stopped = []

    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(viewer, "wait", interrupted)
    monkeypatch.setattr(viewer, "stop", lambda stop=viewer.stop: stopped.append(stop()))
    assert serve(viewer, 0, browser=False) == 0 and stopped == [None]
