"""The studies of recovered lights that a report shows: of each kind and set of methods the newest with this scene."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from rgspipe.artifacts import Artifact, ArtifactStore, Key
from rgspipe.config import RgspipeConfig
from rgspipe.errors import InputError
from rgspipe.pages.light_studies import LightStudy
from rgspipe.studies.lights import KINDS

STAGE_NAME, TABLE = "light_study", "study.csv"


def light_study_files(config: RgspipeConfig) -> list[Path]:
    """The tables of the studies that `found_light_studies` takes."""
    return [found.path / TABLE for found in _newest(config).values()]


def found_light_studies(config: RgspipeConfig, freeze: Artifact | None) -> list[LightStudy]:
    """This scene's rows of the newest study of each kind, and what the reader must know of them.

    Args:
        freeze: the frozen scene that the report shows; a study of the same scene has fits of it.
    """
    found = _newest(config)
    return [
        LightStudy(kind, _rows(study, config.scene.folder), _remark(config, study, freeze))
        for kind in KINDS
        for (its_kind, _), study in sorted(found.items(), key=lambda item: len(item[0][1]))
        if its_kind == kind
    ]


def _newest(config: RgspipeConfig) -> dict[tuple[str, tuple[str, ...]], Artifact]:
    """By kind and methods; all folders are looked at, as a study over several scenes lies in one scene's."""
    root, scene = Path(config.outputs), config.scene.folder
    store, newest = ArtifactStore(root), {}
    for path in sorted(root.glob(f"*/{STAGE_NAME}/*/{TABLE}")):
        if path.parent.is_symlink() or path.parent.name.startswith("."):
            continue
        found = _readable(store, Key(path.parents[2].name, STAGE_NAME, path.parent.name))
        if found is None or not len(_rows(found, scene)):
            continue
        asked = str(found.facts["kind"]), tuple(found.manifest["config"].get("light_study", {}).get("methods", ()))
        if asked not in newest or _made(found) > _made(newest[asked]):
            newest[asked] = found
    return newest


def _readable(store: ArtifactStore, key: Key) -> Artifact | None:
    try:
        return store.find(key)
    except InputError:
        return None


def _made(study: Artifact) -> str:
    """When it was made, as text that sorts by time."""
    return str(study.manifest.get("created", ""))


def _rows(study: Artifact, scene: str) -> pd.DataFrame:
    table = pd.read_csv(study.file(TABLE))
    return table[table["scene"] == scene].reset_index(drop=True)


def _remark(config: RgspipeConfig, study: Artifact, freeze: Artifact | None) -> str:
    """Whether no fit of the study is one of the frozen scene of the report."""
    store, scene = ArtifactStore(Path(config.outputs)), config.scene.folder
    fits = [_readable(store, Key(scene, "evaluate", name)) for name in study.manifest["inputs"].get("evaluate", ())]
    frozen = {name for fit in fits if fit is not None for name in fit.manifest["inputs"].get("freeze", ())}
    if freeze is not None and freeze.fingerprint in frozen:
        return ""
    return f"This study, of {_made(study)[:10]}, is not of the frozen scene that the rest of this page shows."
