"""Start Blender in a process of its own, show how far it is, and say clearly why it failed."""

from __future__ import annotations

import json
import logging
import os
import subprocess
from collections import deque
from pathlib import Path

import rgspipe
from rgspipe.blender.interpreter import Blender
from rgspipe.datasets.json_file import read_json
from rgspipe.errors import InputError
from rgspipe.progress import progress_bar
from rgspipe.store.files import remove_tree, write_json
from rgspipe.store.whole_files import WholeFiles

#: Prefix of the lines on the child's stdout that are messages; the rest is Blender's own talk.
MESSAGE_PREFIX = "@rgspipe "

#: The job is kept beside its images, so that those of another job are never mixed in.
JOB_FILE = "job.json"

#: Folder of Blender's own files while it renders, beside the images; Blender itself leaves some of them behind.
SCRATCH = ".scratch"

#: Lines of Blender's output that an error shows.
TAIL_LINES = 15

#: What Blender takes for separators of folders, and for parts that it fills in.
MEANT_OTHERWISE = "\\{}"

log = logging.getLogger(__name__)


def run_blender(blender: Blender, module: str, job: dict, name: str, folder: Path) -> None:
    """Have a child process render `job` into `folder`, and follow it.

    Args:
        blender: what renders.
        module: what it runs, with the paths of job and folder and our own process id; see `child.serve`.
        job: plain values.
        name: what the progress says is rendered.

    Raises:
        InputError: the job cannot be used, or `folder` holds the images of another one.
        RuntimeError: Blender died; the message ends with the last lines it wrote.
    """
    folder = Path(folder).resolve()
    _check_place(folder)
    folder.mkdir(parents=True, exist_ok=True)
    is_new = _claim(job, folder)
    scratch = folder / SCRATCH
    scratch.mkdir(exist_ok=True)
    command = blender.command(module, str(folder / JOB_FILE), str(folder), str(os.getpid()))
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True,
        errors="replace", env=_environment(scratch),
    ) as child:  # fmt: skip
        try:
            tail, input_error = _follow(child, name)
        except BaseException:
            child.kill()
            raise
    remove_tree(scratch)
    if input_error is not None:
        if is_new:
            (folder / JOB_FILE).unlink()
        raise InputError(input_error.pop("where"), **input_error)
    if child.returncode != 0:
        raise RuntimeError(f"Blender {_ending(child.returncode)} while rendering {folder}. Its last lines:\n{tail}")


def _check_place(folder: Path) -> None:
    """Refuse folders below which Blender would write elsewhere."""
    odd = sorted(set(MEANT_OTHERWISE) & set(str(folder)))
    if odd or not str(folder).isprintable():
        raise InputError(
            folder,
            expected="a folder by whose name Blender finds it",
            found=" and ".join(odd) or "a character that cannot be printed",
            remedy="Blender takes these for something else: give another folder.",
        )


def _claim(job: dict, folder: Path) -> bool:
    """Write the job into its folder, or see that it is the one that is there; whether it was written."""
    path = folder / JOB_FILE
    wanted, found = json.loads(json.dumps(job)), _claimed(path)
    if found is None:
        # Whatever lies there, nobody knows any more of which job it is.
        WholeFiles(folder).forget()
        write_json(path, wanted)
    elif found != wanted:
        keys = sorted(key for key in wanted.keys() | found.keys() if wanted.get(key) != found.get(key))
        raise InputError(
            path,
            expected="the job that is to be rendered",
            found=f"another one (it differs in {', '.join(keys)})",
            remedy="Choose an empty folder, or remove this one.",
        )
    return found is None


def _claimed(path: Path) -> dict | None:
    """The job that a folder belongs to; None where there is none, or its file was cut off."""
    if not path.exists():
        return None
    try:
        return read_json(path, "the job that these images belong to")
    except InputError as error:
        log.warning("%s cannot be read (%s): its images are rendered again", path, error.found)
        return None


def _environment(scratch: Path) -> dict[str, str]:
    """The child finds the package where we found it, however that was, and has its temporary files in `scratch`."""
    source = str(Path(rgspipe.__file__).resolve().parents[1])
    paths = [source, *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(paths), "TMPDIR": str(scratch)}


def _follow(child: subprocess.Popen, scene: str) -> tuple[str, dict | None]:
    """Show the child's progress until it ends; returns the last lines of its output, and an input error."""
    tail: deque[str] = deque(maxlen=TAIL_LINES)
    input_error = None
    with progress_bar([], f"rendering {scene}", unit="frame") as bar:
        for line in child.stdout:
            if not line.startswith(MESSAGE_PREFIX):
                tail.append(line.rstrip())
                continue
            message = json.loads(line[len(MESSAGE_PREFIX) :])
            input_error = message.get("input_error", input_error)
            if "remark" in message:
                print(f"warning: {message['remark']}")
            if "total" in message:
                bar.begin(message["total"], message["done"])
            if damaged := message.get("damaged"):
                log.warning("%d of the frames that lie there are not as they were written: rendered again", damaged)
            if "frame" in message:
                bar.update(1)
    return "\n".join(tail), input_error


def _ending(status: int) -> str:
    return f"was killed by signal {-status}" if status < 0 else f"ended with status {status}"
