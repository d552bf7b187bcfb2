"""What `python -m rgspipe` and `python -m rgspipe --help` say."""

from __future__ import annotations

import difflib
import platform
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, NoReturn

from rgspipe import __version__
from rgspipe.cli.commands import COMMANDS
from rgspipe.config import RgspipeConfig
from rgspipe.config.core import describe
from rgspipe.errors import InputError
from rgspipe.machine.description import library_versions
from rgspipe.machine.resources import resource_folder
from rgspipe.options import shown
from rgspipe.stages import NAMES, stage_summary, stage_text

#: Columns of what is printed.
WIDTH = 100

#: Sections of settings that steer a stage of another name.
STAGE_SECTIONS = {
    "import_scan": ("scene",),
    "generate_dataset": ("scene", "dataset", "blender", "capture"),
    "init_depth": ("init",),
    "train_surfels": ("train", "init"),
    "capture_surfels": ("lamps",),
    "render_olat": ("targets", "blender"),
    "generate_targets": ("targets",),
    "fit_light": ("fit", "light", "views", "effects"),
    "render_truth": ("benchmark", "blender"),
}

SCENES = """\
  cornell    a Cornell box with two boxes, modelled and rendered with Blender; scene.cornell.* sets its measures
  cornell_glossy  the same with glossy boxes
  tutorial   the same with few images, in a few minutes
  corner     a closed corridor around a corner; targets with the light in the other leg (occlusion=around_corner)
  hotdog     a hot dog on a plate: curved and textured, in empty space
  room       a closed room with furniture, textured
  zoo        a room that nobody tuned, drawn from a seed: scene=zoo scene.zoo.seed=7 scene.name=zoo_7
  blend      a Blender file of yours: scene=blend scene.path=my.blend
  external   images, cameras and lights from disk, no Blender needed: scene=external scene.path=DIR
  rgbd       a scan, with the lamps that were on unknown: scene=rgbd scene.path=DIR
  mesh       a mesh and photographs of it, with the lamps unknown: scene=mesh scene.path=room.glb"""

EXAMPLES = """\
  python -m rgspipe demo                                              a small room in the browser, in seconds
  python -m rgspipe doctor                                            whether all is well, and what is missing
  python -m rgspipe stage=evaluate scene=tutorial occlusion=occluded  lights out of sight, in minutes
  python -m rgspipe view outputs/tutorial/freeze/latest               that scene in the browser: move its lamps
  python -m rgspipe pipeline=reproduce                                the whole way, with a report at the end
  python -m rgspipe -m stage=evaluate views.count=1,2,3               a sweep: one job for each value
  python -m rgspipe status                                            how the runs so far ended"""


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
    """What there is to set, on a screen; or a stage, or the keys of one section or group.

    Raises:
        InputError: there is no such section.
    """
    if topics:
        return "\n\n".join(_topic(topic) for topic in topics)
    pipelines = ", ".join(path.stem for path in sorted(resource_folder("pipelines").glob("*.yaml")))
    return f"""\
python -m rgspipe [-m] stage=NAME [scene=NAME] [GROUP=CHOICE …] [KEY=VALUE …]

Stages (--help STAGE says what one does; python -m rgspipe lists all, with scenes and first commands):
{_wrapped(", ".join(NAMES), "  ")}

Pipelines, several stages in a row (pipeline=NAME): {pipelines}

Groups of settings (--help GROUP, --help CHOICE):
{_groups()}

Sections of keys (--help SECTION lists them with units, ranges and defaults, --help fit.target one):
{_wrapped(", ".join(name for name in sections() if name), "  ")}

More:
  upstream=require      refuse, instead of making, missing inputs
  -m                    sweep over comma-separated values; hydra.launcher.n_jobs=K jobs at once
  launcher=slurm        the jobs of a sweep on a Slurm cluster; hydra.launcher.partition=NAME and so on
  --cfg job             show the whole configuration instead of running it
  debug.traceback=true  show tracebacks (or set RGSPIPE_TRACEBACK=1)
  status                how the runs so far ended; status NAME shows one, status state=failed some
  demo                  a small room in the browser, in seconds: drag its lamp, and see a hidden one found
  view FOLDER           a frozen scene in the browser, where lamps are moved and found
  stage=view            the configured scene there, with its photographs and fits; --help viewer
  outputs               what the results take on the disk; outputs prune removes what nothing needs any more
  doctor                whether all that is needed is here and works, and how accurate and fast it is
  verify                read every result and say which were damaged since they were made
  --shell-completion install=bash  for eval: lets the tab key complete stages, groups and keys
  --version             of rgspipe, Python and the libraries
  --hydra-help          options of Hydra, which reads the command line
Exit status: 0 done, 1 failed, 2 input that cannot be used."""


def version_text() -> str:
    """The versions that a report of a mistake should name."""
    versions = {"Python": platform.python_version(), **library_versions()}
    return "\n".join([f"rgspipe {__version__}", *(f"  {name} {version}" for name, version in versions.items())])


def _stages() -> str:
    return "\n".join(f"  {name:<17} {_shortened(stage_summary(name), WIDTH - 20)}".rstrip() for name in NAMES)


def _groups() -> str:
    return "\n".join(_wrapped(_choices(files), f"  {name:<11} ") for name, files in groups().items())


def _choices(files: Sequence[Path]) -> str:
    return " | ".join(path.stem for path in files)


def _wrapped(text: str, first: str) -> str:
    return textwrap.fill(text, WIDTH, initial_indent=first, subsequent_indent=" " * len(first))


def _shortened(text: str, width: int) -> str:
    return text if len(text) <= width else textwrap.shorten(text, width, placeholder=" …")


def _stage(name: str) -> str:
    """What a stage does, and where what steers it is explained."""
    text = stage_text(name)
    keys = [f"  --help {section}" for section in sections() if section and section in STAGE_SECTIONS.get(name, ())]
    return "\n".join([f"stage={name}", "", text, *(["", "Its settings:", *keys] if keys else [])])


def _topic(topic: str) -> str:
    if topic in COMMANDS:
        return COMMANDS[topic].text
    every = [setting for settings in sections().values() for setting in settings]
    rows = [setting for setting in every if setting.key == topic or setting.key.startswith(f"{topic}.")]
    lines = [_stage(topic)] if topic in NAMES else []
    lines += [f"{topic}={_choices(groups()[topic])}"] if topic in groups() else []
    if not lines and not rows:
        lines = _chosen(topic) or _refuse(topic, [setting.key for setting in every])
    width = max((len(setting.key) for setting in rows), default=0)
    lines += [f"  {setting.key:<{width}}  {setting.meaning}; default {setting.default}" for setting in rows]
    return "\n".join(lines)


def _chosen(topic: str) -> list[str]:
    """What each choice of this name ("blend", "scene=blend") sets, and where its settings are listed."""
    named = [(group, path) for group, files in groups().items() for path in files]
    chosen = [(group, path) for group, path in named if topic in (path.stem, f"{group}={path.stem}")]
    texts = [(f"{group}={path.stem} sets", path.read_text(encoding="utf-8").strip(), group) for group, path in chosen]
    return [f"{head}\n{textwrap.indent(text, '  ')}\n  --help {group}" for head, text, group in texts]


def _refuse(topic: str, keys: Sequence[str]) -> NoReturn:
    choices = [path.stem for files in groups().values() for path in files]
    known = [*COMMANDS, *choices, *keys, *NAMES, *(key.partition(".")[0] for key in keys)]
    near = difflib.get_close_matches(topic, known, n=1)
    remedy = f"Did you mean {near[0]}?" if near else "python -m rgspipe --help lists them."
    expected = "a stage, a section, a key, a group, a choice of one, or a command"
    raise InputError(f"--help {topic}", expected=expected, found="none", remedy=remedy)
