"""Put scenes on one page: the best figures and a few pictures of each, with links to their reports."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from urllib.parse import quote

from rgspipe.config import RgspipeConfig
from rgspipe.config.compared import OTHER_SCENE
from rgspipe.config.core import plain
from rgspipe.datasets.json_file import read_json
from rgspipe.machine.resources import resource_folder
from rgspipe.pages.overview import SceneEntry, render_overview
from rgspipe.stages.base import Stage, StageContext
from rgspipe.stages.report.report import HELD_OUT, REPORT, SUMMARY, VIEW
from rgspipe.store.artifacts import Artifact, ArtifactStore
from rgspipe.store.files import write_text
from rgspipe.store.fingerprints import config_differences
from rgspipe.store.manifest import MANIFEST

PAGE = "overview.html"


def run(context: StageContext) -> None:
    """Write overview.html from the newest report of each scene; a scene without one is named with its command."""
    found = _reports(context.config)
    missing = {name: command(name) for name in context.config.overview.scenes if name not in found}
    page = render_overview([_entry(name, artifact) for name, artifact in found.items()], missing)
    write_text(context.folder / PAGE, page)
    context.note(scenes=list(found), missing=list(missing))


def _reports(config: RgspipeConfig) -> Mapping[str, Artifact]:
    """By scene, its newest report that says what a page over scenes needs."""
    store = ArtifactStore(Path(config.outputs))
    newest = {name: store.newest(name, "report") for name in dict.fromkeys(config.overview.scenes)}
    return {name: made for name, made in newest.items() if made is not None and SUMMARY in made.manifest["files"]}


def _entry(name: str, report: Artifact) -> SceneEntry:
    # From <outputs>/<scene>/overview/<fingerprint>/ to <outputs>/<name>/report/<fingerprint>/.
    address = "/".join(["..", "..", "..", quote(name), "report", report.fingerprint, REPORT])
    summary = read_json(report.file(SUMMARY), "the figures of a report")
    made = str(report.manifest.get("created", "")).partition("+")[0].replace("T", " ") + " UTC"
    made = "; ".join([made, *_others(report)])
    return SceneEntry(name, address, made, summary, _bytes(report, VIEW), _bytes(report, HELD_OUT))


def _others(report: Artifact) -> list[str]:
    """The settings by which a report is of another scene than the one that is there."""
    of_report, usual = report.manifest["config"], RgspipeConfig()
    sections = [key.partition(".")[0] for key in OTHER_SCENE]
    before = {name: plain(getattr(usual, name)) for name in sections}
    now = {name: of_report[name] for name in sections if name in of_report}
    told = config_differences(now, before)
    return [text for text in told if any(text.startswith((f"{key} ", f"{key}.")) for key in OTHER_SCENE)]


def _bytes(report: Artifact, name: str) -> bytes | None:
    return report.file(name).read_bytes() if name in report.manifest["files"] else None


def command(name: str) -> str:
    """What makes the report of a scene, with all that it needs."""
    known = (resource_folder("conf") / "scene" / f"{name}.yaml").is_file()
    scene = f"scene={name}" if known else f"scene=external scene.path=DIR scene.name={name}"
    return f"python -m rgspipe pipeline=reproduce {scene}"


def _manifests(config: RgspipeConfig) -> list[Path]:
    """A manifest holds the checksums of all files of its report."""
    return [report.path / MANIFEST for report in _reports(config).values()]


STAGE = Stage(
    name="overview",
    help="one page over scenes, from their reports",
    run=run,
    config_keys=("overview",),
    files=_manifests,
    of_scenes=True,
)
