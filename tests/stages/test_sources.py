"""What is looked at before anything is made: a target has to tell where its cameras were."""

from __future__ import annotations

from pathlib import Path

import pytest

from rgspipe.cli.view import view_folder
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.demo import TARGET
from rgspipe.errors import InputError
from rgspipe.stages import load_stage
from rgspipe.stages.sources import check_target


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ((), "an empty folder"),
        (("b.png", "a.png"), "no such file among a.png, b.png. "),
        (tuple(f"{k}.jpg" for k in range(7)), "0.jpg, 1.jpg, 2.jpg, 3.jpg, 4.jpg, …"),
    ],
)
def test_photographs_without_cameras_are_no_target(tmp_path: Path, names: tuple[str, ...], found: str) -> None:
    """As a fit refuses them before a scene is trained for it, and the viewer before it reads one."""
    for name in names:
        (tmp_path / name).touch()
    config = with_changes(RgspipeConfig(), {"fit.target": str(tmp_path)})
    for refuse in (
        lambda: check_target(tmp_path),
        lambda: load_stage("fit_light").files(config),
        lambda: view_folder(["nowhere", f"target={tmp_path}"]),
    ):
        with pytest.raises(InputError) as caught:
            refuse()
        assert found in str(caught.value) and "your_own_scene.md" in caught.value.remedy


def test_a_target_is_one(tmp_path: Path) -> None:
    check_target(TARGET)
    with pytest.raises(InputError, match="no such folder"):
        check_target(tmp_path / "nowhere")
