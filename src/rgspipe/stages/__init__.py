"""The stages: one module each, with a `STAGE`, in a room with what helps it alone; imported when it runs."""

from __future__ import annotations

import ast
import difflib
import importlib
from pathlib import Path

from rgspipe.errors import InputError
from rgspipe.stages.base import Need, Stage, StageContext

__all__ = ["NAMES", "ROOMS", "Need", "Stage", "StageContext", "load_stage", "stage_summary"]

#: The stages by their rooms, in the order of the way from images to lights.
ROOMS = {
    "images": ("import_scan", "generate_dataset"),
    "scene": (
        "init_depth",
        "train_surfels",
        "capture_surfels",
        "true_surfels",
        "import_ply",
        "freeze",
        "export",
    ),
    "targets": ("render_olat", "generate_targets"),
    "lights": ("fit_light", "track"),
    "relight": ("relight",),
    "evaluation": ("judge", "evaluate"),
    "studies": ("study",),
    "report": ("report", "overview"),
    "benchmark": ("render_truth", "benchmark"),
}

NAMES = tuple(name for names in ROOMS.values() for name in names)


def load_stage(name: str) -> Stage:
    """The stage of this name.

    Raises:
        InputError: there is none; the message suggests the nearest name.
    """
    if name not in NAMES:
        near = near_stage(name)
        remedy = f"Did you mean stage={near}?" if near else "Choose one of them: stage=NAME."
        raise InputError("stage", expected=f"one of {', '.join(NAMES)}", found=repr(name), remedy=remedy)
    return importlib.import_module(f"{__name__}.{_room(name)}.{name}").STAGE


def near_stage(word: str) -> str | None:
    """The stage that a misspelt word may have meant, by its name or a part of it; None if none is like it."""
    parts = {part: name for name in reversed(NAMES) for part in name.split("_")}
    near = difflib.get_close_matches(word, [*NAMES, *parts], n=1)
    return {**parts, **{name: name for name in NAMES}}[near[0]] if near else None


def stage_summary(name: str) -> str:
    """The first line of `stage_text`."""
    text = stage_text(name)
    return text.splitlines()[0] if text else ""


def stage_text(name: str) -> str:
    """A stage module's docstring, read without importing it (and torch with it)."""
    if name not in NAMES:
        return ""
    source = Path(__file__).parent / _room(name) / f"{name}.py"
    return ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) or ""


def _room(name: str) -> str:
    return next(room for room, names in ROOMS.items() if name in names)
