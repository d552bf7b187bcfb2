"""What a kind of study is: what it gathers, and what it makes of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rgspipe.config import RgspipeConfig
from rgspipe.stages.base import Need, StageContext
from rgspipe.studies.written import Study


def _study_alone(config: RgspipeConfig) -> tuple[str]:
    return ("study",)


def _no_files(config: RgspipeConfig) -> tuple[()]:
    return ()


@dataclass(frozen=True)
class StudyKind:
    """A kind of study; the attributes are those of a `Stage`, for configurations with this kind.

    Attributes:
        inputs: the artifacts that it gathers.
        gather: the study that they come to.
        keys: what the result depends on beside them.
        files: files outside the store, likewise.
    """

    inputs: Callable[[RgspipeConfig], Sequence[Need | str]]
    gather: Callable[[StageContext], Study]
    keys: Callable[[RgspipeConfig], Sequence[str]] = _study_alone
    files: Callable[[RgspipeConfig], Sequence[Path]] = _no_files
