"""The stages, in the order of the way from images to lights: one module each, with a `STAGE`, imported when it runs."""

from __future__ import annotations

import ast
import difflib
import importlib
from pathlib import Path

from rgspipe.errors import InputError
from rgspipe.stages.base import Need, Stage, StageContext

__all__ = ["NAMES", "Need", "Stage", "StageContext", "load_stage", "stage_summary"]

NAMES = (
    "import_scan",
    "generate_dataset",
    "init_depth",
    "train_surfels",
    "capture_surfels",
    "true_surfels",
    "import_ply",
    "freeze",
    "export",
    "render_olat",
    "generate_targets",
    "fit_light",
    "track",
    "relight",
    "judge",
    "evaluate",
    "study",
    "report",
    "overview",
    "render_truth",
    "benchmark",
)


def load_stage(name: str) -> Stage:
    """The stage of this name.

    Raises:
        InputError: there is none; the message suggests the nearest name.
    """
    if name not in NAMES:
        near = difflib.get_close_matches(name, NAMES, n=1)
        remedy = f"Did you mean stage={near[0]}?" if near else "Choose one of them: stage=NAME."
        raise InputError("stage", expected=f"one of {', '.join(NAMES)}", found=repr(name), remedy=remedy)
    return importlib.import_module(f"{__name__}.{name}").STAGE


def stage_summary(name: str) -> str:
    """The first line of `stage_text`."""
    text = stage_text(name)
    return text.splitlines()[0] if text else ""


def stage_text(name: str) -> str:
    """A stage module's docstring, read without importing it (and torch with it)."""
    source = Path(__file__).with_name(f"{name}.py")
    text = ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) if source.is_file() else None
    return text or ""
