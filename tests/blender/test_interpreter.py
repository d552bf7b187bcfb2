"""Which Blender renders: this Python's, another one's, or an installed program; and what is none of them."""

from __future__ import annotations

import importlib.util
import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from rgspipe.blender.interpreter import ANSWER, find_blender
from rgspipe.blender.job import DatasetJob
from rgspipe.blender.options import OWN_BLENDER, BlenderOptions
from rgspipe.blender.render_dataset import render_dataset
from rgspipe.datasets.gs3 import load_dataset
from rgspipe.errors import InputError

needs_bpy = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed")

#: Rendered whole in three seconds.
JOB = DatasetJob(train_views=1, test_views=1, targets_per_class=0, resolution=16, samples=256, denoise=False)


def answering(folder: Path, **facts: object) -> str:
    """A program that says this of itself."""
    facts = {"path": [], "missing": [], "denoises": True, **facts}
    path = folder / "program"
    path.write_text(f"#!/bin/sh\necho noise\necho '{ANSWER}{json.dumps(facts)}'\n")
    path.chmod(0o755)
    return str(path)


@pytest.mark.parametrize("key", ["python", "executable"])
@pytest.mark.parametrize(
    ("path", "found"), [("/no/such", "No such file"), ("true", "status 0 and said: nothing"), (__file__, "denied")]
)
def test_what_is_neither_python_nor_blender_is_refused(key: str, path: str, found: str) -> None:
    with pytest.raises(
        InputError, match=rf"BlenderOptions\.{key}: expected an? .*{found}.*Correct BlenderOptions\.{key}"
    ):
        find_blender(BlenderOptions(**{key: path}), "scene")


def test_a_python_without_the_module_says_how_to_have_it(tmp_path: Path) -> None:
    program = answering(tmp_path, python=[3, 13], missing=["bpy", "torch"], blender=None)
    with pytest.raises(
        InputError, match=rf"{program} without bpy, torch.*{program} -m pip install 'rgspipe\[blender\]'"
    ):
        find_blender(BlenderOptions(python=program), "scene")


def test_a_blender_that_is_too_old_is_refused(tmp_path: Path) -> None:
    program = answering(tmp_path, python=[3, 10], blender=[2, 93, 1])
    with pytest.raises(InputError, match=r"Blender 3\.4 or later, found 2\.93\.1"):
        find_blender(BlenderOptions(executable=program), "scene")


def test_packages_are_lent_by_a_python_of_blender_s_version(tmp_path: Path) -> None:
    program = answering(tmp_path, python=[3, 9], path=["/x/site-packages", "/x"], blender=[5, 0, 1])
    with pytest.raises(InputError, match=r"Install rgspipe with Python 3\.9.*BlenderOptions\(python=PATH\)"):
        find_blender(BlenderOptions(executable=program), "scene")
    both = find_blender(BlenderOptions(python=program, executable=program), "scene")
    assert both.words == "Blender 5.0.1" and both.command("m", "a")[-3:] == ["/x/site-packages", "m", "a"]


def test_a_blender_without_a_denoiser_is_refused_before_anything_is_rendered(tmp_path: Path) -> None:
    program = answering(tmp_path, python=list(sys.version_info[:2]), blender=[3, 4, 1], denoises=False)
    options, folder = BlenderOptions(executable=program), tmp_path / "dataset"
    with pytest.raises(InputError, match=r"DatasetOptions\.denoise: expected false with this Blender"):
        render_dataset(replace(JOB, denoise=True), folder, options)
    assert not folder.exists()
    assert not find_blender(options, "scene").denoises


@needs_bpy
@pytest.mark.slow
def test_another_python_renders(tmp_path: Path) -> None:
    for name, options in {"own": OWN_BLENDER, "named": BlenderOptions(python=sys.executable)}.items():
        render_dataset(JOB, tmp_path / name, options)
    own, named = (load_dataset(tmp_path / name).train[0].image for name in ("own", "named"))
    assert own.max() > 0 and (own == named).all()


@needs_bpy
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("blender") is None, reason="no Blender is installed")
def test_an_installed_blender_renders(tmp_path: Path) -> None:
    for name, options in {"module": OWN_BLENDER, "program": BlenderOptions(executable="blender")}.items():
        render_dataset(JOB, tmp_path / name, options)
    module, program = (load_dataset(tmp_path / name).train[0] for name in ("module", "program"))
    assert (module.normal == program.normal).all() and (module.albedo == program.albedo).all()
    # Measured with Blender 3.4.1 of Debian beside bpy 5.0.1: 0.03 and 0.002, the noise of 256 samples.
    assert (program.image - module.image).norm() < 0.1 * module.image.norm()
    assert abs(float(program.image.mean() / module.image.mean()) - 1.0) < 0.03
