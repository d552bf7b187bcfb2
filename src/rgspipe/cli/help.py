"""What `python -m rgspipe` and `python -m rgspipe --help` say."""

from __future__ import annotations

import difflib
import platform
import re
import textwrap
from collections.abc import Callable, Sequence
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

#: Columns of what is printed: those of a terminal as it opens.
WIDTH = 80

#: Lines that such a terminal has beside the next prompt; keys that take more are listed by a line each.
SCREEN = 23

#: Beside a topic: all that there is to say of it, however long.
ALL = "--all"

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

FRONT = """\
rgspipe: from images of a scene, find its lights.

  rgspipe demo                    a small room in the browser, in seconds
  rgspipe doctor                  whether all is well, and what is missing
  rgspipe stage=evaluate scene=tutorial occlusion=occluded
                                  lights out of sight, in minutes
  rgspipe view outputs/tutorial/freeze/latest
                                  that scene in the browser: move its lamps
  rgspipe status                  how the runs so far ended

In general: rgspipe stage=NAME [scene=NAME] [GROUP=CHOICE …] [KEY=VALUE …]
What a stage needs is made first; results: outputs/<scene>/<stage>/latest.

rgspipe --help stages     what can be made, in the order in which it is needed
        --help scenes     scenes of ours; a .blend file, photographs, scans
        --help groups     settings by choice: light=spot, accuracy=draft
        --help keys       all other settings, in sections
        --help commands   what there is beside stages
        --help options    sweeps, pipelines, a cluster, tracebacks, the tab key
        --help NAME       one stage, group, choice, section, key or command"""

SCENES = """\
Scenes: scene=NAME, cornell if nothing is said

  cornell         a Cornell box with two boxes, modelled and rendered with
                  Blender; scene.cornell.* sets its measures
  cornell_glossy  the same with glossy boxes
  tutorial        the same with few images, in a few minutes
  corner          a closed corridor around a corner; targets with the light in
                  the other leg (occlusion=around_corner)
  hotdog          a hot dog on a plate: curved and textured, in empty space
  room            a closed room with furniture, textured
  zoo             a room that nobody tuned, drawn from a seed:
                  scene=zoo scene.zoo.seed=7 scene.name=zoo_7
  blend           a Blender file of yours: scene=blend scene.path=my.blend
  external        images, cameras and lights from disk, no Blender needed:
                  scene=external scene.path=DIR
  rgbd            a scan, with the lamps that were on unknown:
                  scene=rgbd scene.path=DIR
  mesh            a mesh and photographs of it, with the lamps unknown:
                  scene=mesh scene.path=room.glb
  ply             surfels from a PLY file: scene=ply scene.path=surfels.ply"""

OPTIONS = """\
Options, anywhere on the line

  pipeline=NAME             {pipelines}
  --dry-run                 show what would be made and reused, and stop
  upstream=require          refuse, instead of making, missing inputs
  -m KEY=A,B                sweep: a job for each value
  hydra.launcher.n_jobs=K   K jobs of a sweep at once
  launcher=slurm            the jobs of a sweep on a Slurm cluster;
                            hydra.launcher.partition=NAME and so on
  --cfg job                 show the whole configuration instead of running it
  debug.traceback=true      show tracebacks (or set RGSPIPE_TRACEBACK=1)
  --shell-completion install=bash
                            for eval: the tab key completes stages and keys;
                            install=zsh; install=fish, for source
  --help SECTION --all      what each of a section's keys means
  --version                 of rgspipe, Python and the libraries
  --hydra-help              options of Hydra, which reads the command line

Exit status: 0 done, 1 failed, 2 input that cannot be used, 130 interrupted."""


class SettingHelp(NamedTuple):
    """A key of the configuration, its meaning with unit and range, and its default as the command line has it."""

    key: str
    meaning: str
    default: str


def sections() -> dict[str, list[SettingHelp]]:
    """Every setting by section; those outside of one are under ""."""
    found: dict[str, list[SettingHelp]] = {}
    for key, meaning, default in describe(RgspipeConfig()):
        section, _, name = key.partition(".")
        found.setdefault(section if name else "", []).append(SettingHelp(key, meaning, shown(default)))
    return found


def groups() -> dict[str, list[Path]]:
    """The files with the choices of each group of settings."""
    folders = sorted(path for path in resource_folder("conf").iterdir() if path.is_dir())
    return {folder.name: sorted(folder.glob("*.yaml")) for folder in folders}


def topics() -> dict[str, None]:
    """What `--help` can be asked about, in order and each once; single keys and choices apart."""
    return dict.fromkeys([*PAGES, *COMMANDS, *NAMES, *groups(), *filter(None, sections())])


def pipelines() -> list[str]:
    """Their names."""
    return [path.stem for path in sorted(resource_folder("pipelines").glob("*.yaml"))]


def help_text(topics: Sequence[str] = ()) -> str:
    """What to begin with, on a screen; or a page, a stage, a command, or the keys of one section or group.

    Args:
        topics: names of these; ALL among them asks for every key's text where their number makes it a list.

    Raises:
        InputError: there is no such topic.
    """
    texts = [_topic(topic, ALL in topics) for topic in topics if topic != ALL]
    return "\n\n".join(texts) or FRONT


def version_text() -> str:
    """The versions that a report of a mistake should name."""
    versions = {"Python": platform.python_version(), **library_versions()}
    return "\n".join([f"rgspipe {__version__}", *(f"  {name} {version}" for name, version in versions.items())])


def _stages() -> str:
    summaries = {name: stage_summary(name) for name in NAMES} | {"view": "Show the scene in the browser."}
    rows = (f"  {name:<17} {_shortened(text, WIDTH - 20)}" for name, text in summaries.items())
    return "\n".join(["Stages: stage=NAME; --help NAME says more", *rows])


def _groups() -> str:
    rows = (_wrapped(_choices(files), f"  {name:<11} ") for name, files in groups().items())
    return "\n".join(["Settings by choice: GROUP=CHOICE; --help GROUP or --help CHOICE says more", "", *rows])


def _keys() -> str:
    names = _wrapped(", ".join(name for name in sections() if name), "  ")
    head = "Sections of keys; --help SECTION lists them, --help KEY has unit, range, default"
    alone = f"Keys without a section: {', '.join(row.key for row in sections()[''])}"
    return "\n".join([head, "", names, "", _wrapped(alone, "")])


def _commands() -> str:
    rows = (f"  {name:<9} {command.summary}" for name, command in COMMANDS.items())
    return "\n".join(["Commands: rgspipe NAME; --help NAME says more", "", *rows])


def _options() -> str:
    return OPTIONS.format(pipelines=_wrapped(f"several stages in a row: {', '.join(pipelines())}", " " * 28).lstrip())


#: Pages that the first one leads to.
PAGES: dict[str, Callable[[], str]] = {
    "stages": _stages,
    "scenes": lambda: SCENES,
    "groups": _groups,
    "keys": _keys,
    "commands": _commands,
    "options": _options,
}


def _choices(files: Sequence[Path]) -> str:
    return " | ".join(path.stem for path in files)


def _wrapped(text: str, first: str) -> str:
    return textwrap.fill(text, WIDTH, initial_indent=first, subsequent_indent=" " * len(first))


def _shortened(text: str, width: int) -> str:
    return text if len(text) <= width else textwrap.shorten(text, width, placeholder=" …")


def _stage(name: str) -> str:
    """What a stage does, and where what steers it is explained."""
    text = "\n\n".join(_wrapped(paragraph, "") for paragraph in stage_text(name).split("\n\n"))
    keys = [f"  --help {section}" for section in sections() if section and section in STAGE_SECTIONS.get(name, ())]
    return "\n".join([f"stage={name}", "", text, *(["", "Its settings:", *keys] if keys else [])])


def _topic(topic: str, every_text: bool) -> str:
    if topic in PAGES:
        return PAGES[topic]()
    if topic in COMMANDS:
        return COMMANDS[topic].text
    known = [setting for settings in sections().values() for setting in settings]
    rows = [setting for setting in known if setting.key == topic or setting.key.startswith(f"{topic}.")]
    lines = [_stage(topic)] if topic in NAMES else []
    lines += (
        [f"{topic}={_wrapped(_choices(groups()[topic]), ' ' * (len(topic) + 1)).lstrip()}"] if topic in groups() else []
    )
    if not lines and not rows:
        lines = _chosen(topic) or _refuse(topic, [setting.key for setting in known])
    whole = "\n".join([*lines, *map(_setting, rows)])
    if every_text or len(rows) < 2 or whole.count("\n") < SCREEN:
        return whole
    return "\n".join([*lines, *_listed(topic, rows)])


def _listed(section: str, settings: Sequence[SettingHelp]) -> list[str]:
    """The keys of a section by the beginning of what they mean, those of sections within it by name; and what leads on.

    A section within it has one line.
    """
    rows, within = {}, {}
    for setting in settings:
        name, _, inner = setting.key.removeprefix(f"{section}.").partition(".")
        if inner:
            within.setdefault(f"{section}.{name}", []).append(inner.partition(".")[0])
        else:
            rows[setting.key] = setting.meaning
    for part, names in within.items():
        rows[f"{part}.*"] = f"{len(names)} key{'s'[: len(names) - 1]}: {', '.join(dict.fromkeys(names))}"
    width = max(map(len, rows)) + 2
    lines = [f"  {key:<{width}}{_beginning(meaning, WIDTH - 2 - width)}" for key, meaning in rows.items()]
    parts = "".join(f", --help {part}" for part in list(within)[:1])
    return [*lines, f"More: --help KEY{parts}; all: --help {section} {ALL}"]


def _beginning(meaning: str, width: int) -> str:
    """Its first clause, without the range where that finds no room."""
    first = meaning.partition(";")[0]
    return first if len(first) <= width else _shortened(re.sub(r" \([^()]*\)$", "", first), width)


def _setting(setting: SettingHelp) -> str:
    """A key with its default, as it can be typed, and below it what it means."""
    return "\n".join([f"  {setting.key}={setting.default}", _wrapped(setting.meaning, " " * 6)])


def _chosen(topic: str) -> list[str]:
    """What each choice of this name ("blend", "scene=blend") sets, and where its settings are listed."""
    named = [(group, path) for group, files in groups().items() for path in files]
    chosen = [(group, path) for group, path in named if topic in (path.stem, f"{group}={path.stem}")]
    texts = [(f"{group}={path.stem} sets", path.read_text(encoding="utf-8").strip(), group) for group, path in chosen]
    return [f"{head}\n{textwrap.indent(text, '  ')}\n  --help {group}" for head, text, group in texts]


def _refuse(topic: str, keys: Sequence[str]) -> NoReturn:
    choices = [path.stem for files in groups().values() for path in files]
    known = [*PAGES, *COMMANDS, *choices, *keys, *NAMES, *(key.partition(".")[0] for key in keys)]
    near = difflib.get_close_matches(topic, known, n=1)
    remedy = f"Did you mean {near[0]}?" if near else "rgspipe --help leads to them."
    expected = "a page, a stage, a section, a key, a group, a choice of one, or a command"
    raise InputError(f"--help {topic}", expected=expected, found="none", remedy=remedy)
