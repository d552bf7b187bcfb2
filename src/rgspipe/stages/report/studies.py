"""The studies that a report shows: of each kind and set of methods the newest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import pandas as pd

from rgspipe.config import RgspipeConfig
from rgspipe.errors import InputError
from rgspipe.pages.light_studies import LightStudy
from rgspipe.store.artifacts import Artifact, ArtifactStore, Key
from rgspipe.studies.lights import KINDS
from rgspipe.studies.written import TABLE

STUDY, CAPTURES = "study", "captures"


def study_files(config: RgspipeConfig) -> list[Path]:
    """The tables of the studies that `found_captures` and `found_light_studies` take."""
    return [study.path / TABLE for kind in (CAPTURES, *KINDS) for study in newest_studies(config, kind)]


def found_captures(config: RgspipeConfig, judged: Sequence[Artifact]) -> tuple[pd.DataFrame | None, str]:
    """This scene's rows of the newest study of bad captures that has any, and what the reader must know of them.

    Args:
        judged: the judgements that the report shows; a study of the same scene has the first of them among its own.
    """
    found = next(iter(newest_studies(config, CAPTURES)), None)
    if found is None:
        return None, ""
    same = bool(judged) and judged[0].fingerprint in found.manifest["inputs"].get("judge", ())
    day = _made(found)[:10]
    remark = (
        "" if same else f"This study, of {day}, was made with other settings, data or code than the rest of this page."
    )
    return study_rows(found, config), remark


def found_light_studies(config: RgspipeConfig, freeze: Artifact | None) -> list[LightStudy]:
    """This scene's rows of the newest study of each kind, and what the reader must know of them.

    Args:
        freeze: the frozen scene that the report shows; a study of the same scene has fits of it.
    """
    return [
        LightStudy(kind, study_rows(study, config), _remark(config, study, freeze))
        for kind in KINDS
        for study in newest_studies(config, kind)
    ]


def newest_studies(config: RgspipeConfig, kind: str) -> list[Artifact]:
    """The newest study of a kind with rows of this scene, of each set of methods; those of few methods first."""
    newest: dict[tuple[str, ...], Artifact] = {}
    for found in _studies(config, kind):
        methods = tuple(found.manifest["config"]["study"]["methods"])
        if methods not in newest or _made(found) > _made(newest[methods]):
            newest[methods] = found
    return [newest[methods] for methods in sorted(newest, key=len)]


def _studies(config: RgspipeConfig, kind: str) -> Iterator[Artifact]:
    """Whole studies with rows of this scene; in all folders, as a study over several scenes lies in one scene's."""
    root = Path(config.outputs)
    for path in sorted(root.glob(f"*/{STUDY}/*/{TABLE}")):
        if path.parent.is_symlink() or path.parent.name.startswith("."):
            continue
        found = _readable(ArtifactStore(root), Key(path.parents[2].name, STUDY, path.parent.name))
        # Studies that were made before they had kinds have none.
        if found is not None and found.facts.get("kind") == kind and len(study_rows(found, config)):
            yield found


def _readable(store: ArtifactStore, key: Key) -> Artifact | None:
    try:
        return store.find(key)
    except InputError:
        return None


def _made(study: Artifact) -> str:
    """When it was made, as text that sorts by time."""
    return str(study.manifest.get("created", ""))


def study_rows(study: Artifact, config: RgspipeConfig) -> pd.DataFrame:
    """The rows of a study that are of this scene."""
    table = pd.read_csv(study.file(TABLE), dtype={"target": str})
    return table[table["scene"] == config.scene.folder].reset_index(drop=True)


def _remark(config: RgspipeConfig, study: Artifact, freeze: Artifact | None) -> str:
    """Whether no fit of the study is one of the frozen scene of the report."""
    store, scene = ArtifactStore(Path(config.outputs)), config.scene.folder
    fits = [_readable(store, Key(scene, "evaluate", name)) for name in study.manifest["inputs"].get("evaluate", ())]
    frozen = {name for fit in fits if fit is not None for name in fit.manifest["inputs"].get("freeze", ())}
    if freeze is not None and freeze.fingerprint in frozen:
        return ""
    return f"This study, of {_made(study)[:10]}, is not of the frozen scene that the rest of this page shows."
