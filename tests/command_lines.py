"""Command lines that nobody tuned, and environments: what each must do is done, or refused with the key and a remedy.

    python tests/command_lines.py [COMPOSED [PROCESSES [SEED]]]        (make fuzz-commands)

composes so many in this process and starts so many processes with toy stages. Exit status 1 if anything fell.
"""

from __future__ import annotations

import dataclasses
import math
import os
import random
import re
import subprocess
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial

from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig
from rgspipe.config.core import plain
from rgspipe.errors import InputError
from rgspipe.machine.resources import resource_folder
from rgspipe.stages import NAMES

#: Values for any key.
STRANGE = (
    *("", "null", "true", "-1", "0", "1", "0.5", "1e400", "-1e308", "nan", "inf", "9" * 400, "x", "é", "'a b'"),
    *("[]", "[1,2]", "[[1]]", "{}", "{a:1}", "[1", "${seed}", "${nothing}", "${oc.env:HOME}", "${", "a/../b", "???"),
    *("x" * 5000, "1,2", "range(1,3)", "\0", "--", "=", "1=2", "\n", "0x10", "/dev/null"),
)

#: What a shell may have set, for processes.
ENVIRONMENTS: tuple[Mapping[str, str], ...] = (
    *({}, {"OMP_NUM_THREADS": "x"}, {"OMP_NUM_THREADS": "0"}, {"OMP_WAIT_POLICY": "x"}, {"COLUMNS": "0"}),
    *(
        {"COLUMNS": "x"},
        {"COLUMNS": "-9"},
        {"TERM": ""},
        {"LC_ALL": "C"},
        {"LANG": "xx"},
        {"PYTHONIOENCODING": "ascii"},
    ),
    *({"TMPDIR": "/nowhere"}, {"HOME": "/nowhere"}, {"HOME": ""}, {"HYDRA_FULL_ERROR": "x"}, {"TZ": "x"}),
    *(
        {"PYTHONUTF8": "0", "LC_ALL": "POSIX"},
        {"RGSPIPE_TRACEBACK": ""},
        {"NO_COLOR": "1"},
        {"USER": "", "LOGNAME": ""},
    ),
)

#: Seconds of a process; measured: 3.
LONGEST = 60


@cache
def known() -> tuple[str, ...]:
    """Every key of a setting, every section and every group."""
    groups = [path.name for path in resource_folder("conf").iterdir() if path.is_dir()]
    return (*_keys(plain(RgspipeConfig())), *groups)


def _value(key: str) -> object:
    """What a setting is by default; a group has no value."""
    value = plain(RgspipeConfig())
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    return {None: "null", True: "true", False: "false"}.get(value, value) if not isinstance(value, dict | list) else "x"


def _keys(values: Mapping, prefix: str = "") -> list[str]:
    found = []
    for key, value in values.items():
        found += [f"{prefix}{key}", *(_keys(value, f"{prefix}{key}.") if isinstance(value, Mapping) else ())]
    return found


def command_line(random_: random.Random) -> list[str]:
    """A stage that exists, and one to three further words, most of them with something wrong."""
    words = [_word(random_) for _ in range(random_.randint(1, 3))]
    return [f"stage={random_.choice(NAMES)}", *words] if random_.random() < 0.9 else words


def _word(random_: random.Random) -> str:
    key, value = random_.choice(known()), random_.choice(STRANGE)
    kind = random_.random()
    if kind < 0.2:  # a slip of the finger
        place = random_.randrange(len(key))
        key = key[:place] + random_.choice(["", "x", ".", key[place] * 2]) + key[place + 1 :]
    elif kind < 0.3:
        key = random_.choice("+~") * random_.randint(1, 2) + key
    elif kind < 0.35:
        return random_.choice([key, value, f"{key}:{value}", f"{key}=={value}", f"{key}@{value}={value}"])
    elif kind < 0.55:  # what is there anyway, where it is a plain value
        value = str(_value(key))
    elif kind < 0.75:
        value = str(random_.choice([random_.randint(-5, 5), random_.uniform(-2, 2), 10.0 ** random_.randint(-40, 40)]))
    return f"{key}={value}"


def composed(seed: int, index: int) -> tuple[str, str]:
    """done, refused or fell, and the story of what fell."""
    words = command_line(random.Random(f"command line {seed} {index}"))
    try:
        config = compose_config(words)
    except InputError as error:
        return ("refused", "") if _helps(error, words) else ("fell", f"{words}\nneither key nor remedy: {error}")
    except BaseException:  # whatever else happens is what is looked for
        return "fell", f"{words}\n{traceback.format_exc()}"
    odd = [value for value in _floats(dataclasses.asdict(config)) if math.isnan(value)]
    return ("fell", f"{words}\nNaN was let through") if odd else ("done", "")


def _helps(error: InputError, words: Sequence[str]) -> bool:
    """Whether an error is one paragraph with a remedy that names something of the command line, or what is missing."""
    text = str(error)
    names = {part for word in words for part in re.split("[.@:]", word.lstrip("+~").partition("=")[0])}
    names |= {"stage", *map(repr, words)}
    return bool(error.remedy) and "\n" not in text and any(name and name in text for name in names)


def _floats(value: object) -> list[float]:
    if isinstance(value, Mapping):
        return [number for part in value.values() for number in _floats(part)]
    if isinstance(value, list | tuple):
        return [number for part in value for number in _floats(part)]
    return [value] if isinstance(value, float) else []


def process(seed: int, index: int) -> tuple[str, str]:
    """As `composed`, of a process of toy stages in some environment."""
    random_ = random.Random(f"process {seed} {index}")
    stage, extra = random_.choice(["sow", "grow"]), random_.choice(ENVIRONMENTS)
    words = [f"stage={stage}", "dataset.resolution=8", *([_word(random_)] if random_.random() < 0.7 else [])]
    # Whatever a word says is done in a folder of its own.
    with tempfile.TemporaryDirectory() as place:
        command = [sys.executable, "-m", "toys", *(word.replace("\0", "\\0") for word in words)]
        try:
            environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **extra}
            ended = subprocess.run(
                command, cwd=place, env=environment, capture_output=True, timeout=LONGEST, stdin=subprocess.DEVNULL
            )
        except subprocess.TimeoutExpired:
            return "fell", f"{words} {extra}\nlonger than {LONGEST} s"
    told = ended.stderr.decode(errors="replace")
    if ended.returncode == 0 and "Traceback" not in told:
        return "done", ""
    # Options that Hydra does not have are refused by argparse, with a small e.
    if ended.returncode == 2 and "Traceback" not in told and "rror:" in told:
        return "refused", ""
    return "fell", f"{words} {extra}\nexit status {ended.returncode}\n{told[-2000:]}"


def main(count: int, processes: int, seed: int) -> int:
    """Compose and start so many; the exit status."""
    counts: dict[str, Counter[str]] = {}
    with ProcessPoolExecutor() as pool:
        for name, number, one in (("composed", count, composed), ("processes", processes, process)):
            counts[name] = Counter()
            for outcome, story in pool.map(partial(one, seed), range(number), chunksize=4):
                counts[name][outcome] += 1
                print(story, flush=True) if story else None
    for name, found in counts.items():
        print(f"{name:12}{found.total():6}: {found['done']} done, {found['refused']} refused, {found['fell']} fell")
    return 1 if any(found["fell"] for found in counts.values()) else 0


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:]]
    sys.exit(main(*(given + [2000, 40, 0][len(given) :])))
