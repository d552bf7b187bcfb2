"""What the library says, for who types commands: it names options as Python has them, here they are keys.

    CaptureOptions.exposure → lamps.exposure
    CaptureOptions(exposure='free') → lamps.exposure=free

Classes are those of the groups and what they inherit, so that an option of the library has its key wherever a group
takes it over.
"""

from __future__ import annotations

import contextlib
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache

from rgspipe.config.core import describe
from rgspipe.config.root import RgspipeConfig
from rgspipe.errors import InputError
from rgspipe.options import Options, settings

#: Groups whose keys are attributes of classes in Python that are no options of a group.
OTHERS = {"LightSpec": "light", "RigRequest": "targets", "Search": "fit.search"}

#: What is a call or an argument in Python and a key here.
CALLS = {
    "FrozenScene.freeze(gather_rays=…)": "freeze.gather_rays",
    "initialise_surfels(normals='estimate')": "init.normals=estimate",
    "initialise_surfels(normals='pass')": "init.normals=pass",
    "prior_from_maps(views)": "train.albedo_prior=dataset",
    "read_mesh(FILE)": "scene=mesh scene.path=FILE",
    "render_dataset(job)": "scene=cornell, scene=blend",
    "rg.capture_scene(views)": "scene.lamps=unknown",
    "rg.load_views(folder)": "scene=external",
    "rg.train(prior=None)": "train.albedo_prior=none",
    "rg.train(views)": "scene.lamps=known",
    "surfels=…": "init.surfels",
}

#: How values are written on the command line.
VALUES = {"None": "null", "True": "true", "False": "false"}


def as_keys(text: str) -> str:
    """A text of the library with options as keys."""
    for call, keys in CALLS.items():
        text = text.replace(call, keys)
    return _pattern().sub(_key, text)


@contextlib.contextmanager
def told_with_keys() -> Iterator[None]:
    """Have errors of the block name options as keys.

    Raises:
        InputError: the block's.
    """
    try:
        yield
    except InputError as error:
        raise error.reworded(as_keys).with_traceback(error.__traceback__) from error.__cause__


def _key(found: re.Match[str]) -> str:
    owner, name, value, path = found.groups()
    key = f"{_groups()[owner]}.{name or path}"
    if key not in _keys():
        return found[0]
    return key if value is None else f"{key}={_value(value)}"


def _value(text: str) -> str:
    return VALUES.get(text, text.strip("'\"").replace(", ", ","))


@cache
def _keys() -> frozenset[str]:
    return frozenset(key for key, _, _ in describe(RgspipeConfig()))


@cache
def _pattern() -> re.Pattern[str]:
    return re.compile(rf"\b({'|'.join(_groups())})(?:\((\w+)=([^()]*)\)|\.(\w+(?:\.\w+)*))")


@cache
def _groups() -> dict[str, str]:
    """The group of each class by name; without those that several groups have."""
    found = defaultdict[str, set[str]](set)
    for group, options in _sections(RgspipeConfig):
        for owner in options.__mro__[: options.__mro__.index(Options)]:
            found[owner.__name__].add(group)
    return {name: group for name, (group, *others) in found.items() if not others} | OTHERS


def _sections(options: type[Options], group: str = "") -> Iterator[tuple[str, type[Options]]]:
    for setting in settings(options):
        if setting.section is not None:
            key = f"{group}.{setting.name}" if group else setting.name
            yield key, setting.section
            yield from _sections(setting.section, key)
