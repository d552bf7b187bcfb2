"""What `python -m rgspipe` and `python -m rgspipe --help` say."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rgspipe.config import RgspipeConfig
from rgspipe.config.core import describe
from rgspipe.errors import InputError
from rgspipe.options import shown
from rgspipe.resources import resource_folder
from rgspipe.stages import NAMES, stage_summary

SCENES = """\
  cornell    a Cornell box with two boxes, modelled and rendered with Blender; scene.cornell.* sets its measures
  cornell_glossy  the same with glossy boxes
  tutorial   the same with few images, in a few minutes
  corner     a closed corridor around a corner; targets with the light in the other leg (occlusion=around_corner)
  hotdog     a hot dog on a plate: curved and textured, in empty space
  room       a closed room with furniture, textured
  zoo        a room that nobody tuned, drawn from a seed: scene=zoo scene.zoo.seed=7 scene.name=zoo_7
  blend      a Blender file of yours: scene=blend scene.path=my.blend
  external   images, cameras and lights from disk, no Blender needed: scene=external scene.path=DIR"""

EXAMPLES = """\
  python -m rgspipe pipeline=smoke                                  the whole way, tiny, in minutes
  python -m rgspipe pipeline=reproduce                              the whole way, with a report at the end
  python -m rgspipe stage=train_surfels scene=cornell               a trained scene (and the images before it)
  python -m rgspipe stage=evaluate views=multi occlusion=occluded   lights out of sight, from three views
  python -m rgspipe -m stage=evaluate views.count=1,2,3             a sweep: one job for each value
  python -m rgspipe status                                          how the runs so far ended"""


class Setting(NamedTuple):
    """A key of the configuration, its meaning with unit and range, and its default as the command line has it."""

    key: str
    meaning: str
    default: str


def sections() -> dict[str, list[Setting]]:
    """Every setting by section; those outside of one are under ""."""
    found: dict[str, list[Setting]] = {}
    for key, meaning, default in describe(RgspipeConfig()):
        section, _, name = key.partition(".")
        found.setdefault(section if name else "", []).append(Setting(key, meaning, shown(default)))
    return found


def groups() -> dict[str, list[Path]]:
    """The files with the choices of each group of settings."""
    folders = sorted(path for path in resource_folder("conf").iterdir() if path.is_dir())
    return {folder.name: sorted(folder.glob("*.yaml")) for folder in folders}


def overview() -> str:
    """What a newcomer needs to know to start."""
    return f"""\
rgspipe: from images of a scene, find its lights.

It learns a scene of Gaussian surfels from images with known lights, freezes it with its global illumination,
and then finds unknown lights from one or a few images, also when they are out of sight.

Stages, each of which makes what it needs of those before it (stage=NAME):
{_stages()}

Scenes (scene=NAME, cornell if nothing is said):
{SCENES}

First commands:
{EXAMPLES}

Results are in outputs/<scene>/<stage>/latest. Keys and groups: python -m rgspipe --help"""


def help_text(topics: Sequence[str] = ()) -> str:
    """The long help, or the keys of one section or group.

    Raises:
        InputError: there is no such section.
    """
    if topics:
        return "\n\n".join(_topic(topic) for topic in topics)
    return f"""\
{overview()}

Groups (GROUP=CHOICE) of settings:
{_groups()}

Pipelines (pipeline=NAME): {", ".join(path.stem for path in sorted(resource_folder("pipelines").glob("*.yaml")))}

Keys (KEY=VALUE), by section; python -m rgspipe --help SECTION shows one with its units and ranges:
{_sections()}

More:
  upstream=require      refuse, instead of making, missing inputs
  -m                    sweep over all combinations of comma-separated values; hydra.launcher.n_jobs=K jobs at once
  launcher=slurm        the jobs of a sweep on a Slurm cluster; hydra.launcher.partition=NAME and so on
  --cfg job             show the whole configuration instead of running it
  debug.traceback=true  show tracebacks (or set RGSPIPE_TRACEBACK=1)
  verify                read every result and say which were damaged since they were made
  --hydra-help          options of Hydra, which reads the command line
Exit status: 0 done, 1 failed, 2 input that cannot be used."""


def _stages() -> str:
    return "\n".join(f"  {name:<17} {stage_summary(name)}".rstrip() for name in NAMES)


def _groups() -> str:
    return "\n".join(f"  {name:<11} {_choices(files)}" for name, files in groups().items())


def _choices(files: Sequence[Path]) -> str:
    return " | ".join(path.stem for path in files)


def _sections() -> str:
    return "\n".join(
        f"  {name:<11} {', '.join(setting.key.removeprefix(f'{name}.') for setting in settings)}"
        for name, settings in sections().items()
    )


def _topic(topic: str) -> str:
    every = [setting for settings in sections().values() for setting in settings]
    rows = [setting for setting in every if setting.key == topic or setting.key.startswith(f"{topic}.")]
    if not rows and topic not in groups():
        names = [setting.key for setting in every]
        near = difflib.get_close_matches(topic, [*names, *(name.partition(".")[0] for name in names)], n=1)
        remedy = f"Did you mean {near[0]}?" if near else "python -m rgspipe --help lists them."
        raise InputError(f"--help {topic}", expected="a section, a key or a group", found="none", remedy=remedy)
    lines = [f"{topic}={_choices(groups()[topic])}"] if topic in groups() else []
    width = max((len(setting.key) for setting in rows), default=0)
    lines += [f"  {setting.key:<{width}}  {setting.meaning}; default {setting.default}" for setting in rows]
    return "\n".join(lines)
