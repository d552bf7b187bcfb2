"""What tests cost: time of processors, which other programs on the machine change little.

OMP_NUM_THREADS=1 python -m pytest --cpu 20 tests/capture      # names the 20 files and tests that took most of it

Without that word numpy, which a plugin imports before tests/conftest.py says it, has as many threads as cores, which
wait for each other at work: a product and an inverse of 100 × 100 take 3.3 ms, and 0.3 with one, as workers have.
"""

from __future__ import annotations

import contextlib
import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

#: Where costs are kept until the end, by test.
COSTS = pytest.StashKey[Counter[str]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    text = "name the N files and tests that took most time of processors, what they started included"
    parser.addoption("--cpu", type=int, metavar="N", help=text)


def pytest_configure(config: pytest.Config) -> None:
    config.stash[COSTS] = Counter()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """What is made for several tests is counted with the first of them."""
    before = _spent()
    result = yield
    item.config.stash[COSTS][item.nodeid] += _spent() - before
    return result


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    count, tests = config.getoption("--cpu"), config.stash[COSTS]
    if not count:
        return
    files: Counter[str] = Counter()
    for name, seconds in tests.items():
        files[name.partition("::")[0]] += seconds
    for what, costs in (("file", files), ("test", tests)):
        terminalreporter.section(f"CPU seconds a {what}: {sum(costs.values()):.0f} in all")
        for name, seconds in costs.most_common(count):
            terminalreporter.line(f"{seconds:8.2f}  {name}")


def _spent() -> float:
    """CPU seconds of this process, of its children that have ended, and of those that run, with all below them."""
    own = os.times()
    return sum(own[:4]) + sum(_below(os.getpid())) / os.sysconf("SC_CLK_TCK")


def _below(process: int) -> Iterator[int]:
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # it has ended just now
        for task in Path(f"/proc/{process}/task").glob("*/children"):
            for child in map(int, task.read_text().split()):
                # A name in parentheses comes before them, and may hold blanks.
                fields = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
                yield sum(map(int, fields[11:15]))
                yield from _below(child)
