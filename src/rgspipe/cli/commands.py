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
        summary: what it does, in a line.
        usage: how it is written, and below that what can be said.
        words: what may follow its name, as far as a shell can complete it.
    """

    module: str
    function: str
    summary: str
    usage: str
    words: tuple[str, ...]

    @property
    def text(self) -> str:
        """What `--help` says of it."""
        written, _, rest = self.usage.partition("\n\n")
        return f"{written}\n\n{self.summary}\n{rest}".rstrip()

    def load(self) -> Callable[[Sequence[str]], int]:
        """The function that runs it, which takes the words after its name and gives the exit status."""
        return getattr(import_module(f"rgspipe.cli.{self.module}"), self.function)


_PAGE_WORDS = ("port=", "resolution=", "address=", "browser=false", "device=")

_PAGE = """\
  port        of the page
  resolution  pixels along the longer side of pictures at rest
  address     of this machine to listen at, if others are to look; then with a
              token
  browser     false does not open the page in the browser, which is done where
              a terminal and a screen are
  device      where pictures are made: auto (a CUDA GPU where there is one), cpu
              or cuda"""

COMMANDS = {
    "demo": Command(
        "view",
        "demo",
        "A small room in the browser: drag its lamp, see a hidden one found.",
        f"""\
rgspipe demo [port=8080] [resolution=256] [address=127.0.0.1]
             [browser=false] [device=auto]

{_PAGE}""",
        _PAGE_WORDS,
    ),
    "view": Command(
        "view",
        "view_folder",
        "A frozen scene in the browser, where lamps are moved and found.",
        f"""\
rgspipe view FOLDER [lights=FILE] [target=DIR] [fit=DIR]
             [port=8080] [resolution=256] [address=127.0.0.1]
             [browser=false] [device=auto]

  FOLDER      outputs/<scene>/freeze/latest, for example
  lights      light file: the lamps at first
  target      folder with photographs of the scene under lamps that are to be
              found
  fit         folder of a target's fit (with lights.json), whose lamps are shown
              with their regions; or of a track (with frames/)
{_PAGE}
stage=view shows the configured scene with its photographs and fits instead.""",
        ("lights=", "target=", "fit=", *_PAGE_WORDS),
    ),
    "status": Command(
        "runs",
        "show_runs",
        "How the runs so far ended, and why those that failed did.",
        f"""\
rgspipe status [RUN] [state=STATE] [KEY=VALUE …] [outputs=DIR]

  RUN        the name of a run: all that is known of it
  state      one of {", ".join(STATES)}
  KEY=VALUE  those that were started with this, such as stage=fit_light""",
        ("outputs=", "stage=", *(f"state={state}" for state in STATES)),
    ),
    "outputs": Command(
        "outputs",
        "show_outputs",
        "What results take on the disk; removes what nothing needs any more.",
        """\
rgspipe outputs [prune] [scene=NAME] [stage=NAME] [older=30d] [remove=true]
                [outputs=DIR]

  prune         list what nothing needs any more; with scene, stage or older all
                that matches, the latest results, too; remove=true removes it
  scene, stage  of these alone; results of a stage that is named are listed one
                by one
  older         at least so old: 12h, 30d, 4w""",
        ("list", "prune", "outputs=", "scene=", "stage=", "older=", "remove=true"),
    ),
    "doctor": Command(
        "doctor",
        "doctor",
        "Whether all that is needed is here, and how accurate and fast it is.",
        """\
rgspipe doctor [check=false] [outputs=DIR]
               [blender.executable=PATH] [blender.python=PATH]

  check       false leaves the measurements out, which take half a minute
  blender.…   the Blender that is to render, which is tried""",
        ("outputs=", "check=false", "blender.executable=", "blender.python="),
    ),
    "verify": Command(
        "verify",
        "verify",
        "Reads every result, and says which were damaged since then.",
        """\
rgspipe verify [outputs=DIR]""",
        ("outputs=",),
    ),
}
