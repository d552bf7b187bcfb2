"""The study of bad captures that a report shows, if one has been made."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from rgspipe.artifacts import Artifact, ArtifactStore
from rgspipe.config import RgspipeConfig

STUDY = "study.csv"


def study_file(config: RgspipeConfig) -> list[Path]:
    """The table of the study that `found_study` takes, or nothing."""
    found = _newest(config)
    return [] if found is None else [found.path / STUDY]


def found_study(config: RgspipeConfig, judged: Sequence[Artifact]) -> tuple[pd.DataFrame | None, str]:
    """The rows of this scene of the newest study that has any, and what the reader must know of them.

    Args:
        judged: the judgements that the report shows; a study of the same scene has the first of them among its own.
    """
    found = _newest(config)
    if found is None:
        return None, ""
    same = bool(judged) and judged[0].fingerprint in found.manifest["inputs"].get("judge", ())
    day = _made(found)[:10]
    remark = (
        "" if same else f"This study, of {day}, was made with other settings, data or code than the rest of this page."
    )
    return _rows(found, config.scene.folder), remark


def _newest(config: RgspipeConfig) -> Artifact | None:
    """A study over several scenes lies in the folder of the one that was configured, so all folders are looked at."""
    root, scene = Path(config.outputs), config.scene.folder
    store = ArtifactStore(root)
    folders = sorted(path.parent.name for path in root.glob("*/study"))
    studies = [found for name in folders if (found := store.newest(name, "study")) is not None]
    known = [found for found in studies if len(_rows(found, scene))]
    return max(known, key=_made, default=None)


def _made(study: Artifact) -> str:
    """When it was made, as text that sorts by time."""
    return str(study.manifest.get("created", ""))


def _rows(study: Artifact, scene: str) -> pd.DataFrame:
    table = pd.read_csv(study.file(STUDY))
    return table[table["scene"] == scene].reset_index(drop=True)
