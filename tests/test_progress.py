"""Progress: quiet when short, whole lines in a log, and an estimate that counts what follows."""

from __future__ import annotations

import re

import pytest

from rgspipe import progress


class Clock:
    """Time that passes when it is told to."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def tracked(monkeypatch: pytest.MonkeyPatch, items: range, seconds: float, **options: object) -> None:
    """Track items that take `seconds` each."""
    clock = Clock()
    monkeypatch.setattr("tqdm.std.time", clock)
    bar = progress.progress_bar(items, "steps", unit="step", **options)
    for _ in bar:
        clock.now += seconds
        bar.set_postfix_str("loss 0.1", refresh=False)


def test_a_log_gets_a_whole_line_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tracked(monkeypatch, range(25), seconds=2.0)
    text = capsys.readouterr().err
    lines = text.splitlines()
    assert 4 <= len(lines) <= 5 and "\r" not in text
    assert re.search(r"steps: +\d+%.* \d+/25 \[.*, loss 0\.1\]$", lines[-1])


def test_short_work_shows_nothing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    tracked(monkeypatch, range(25), seconds=0.05)
    assert capsys.readouterr().err == ""


def test_the_estimate_counts_later_items_and_what_follows(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Items 10 to 29 of 40, at 2 s each, then 100 s of something else."""
    tracked(monkeypatch, range(10, 30), seconds=2.0, total=40, done=10, after=100.0)
    lines = capsys.readouterr().err.splitlines()
    for line in lines:
        count, minutes, seconds = map(int, re.search(r" (\d+)/40 \[.*, (\d+):(\d+) left, loss", line).groups())
        assert 60 * minutes + seconds == 2 * (40 - count) + 100
    assert len(lines) == 4


def test_what_was_done_before_tells_nothing_of_the_pace(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Work that is taken up at item 48 of 160, which is known only after 5 s; 12 s an item."""
    clock = Clock()
    monkeypatch.setattr("tqdm.std.time", clock)
    with progress.progress_bar([], "frames", unit="frame") as bar:
        clock.now += 5.0
        bar.begin(total=160, done=48)
        for _ in range(3):
            clock.now += 12.0
            bar.update(1)
    lines = capsys.readouterr().err.splitlines()
    for line in lines[1:]:
        count, minutes, seconds = map(int, re.search(r" (\d+)/160 \[\d+:\d+<(\d+):(\d+),", line).groups())
        assert abs(60 * minutes + seconds - 12 * (160 - count)) <= 1
    assert count == 51 and len(lines) == 4


def test_progress_is_told_to_a_listener_instead(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    told: list[str] = []
    with progress.progress_told(told.append):
        tracked(monkeypatch, range(10), seconds=3.0)
    assert told.pop() == "" and len(told) == 10
    for done, words in enumerate(told, start=1):
        percent, left = map(int, re.fullmatch(r"steps: (\d+) %, 00:(\d+) left", words).groups())
        # Seconds are cut off: measured 1 less, of 2.9999.
        assert percent == 10 * done and 0 <= 3 * (10 - done) - left <= 1
    assert capsys.readouterr().err == ""
    tracked(monkeypatch, range(10), seconds=3.0)
    assert len(told) == 10 and "steps" in capsys.readouterr().err


def test_a_listener_hears_nothing_of_short_work_but_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    with progress.progress_told(told.append):
        tracked(monkeypatch, range(25), seconds=0.05)
    assert told == [""]


def test_a_whole_that_may_be_one_of_many_has_a_line_only_where_it_takes_long(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tracked(monkeypatch, range(8), seconds=1.0, whole=True)
    assert capsys.readouterr().err == ""
    tracked(monkeypatch, range(8), seconds=4.0, whole=True)
    first, *_, last = capsys.readouterr().err.splitlines()
    assert re.search(r"steps: +\d+%\|.*\| \[00:12, 00:20 left\]", first) and "/8" not in last


def test_a_listener_hears_at_once_of_what_goes_on_after_long_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second part of work that has lasted for longer than nothing is said: no silence in between."""
    told: list[str] = []
    clock = Clock()
    monkeypatch.setattr("rgspipe.progress.time.monotonic", clock)
    with progress.progress_told(told.append):
        clock.now += 3.0
        with progress.progress_bar([], "lights", total=4):
            assert told == ["lights"]
    assert told == ["lights", ""]


def test_jobs_side_by_side_are_told_by_their_names(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In whole lines even on a terminal, where they would write over each other's."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with progress.progress_of_job("views.count=3"):
        tracked(monkeypatch, range(25), seconds=2.0)
    text = capsys.readouterr().err
    assert "\r" not in text and all(line.startswith("views.count=3: steps: ") for line in text.splitlines())
    with progress.progress_of_job(""):
        tracked(monkeypatch, range(25), seconds=2.0)
    assert re.match(r"\rsteps: ", capsys.readouterr().err)
