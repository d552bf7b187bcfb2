"""Compare cases, methods and numbers of views: bad captures, recovered lights, ways to the answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.stages.base import Need, Stage, StageContext
from rgspipe.stages.studies import captures, courses, lamps, lights, zoo
from rgspipe.stages.studies.kind import StudyKind
from rgspipe.studies.lights import KINDS as OF_LIGHTS
from rgspipe.studies.written import write_study

#: What `study.kind` may be.
KINDS: Mapping[str, StudyKind] = {
    "captures": captures.KIND,
    "lamps": lamps.KIND,
    **dict.fromkeys(OF_LIGHTS, lights.KIND),
    "courses": courses.KIND,
    "zoo": zoo.KIND,
}


def run(context: StageContext) -> None:
    """Write study.csv, study.md, study.png and what the kind puts beside them."""
    study = _kind(context.config).gather(context)
    write_study(context.folder, context.config.study.kind, study)
    context.note(kind=context.config.study.kind, rows=len(study.table))


def _kind(config: RgspipeConfig) -> StudyKind:
    return KINDS[config.study.kind]


def _inputs(config: RgspipeConfig) -> Sequence[Need | str]:
    return _kind(config).inputs(config)


def _keys(config: RgspipeConfig) -> Sequence[str]:
    return _kind(config).keys(config)


def _files(config: RgspipeConfig) -> Sequence[Path]:
    return _kind(config).files(config)


STAGE = Stage(
    name="study",
    help="cases, methods and numbers of views side by side: one table, one figure",
    run=run,
    inputs=_inputs,
    config_keys=_keys,
    files=_files,
)
