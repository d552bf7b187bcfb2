"""Every stage declares what it is, what it needs and what its result depends on."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import rgspipe
from rgspipe.config import RgspipeConfig, get_value, with_changes
from rgspipe.errors import InputError
from rgspipe.fingerprints import code_fingerprints
from rgspipe.stages import NAMES, load_stage, stage_summary

PACKAGE = Path(rgspipe.__file__).parent

#: Code that runs stages, talks to people, or reads formats into plain types, where a change makes no other result.
NO_RESULT = (
    "rgspipe.artifacts",
    "rgspipe.config",
    "rgspipe.datasets",
    "rgspipe.errors",
    "rgspipe.files",
    "rgspipe.machine",
    "rgspipe.progress",
    "rgspipe.scene",
    "rgspipe.stages.base",
    "rgspipe.stages.sources",
)


def below(module: str, prefixes: tuple[str, ...]) -> bool:
    return any(module == prefix or module.startswith(f"{prefix}.") for prefix in prefixes)


def source(module: str) -> Path:
    path = PACKAGE.joinpath(*module.split(".")[1:])
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def imported(module: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(source(module).read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("rgspipe."):
            for name in node.names:
                full = f"{node.module}.{name.name}"
                yield full if source(full).is_file() else str(node.module)


def closure(module: str) -> set[str]:
    """All modules of the package that a module imports, directly or not."""
    found, open_ends = set(), [module]
    while open_ends:
        for name in imported(open_ends.pop()):
            if name not in found and not below(name, NO_RESULT):
                found.add(name)
                open_ends.append(name)
    return found


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
    assert code_fingerprints(stage.code)


@pytest.mark.parametrize("name", NAMES)
def test_a_change_of_any_code_behind_a_result_rebuilds_it(name: str) -> None:
    missing = {
        module for module in closure(f"rgspipe.stages.{name}") if not below(module, tuple(load_stage(name).code))
    }
    assert not missing, f"add {sorted(missing)} to the `code` of stages/{name}.py"


def test_no_stage_loads_blender_into_its_own_process() -> None:
    # It weighs hundreds of MB, and who fits targets that are already rendered may not have it.
    script = "import sys; sys.modules['bpy'] = None; from rgspipe.stages import NAMES, load_stage; "
    subprocess.run([sys.executable, "-c", script + "[load_stage(name) for name in NAMES]"], check=True)


def test_an_unknown_stage_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(InputError, match="stage=fit_light"):
        load_stage("fit_ligth")
