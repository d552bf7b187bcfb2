"""The page over scenes takes the newest report of each, and names the command that makes what is missing."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest

from html_page import Page
from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.config.core import plain
from rgspipe.stages.base import StageContext
from rgspipe.stages.report import overview
from rgspipe.store.artifacts import ArtifactStore, Key


def _write(
    root: Path, scene: str, fingerprint: str, files: dict[str, bytes], config: dict[str, object] | None = None
) -> None:
    def make(folder: Path) -> dict:
        for name, content in files.items():
            (folder / name).write_bytes(content)
        return {}

    recipe = {"config": config or {}, "inputs": {}, "code": {}}
    ArtifactStore(root).build(Key(scene, "report", fingerprint), recipe, make)


def _files(psnr: float) -> dict[str, bytes]:
    summary = {"counts": "7 views", "highlights": {"psnr": psnr}, "lights": []}
    return {"report.html": b"<html></html>", "summary.json": json.dumps(summary).encode()}


@pytest.fixture
def config(tmp_path: Path) -> RgspipeConfig:
    changes = {"stage": "overview", "outputs": str(tmp_path / "out"), "overview.scenes": ["a b", "room", "old"]}
    return with_changes(RgspipeConfig(), changes)


def _run(config: RgspipeConfig) -> tuple[Path, StageContext]:
    folder = Path(config.outputs) / "cornell" / "overview" / "aa"
    folder.mkdir(parents=True, exist_ok=True)
    context = StageContext(config, {}, {}, folder)
    overview.run(context)
    return folder / overview.PAGE, context


def test_links_lead_to_the_newest_report_of_each_scene(config: RgspipeConfig) -> None:
    for fingerprint, psnr in (("01", 31.0), ("02", 32.0)):
        _write(Path(config.outputs), "a b", fingerprint, _files(psnr))
    # A report of an older release lacks the figures.
    _write(Path(config.outputs), "old", "03", {"report.html": b"<html></html>"})
    path, context = _run(config)
    page = Page(path.read_text(encoding="utf-8"))
    assert set(page.addresses) == {"../../../a%20b/report/02/report.html"}
    assert (path.parent / "../../../a b/report/02/report.html").is_file()
    assert "32.0" in page.text and "31.0" not in page.text
    assert context.facts == {"scenes": ["a b"], "missing": ["room", "old"]}
    assert "python -m rgspipe pipeline=reproduce scene=room" in page.text
    assert "scene=external scene.path=DIR scene.name=old" in page.text


def test_a_report_of_another_scene_than_the_one_that_is_there_says_so(config: RgspipeConfig) -> None:
    """The newest may be one with true surfels, or with errors put in: its figures are not those of the scene."""
    sections = {name: plain(getattr(RgspipeConfig(), name)) for name in ("freeze", "capture", "fit")}
    others = sections | {"freeze": sections["freeze"] | {"surfels": "truth", "patches": 8}}
    _write(Path(config.outputs), "a b", "01", _files(31.0), sections)
    _write(Path(config.outputs), "room", "02", _files(32.0), others)
    path, _ = _run(config)
    text = Page(path.read_text(encoding="utf-8")).text
    assert text.count("UTC; freeze.surfels trained → truth") == 1 and "patches" not in text


def test_a_new_report_makes_another_page(config: RgspipeConfig) -> None:
    assert overview.STAGE.files(config) == []
    _write(Path(config.outputs), "room", "01", _files(31.0))
    first = overview.STAGE.files(config)
    _write(Path(config.outputs), "room", "02", _files(32.0))
    assert [path.parent.name for path in [*first, *overview.STAGE.files(config)]] == ["01", "02"]


def test_every_scene_of_the_default_page_can_be_made_by_its_command() -> None:
    config = with_changes(RgspipeConfig(), {"stage": "overview"})
    for name in config.overview.scenes:
        scene = shlex.split(overview.command(name))[-1]
        assert compose_config(["stage=report", scene]).scene.kind in ("cornell", "corner", "hotdog", "room")
