"""The stage graph on small real stages: what is made, reused, refused, and why."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

import toys
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.errors import InputError
from rgspipe.graph.pipeline import describe_plan, plan, run
from rgspipe.graph.resolver import resolve
from rgspipe.store.artifacts import ArtifactStore
from rgspipe.store.retention import Choice, removable, remove, stored


@pytest.fixture
def config(tmp_path: Path) -> RgspipeConfig:
    return with_changes(
        RgspipeConfig(), {"stage": "harvest", "outputs": str(tmp_path / "outputs"), "dataset.resolution": 8}
    )


def planned(config: RgspipeConfig) -> list[tuple[str, bool, str]]:
    steps = plan(resolve(config, toys.load), ArtifactStore(Path(config.outputs)))
    return [(step.node.stage.name, step.reused, step.reason) for step in steps]


def test_a_stage_makes_what_it_needs_and_nothing_twice(config: RgspipeConfig) -> None:
    assert [name for name, _, _ in planned(config)] == ["sow", "grow", "grow", "harvest"]
    artifact = run(config, toys.load)
    # 0 + … + 31 = 496, once and three times.
    assert artifact.file("totals.txt").read_text() == "496\n1488\n"
    assert planned(config) == [("harvest", True, "")]
    assert run(config, toys.load).manifest == artifact.manifest
    log = Path(config.outputs) / "cornell" / "sow" / "made.log"
    assert len(log.read_text().splitlines()) == 1


def test_the_plan_says_why(config: RgspipeConfig) -> None:
    assert planned(config)[0] == ("sow", False, "not made yet")
    run(config, toys.load)
    changed = with_changes(config, {"dataset.resolution": 9})
    assert planned(changed)[0] == ("sow", False, "dataset.resolution 8 → 9")
    assert planned(changed)[-1] == ("harvest", False, "another grow")
    more = with_changes(config, {"report.views": [1, 2]})
    assert planned(more) == [
        ("grow", True, ""),
        ("sow", True, ""),
        ("grow", False, "views.count 3 → 2"),
        ("harvest", False, "another grow"),
    ]
    text = describe_plan(plan(resolve(more, toys.load), ArtifactStore(Path(config.outputs))))
    assert "reuse" in text and "make" in text and "views.count 3 → 2" in text


def test_the_plan_compares_with_what_differs_least(config: RgspipeConfig) -> None:
    """It compared with whatever ran last, and named what nobody had changed."""
    grow = with_changes(config, {"stage": "grow", "views.count": 3})
    run(grow, toys.load)
    run(with_changes(grow, {"views.count": 1, "dataset.resolution": 9}), toys.load)
    two = with_changes(grow, {"views.count": 2})
    assert planned(two)[-1] == ("grow", False, "views.count 3 → 2")
    run(with_changes(grow, {"views.count": 5}), toys.load)
    assert planned(two)[-1] == ("grow", False, "views.count 5 → 2")


def test_the_plan_says_what_it_will_take_where_that_is_known(config: RgspipeConfig) -> None:
    def text(changes: dict[str, object]) -> list[str]:
        changed = with_changes(config, changes)
        return describe_plan(plan(resolve(changed, toys.load), ArtifactStore(Path(config.outputs)))).splitlines()

    time = r"  ~[\d.]+ s"  # 0.1 s on an idle machine
    assert not any(re.search(time, line) for line in text({})) and "Expected" not in text({})[-1]
    run(with_changes(config, {"stage": "grow", "views.count": 1}), toys.load)
    assert "Expected" in text({})[-1] and "and what harvest will take" in text({})[-1]
    run(config, toys.load)
    assert "Expected" not in text({})[-1]
    sow, *grown, harvest, total = text({"dataset.resolution": 9})[1:]
    assert re.search(time + r"  dataset\.resolution 8 → 9", sow) and re.search(time + "  another grow", harvest)
    assert all(re.search(time, line) for line in grown)
    assert re.fullmatch(
        r"Expected: [\d.]+ s \(from earlier runs here; ~: with other settings, .* other scenes\)", total
    )


def test_what_the_plan_could_not_remark_yet_is_said_when_a_stage_begins(
    config: RgspipeConfig, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    stage = dataclasses.replace(
        toys.HARVEST, remarks=lambda config, made: ["always.", f"of {' '.join(made) or 'none'}."]
    )
    load = {**toys.STAGES, "harvest": stage}.__getitem__
    run(config, load)
    said = "\n".join(record.getMessage() for record in caplog.records)
    assert [said.count(remark) for remark in ("always.", "of none.", "of grow.")] == [1, 1, 1]
    caplog.clear()
    run(with_changes(config, {"report.views": [1]}), load)
    said = "\n".join(record.getMessage() for record in caplog.records)
    assert [said.count(remark) for remark in ("always.", "of none.", "of grow.")] == [1, 0, 1]


def test_a_long_remark_has_lines_of_its_own_that_fit_a_terminal(config: RgspipeConfig) -> None:
    stage = dataclasses.replace(toys.HARVEST, remarks=lambda config, made: ["a word of it " * 20])
    load = {**toys.STAGES, "harvest": stage}.__getitem__
    told = describe_plan(plan(resolve(config, load), ArtifactStore(Path(config.outputs)))).splitlines()
    remark = [line for line in told if "a word of it" in line]
    assert len(remark) > 3 and max(map(len, remark)) <= 80
    assert len({len(line) - len(line.lstrip()) for line in remark}) == 1


def test_stages_remark_on_what_is_made_already(config: RgspipeConfig) -> None:
    """Below their lines in the plan: nothing yet, then of the inputs, then of the artifact itself."""
    stage = dataclasses.replace(toys.HARVEST, remarks=lambda config, made: [f"made: {' '.join(sorted(made))}."])
    load = {**toys.STAGES, "harvest": stage}.__getitem__

    def last_lines() -> list[str]:
        store = ArtifactStore(Path(config.outputs))
        lines = [line.strip() for line in describe_plan(plan(resolve(config, load), store)).splitlines()]
        return lines[
            (begin := next(place for place, line in enumerate(lines) if line.startswith("harvest"))) : begin + 2
        ]

    assert last_lines()[0].startswith("harvest  make") and last_lines()[1] == "made: ."
    run(with_changes(config, {"stage": "grow", "views.count": 1}), load)
    assert last_lines()[1] == "made: grow."
    run(config, load)
    assert last_lines()[0].startswith("harvest  reuse") and last_lines()[1] == "made: harvest."


def test_a_link_that_was_lost_is_made_again(config: RgspipeConfig) -> None:
    artifact = run(config, toys.load)
    link = artifact.path.parent / "latest"
    link.unlink()
    run(config, toys.load)
    assert link.resolve() == artifact.path.resolve()


def test_a_link_in_the_making_that_a_kill_left_is_removed_where_no_stage_is_asked_for(config: RgspipeConfig) -> None:
    """One that could not be removed when its stage was reused; since then, only what was made from it is asked for."""
    artifact = run(config, toys.load)
    stage = artifact.path.parents[1] / "sow"
    (stage / ".latest.new").symlink_to("nowhere")
    (stage / ".latest-seed=1.new").symlink_to("nowhere")
    before = (stage / "latest").readlink()
    run(config, toys.load)
    assert not list(stage.glob(".latest*")) and (stage / "latest").readlink() == before


def test_keys_that_do_not_matter_do_not_rebuild(config: RgspipeConfig) -> None:
    run(config, toys.load)
    other = with_changes(config, {"seed": 7, "debug.traceback": True, "train.steps": 3})
    assert planned(other) == [("harvest", True, "")]


def test_another_number_of_threads_makes_another_result_where_bits_depend_on_it(
    config: RgspipeConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MKL_CBWR", raising=False)
    run(config, toys.load)
    monkeypatch.setenv("MKL_CBWR", "AVX2,STRICT")
    assert planned(config) == [("harvest", True, "")]
    monkeypatch.setenv("MKL_CBWR", "AVX2")
    threads = torch.get_num_threads()
    assert planned(config)[0] == (
        "sow",
        False,
        f"sums of any number of threads → of {threads} threads with MKL_CBWR=AVX2",
    )
    other = run(config, toys.load)
    assert planned(config) == [("harvest", True, "")]
    monkeypatch.delenv("MKL_CBWR")
    assert run(config, toys.load).fingerprint != other.fingerprint


def test_require_refuses_and_names_the_command(config: RgspipeConfig) -> None:
    strict = with_changes(config, {"upstream": "require"})
    with pytest.raises(InputError) as caught:
        run(strict, toys.load, ["stage=harvest", "upstream=require", "dataset.resolution=8"])
    message = str(caught.value)
    assert "grow" in message
    assert "`python -m rgspipe stage=grow dataset.resolution=8 views.count=3`" in message
    assert not (Path(config.outputs) / "cornell" / "sow").exists()
    run(config, toys.load)
    assert run(strict, toys.load).stage == "harvest"


def test_foreign_files_count_by_content(config: RgspipeConfig, tmp_path: Path) -> None:
    source = tmp_path / "foreign"
    source.mkdir()
    (source / "a.txt").write_text("1")
    stage = dataclasses.replace(toys.SOW, files=lambda config: [source])
    load = {**toys.STAGES, "sow": stage}.__getitem__
    before = resolve(config, load).key
    assert resolve(config, load).key == before
    run(config, load)
    (source / "a.txt").write_text("2")
    assert resolve(config, load).key != before
    steps = plan(resolve(config, load), ArtifactStore(Path(config.outputs)))
    assert steps[0].reason == f"the files in {source} changed"


@pytest.mark.parametrize("gone", [False, True])
def test_a_file_that_changes_while_a_run_reads_it_is_refused_and_nothing_is_kept_of_it(
    config: RgspipeConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, gone: bool
) -> None:
    """What was made of it had the fingerprint of what had been there before, and was reused for good."""
    source = tmp_path / "foreign.txt"
    source.write_text("1")

    load = {**toys.STAGES, "sow": dataclasses.replace(toys.SOW, files=lambda config: [source])}.__getitem__
    with monkeypatch.context() as meanwhile:
        change = (lambda: source.unlink(missing_ok=True)) if gone else (lambda: source.write_text("2"))
        meanwhile.setattr(toys.time, "sleep", lambda _: change())
        with pytest.raises(InputError, match=r"foreign\.txt: expected what it was when the run began"):
            run(config, load)
    assert not list((Path(config.outputs) / "cornell").glob("sow/.partial-*"))
    source.write_text("1")
    assert run(config, load).file("totals.txt").read_text() == "496\n1488\n"


def test_a_file_that_changes_before_a_stage_reads_it_through_its_input_is_refused(
    config: RgspipeConfig, tmp_path: Path
) -> None:
    """Photographs are read where they are: what was fitted to others had the fingerprint of those of the plan."""
    source = tmp_path / "foreign.txt"
    source.write_text("1")

    def change(*_: object) -> list[str]:
        source.write_text("2")
        return []

    sow = dataclasses.replace(toys.SOW, files=lambda config: [source])
    run(with_changes(config, {"stage": "sow"}), {**toys.STAGES, "sow": sow}.__getitem__)
    # Remarks are asked for once the plan knows what the file holds.
    load = {**toys.STAGES, "sow": sow, "grow": dataclasses.replace(toys.GROW, remarks=change)}.__getitem__
    with pytest.raises(InputError, match=r"foreign\.txt: expected what it was when the run began"):
        run(with_changes(config, {"stage": "grow"}), load)
    assert not list((Path(config.outputs) / "cornell").glob("grow/*"))


def test_a_foreign_folder_may_hold_any_name_and_what_cannot_be_read_is_named(
    config: RgspipeConfig, tmp_path: Path
) -> None:
    (tmp_path / "foreign").mkdir()
    load = {**toys.STAGES, "sow": dataclasses.replace(toys.SOW, files=lambda config: [tmp_path / "foreign"])}
    before = resolve(config, load.__getitem__).key
    Path(os.fsdecode(bytes(tmp_path / "foreign") + b"/K\xfcche.jpg")).touch()
    assert resolve(config, load.__getitem__).key != before
    # What the system refuses to read, also to root.
    (tmp_path / "foreign" / "memory").symlink_to("/proc/self/mem")
    with pytest.raises(InputError, match="foreign: expected a file to read, found Input/output error"):
        resolve(config, load.__getitem__)


@pytest.mark.parametrize(
    ("name", "damage", "word"),
    [
        ("row_03.txt", lambda path: path.write_text(""), "0 bytes"),
        ("row_03.txt", Path.unlink, "no file"),
        ("manifest.json", lambda path: path.write_text(""), "damaged JSON"),
        ("manifest.json", Path.unlink, "no file"),
        ("", lambda path: (shutil.rmtree(path), path.write_text("")), "no file"),
    ],
    ids=["emptied", "removed", "manifest emptied", "manifest removed", "a file in place of the folder"],
)
def test_what_is_damaged_is_made_again_and_that_is_said(
    config: RgspipeConfig, caplog: pytest.LogCaptureFixture, name: str, damage: Callable[[Path], object], word: str
) -> None:
    """As a power cut or a careless copy leaves it; what was made from it stays."""
    whole = run(config, toys.load)
    folder = (Path(config.outputs) / "cornell" / "sow" / "latest").resolve()
    content = (folder / "row_03.txt").read_bytes()
    damage(folder / name)
    assert planned(config) == [("harvest", True, "")]
    other = with_changes(config, {"report.views": [1, 2]})
    assert [(step, reused) for step, reused, _ in planned(other)][1] == ("sow", False)
    assert word in planned(other)[1][2]
    run(other, toys.load)
    assert (folder / "row_03.txt").read_bytes() == content
    assert any(word in record.message and "made again" in record.message for record in caplog.records)
    assert run(config, toys.load).manifest == whole.manifest
    assert not list(folder.parent.glob(".gone-*"))


def test_what_is_set_aside_loses_nothing_and_goes_with_the_next_prune(config: RgspipeConfig) -> None:
    """What somebody put there, too."""
    sow = with_changes(config, {"stage": "sow"})
    folder = run(sow, toys.load).path
    (folder / "notes.txt").write_text("mine")
    (folder / "row_03.txt").unlink()
    for number in (1, 2):
        run(sow, toys.load)
        aside = folder.with_name(f".damaged-{number}-{folder.name}")
        assert aside.is_dir()
        (folder / "row_03.txt").unlink()
    assert (folder.with_name(f".damaged-1-{folder.name}") / "notes.txt").read_text() == "mine"
    run(sow, toys.load)
    outputs = Path(config.outputs)
    gone = list(remove(outputs, removable(stored(outputs), Choice())))
    assert sorted(one.folder.name[:9] for one in gone) == [".damaged-"] * 3
    assert [path.name for path in folder.parent.glob(".damaged*")] == [] and folder.exists()


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"schema": 2}, "another schema"),
        ({"stage": "grow"}, "not its own"),
        ({"config": None}, "not its own"),
        ({"code": None}, "not its own"),
    ],
)
def test_what_another_version_made_is_neither_used_nor_touched(
    config: RgspipeConfig, change: dict[str, object], word: str
) -> None:
    sow = with_changes(config, {"stage": "sow"})
    folder = run(sow, toys.load).path
    manifest = json.loads((folder / "manifest.json").read_text()) | change
    (folder / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(InputError, match=rf"manifest\.json.*{word}"):
        run(sow, toys.load)
    run(with_changes(sow, {"dataset.resolution": 9}), toys.load)  # compares its settings with what is there
    assert json.loads((folder / "manifest.json").read_text()) == manifest


def _dangling(path: Path) -> None:
    shutil.rmtree(path) if path.is_dir() else path.unlink()
    path.symlink_to("/nowhere/at/all")


@pytest.mark.parametrize("name", ["", "row_03.txt"], ids=["of the result", "of a file in it"])
def test_a_link_that_leads_nowhere_is_told(config: RgspipeConfig, name: str) -> None:
    """As of results that were moved to a disk which is not mounted."""
    sow = with_changes(config, {"stage": "sow"})
    folder = run(sow, toys.load).path
    _dangling(folder / name)
    for _ in range(2):
        with pytest.raises(InputError, match="link that leads nowhere"):
            run(sow, toys.load)
    assert (folder / name).is_symlink()
    assert not list(folder.parent.glob(".partial-*"))


@pytest.mark.parametrize(
    ("place", "put"),
    [
        ("..", lambda path: path.symlink_to("/nowhere")),
        ("..", lambda path: path.write_text("")),
        ("../..", lambda path: path.write_text("")),
        (".partial-", lambda path: path.write_text("")),
        (".partial-", lambda path: path.symlink_to(path.parents[2])),
        (".lock-", Path.mkdir),
        (".lock-", lambda path: path.symlink_to(path.name)),
    ],
    ids=[
        "stage: dangling",
        "stage: file",
        "scene: file",
        "partial: file",
        "partial: link",
        "lock: folder",
        "lock: loop",
    ],
)
def test_what_lies_in_the_way_is_named_and_stays(
    config: RgspipeConfig, place: str, put: Callable[[Path], object]
) -> None:
    sow = with_changes(config, {"stage": "sow"})
    folder = ArtifactStore(Path(config.outputs)).path(resolve(sow, toys.load).key)
    path = {"..": folder.parent, "../..": folder.parents[1]}.get(place) or folder.with_name(place + folder.name)
    path.parent.mkdir(parents=True)
    put(path)
    for _ in range(2):
        with pytest.raises(InputError, match=re.escape(str(path))):
            run(sow, toys.load)
    assert os.path.lexists(path)
    assert not folder.exists()


def test_a_manifest_that_is_a_pipe_is_not_waited_for(config: RgspipeConfig) -> None:
    sow = with_changes(config, {"stage": "sow"})
    path = run(sow, toys.load).path / "manifest.json"
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(InputError, match="no regular file"):
        run(sow, toys.load)


def test_content_that_changed_is_refused_when_it_is_read(config: RgspipeConfig) -> None:
    """Somebody may have meant it: what is as long as it was is not thrown away."""
    run(with_changes(config, {"stage": "sow"}), toys.load)
    path = next((Path(config.outputs) / "cornell" / "sow" / "latest").resolve().glob("row_03.txt"))
    changed = path.read_text()[::-1] + "x"
    path.write_text(changed[: path.stat().st_size])
    with pytest.raises(InputError, match=r"row_03\.txt.*checksum"):
        run(config, toys.load)
    assert path.read_text() == changed[: path.stat().st_size]


def test_a_folder_in_place_of_the_link_stays(config: RgspipeConfig, caplog: pytest.LogCaptureFixture) -> None:
    latest = Path(config.outputs) / "cornell" / "harvest" / "latest"
    (latest / "mine").mkdir(parents=True)
    for _ in range(2):
        run(config, toys.load)
        assert f"{latest} stays as it is" in caplog.text
        caplog.clear()
    assert (latest / "mine").is_dir()
