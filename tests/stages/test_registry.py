"""Every stage declares what it is, what it needs and what its result depends on."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import rgspipe
from rgspipe.config import RgspipeConfig, get_value, with_changes
from rgspipe.errors import InputError
from rgspipe.graph.resolver import NO_RESULT
from rgspipe.graph.source_code import SourceCode
from rgspipe.stages import NAMES, load_stage, stage_summary

PACKAGE = Path(rgspipe.__file__).parent

#: Some modules that stages reach by ways of their own: within functions, by another process, through another stage.
REACHED = {
    "generate_dataset": ("blender.child", "blender.passes", "blender.models.hotdog", "datasets.exr"),
    "render_olat": ("blender.pool.plan", "blender.cameras", "stages.images.generate_dataset"),
    "render_truth": ("blender.room", "benchmark.rooms"),
    "benchmark": ("benchmark.mitsuba_worker", "blender.room", "renderer.kernels.shadow"),
    "train_surfels": ("training.trainer", "scene.camera", "optim.ssim"),
    "fit_light": ("fitting.fit", "renderer.kernels.composite", "renderer.frozen_file"),
    "track": ("stages.lights.fit_light", "fitting.tracking.track"),
    "report": ("pages", "pages.html"),
}

#: Some that they must not be made again for.
NOT_REACHED = {
    "freeze": ("training.trainer", "fitting.tracking.track"),
    "fit_light": ("blender.passes", "training.trainer", "fitting.tracking.track"),
    "train_surfels": ("fitting.fit",),
    "generate_dataset": ("blender.room", "blender.pool.plan"),
    "render_olat": ("blender.pool.compose", "blender.room"),
    "true_surfels": ("blender.passes",),
}


@pytest.fixture(scope="module")
def source_code() -> SourceCode:
    return SourceCode(NO_RESULT)


@pytest.mark.parametrize("name", NAMES)
def test_a_stage_is_complete(name: str) -> None:
    stage = load_stage(name)
    assert stage.name == name
    assert stage.help and stage_summary(name)
    config = with_changes(RgspipeConfig(), {"stage": name})
    for key in stage.keys(config):
        get_value(config, key)
    for need in stage.needs(config):
        assert need.stage in NAMES[: NAMES.index(name)], "a stage needs only stages before it"
        with_changes(config, need.changes)


@pytest.mark.parametrize("name", NAMES)
def test_a_change_of_any_code_behind_a_result_rebuilds_it(name: str, source_code: SourceCode) -> None:
    module = load_stage(name).run.__module__
    assert module.removeprefix("rgspipe.stages.").split(".")[1:] == [name]
    found = {module.removeprefix("rgspipe.") for module in source_code.fingerprints(module)}
    assert found.issuperset(REACHED.get(name, ()))
    assert found.isdisjoint(NOT_REACHED.get(name, ()))
    assert found.isdisjoint({"config", "errors", "graph.pipeline"})


def test_packages_do_nothing_on_the_way_to_their_modules() -> None:
    # A package counts where its own name is imported, so it must do no more than define names.
    harmless = ast.Import | ast.ImportFrom | ast.Assign | ast.AnnAssign | ast.FunctionDef | ast.ClassDef
    for path in PACKAGE.rglob("__init__.py"):
        statements = ast.parse(path.read_text()).body[1:]  # after the docstring
        statements = [node for node in statements if ast.unparse(node).partition("\n")[0] != "if TYPE_CHECKING:"]
        assert path.parent == PACKAGE or all(isinstance(statement, harmless) for statement in statements), path


#: What no stage loads before it is needed: Blender weighs hundreds of MB, and who fits targets that others rendered may
#: not have it; the others are slow to import, and most runs do without them.
LATE = ("bpy", "trimesh", "scipy.stats")


def test_no_stage_loads_what_few_need() -> None:
    script = f"import sys; sys.modules |= dict.fromkeys({LATE}); from rgspipe.stages import NAMES, load_stage; "
    subprocess.run([sys.executable, "-c", script + "[load_stage(name) for name in NAMES]"], check=True)


def test_an_unknown_stage_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(InputError, match="stage=fit_light"):
        load_stage("fit_ligth")
