"""What a report shows of the scene in other lights: of each kind the newest that has been made."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from rgspipe.config import RgspipeConfig
from rgspipe.datasets.light_file import read_lights
from rgspipe.errors import InputError
from rgspipe.pages.gallery import light_words
from rgspipe.pages.relit import KINDS, Relighting
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key
from rgspipe.store.manifest import MANIFEST

#: The stage, and the files of its artifacts that are shown: the first of the pictures that is there.
STAGE_NAME, PICTURES = "relight", ("comparison.png", "sheet.png", "strip.png")
SUMMARY, VIDEO = "summary.csv", "sweep.webp"


def relight_files(config: RgspipeConfig) -> list[Path]:
    """The manifests of what `found_relightings` takes: they hold the checksums of all files."""
    return [found.path / MANIFEST for found in _newest(config).values()]


def found_relightings(config: RgspipeConfig, freeze: Artifact | None) -> list[Relighting]:
    """The newest artifact of each kind, in the order of the page.

    Args:
        freeze: the frozen scene that the report shows.
    """
    found = _newest(config)
    return [_relighting(kind, found[kind], freeze) for kind in KINDS if kind in found]


def _relighting(kind: str, made: Artifact, freeze: Artifact | None) -> Relighting:
    files = made.manifest["files"]
    same = freeze is not None and freeze.fingerprint in made.manifest["inputs"].get("freeze", ())
    return Relighting(
        kind,
        made.file(_picture(made)).read_bytes(),
        float(made.facts["milliseconds"]),
        _words(made) if kind == "rig" else "",
        pd.read_csv(made.file(SUMMARY)) if SUMMARY in files else None,
        made.file(VIDEO).read_bytes() if VIDEO in files else None,
        "" if same else f"Made on {_made(made)[:10]}, of another frozen scene than the rest of this page shows.",
    )


def _picture(made: Artifact) -> str:
    return next(name for name in PICTURES if name in made.manifest["files"])


def _words(made: Artifact) -> str:
    """The lights of a single rig."""
    names = [name for name in made.manifest["files"] if name.startswith("lights/")]
    return light_words(tuple(light for name in names for light in read_lights(made.file(name))))


def _newest(config: RgspipeConfig) -> dict[str, Artifact]:
    """By kind, of those with a picture."""
    store, newest = ArtifactStore(Path(config.outputs)), {}
    folder = Path(config.outputs) / config.scene.folder / STAGE_NAME
    for path in sorted(folder.glob(f"[!.]*/{MANIFEST}")):
        if path.parent.is_symlink():
            continue
        try:
            found = store.find(Key(config.scene.folder, STAGE_NAME, path.parent.name))
        except InputError:
            continue
        if found is None or not any(name in found.manifest["files"] for name in PICTURES):
            continue
        kind = str(found.facts["shows"])
        if kind not in newest or _made(found) > _made(newest[kind]):
            newest[kind] = found
    return newest


def _made(artifact: Artifact) -> str:
    """When it was made, as text that sorts by time."""
    return str(artifact.manifest.get("created", ""))
