"""Commands beside stages: where each lives, and what `--help` says of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import NamedTuple

from rgspipe.store.status import STATES


class Command(NamedTuple):
    """A command; its module is imported only where it is asked for.

    Attributes:
        module: in rgspipe.cli.
        function: takes the arguments after the name, and returns the exit status.
        text: how it is written, and what can be said.
    """

    module: str
    function: str
    text: str

    def load(self) -> Callable[[Sequence[str]], int]:
        return getattr(import_module(f"rgspipe.cli.{self.module}"), self.function)


COMMANDS = {
    "demo": Command(
        "view",
        "demo",
        """\
rgspipe demo [port=8080] [resolution=256] [address=127.0.0.1]

A small room in the browser that comes with the package: drag its lamp, and see a hidden one found.
  port        of the page
  resolution  pixels along the longer side of pictures at rest
  address     of this machine to listen at, if others are to look; then with a token""",
    ),
    "view": Command(
        "view",
        "view_folder",
        """\
rgspipe view FOLDER [lights=FILE] [target=DIR] [fit=DIR] [port=8080] [resolution=256] [address=127.0.0.1]

A frozen scene in the browser, where lamps are moved and found; outputs/<scene>/freeze/latest is one.
  lights      light file: the lamps at first
  target      folder with photographs of the scene under lamps that are to be found
  fit         folder of a target's fit (with lights.json), whose lamps are shown with their regions
  port        of the page
  resolution  pixels along the longer side of pictures at rest
  address     of this machine to listen at, if others are to look; then with a token
stage=view shows the configured scene with its photographs and fits instead.""",
    ),
    "status": Command(
        "runs",
        "show_runs",
        f"""\
rgspipe status [RUN] [state=STATE] [KEY=VALUE …] [outputs=DIR]

How the runs so far ended, and why those that failed did.
  RUN        the name of a run: all that is known of it
  state      one of {", ".join(STATES)}
  KEY=VALUE  those that were started with this, such as stage=fit_light""",
    ),
    "outputs": Command(
        "outputs",
        "show_outputs",
        """\
rgspipe outputs [prune] [scene=NAME] [stage=NAME] [older=30d] [remove=true] [outputs=DIR]

What the results take on the disk. With prune: what nothing needs any more, removed where remove=true is said.
  scene, stage  of these alone; results of a stage that is named are listed one by one
  older         at least so old: 12h, 30d, 4w""",
    ),
    "doctor": Command(
        "doctor",
        "doctor",
        """\
rgspipe doctor [check=false] [outputs=DIR] [blender.executable=PATH] [blender.python=PATH]

Whether all that is needed is here and works, what more there could be, how accurate and fast it is.
  check       false leaves the measurements out, which take half a minute
  blender.…   the Blender that is to render, which is tried""",
    ),
    "verify": Command(
        "verify",
        "verify",
        """\
rgspipe verify [outputs=DIR]

Reads every result and says which were damaged since they were made.""",
    ),
}
