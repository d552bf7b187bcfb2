"""What all kinds of studies share."""

from __future__ import annotations

import pytest

from rgspipe.cli.compose import compose_config
from rgspipe.config import RgspipeConfig, with_changes
from rgspipe.config.studies import UNUSED
from rgspipe.errors import InputError
from rgspipe.stages.studies import study

#: For settings that a kind may have no use for, values that are not theirs by default.
OTHERS = {
    "cases": ["clean", "seed=1"],
    "scenes": ["corner"],
    "views": [1, 3],
    "methods": ["paper_adam"],
    "paper_adam_limit": None,
    "paper_adam_views": [1],
    "zoo": {"seeds": [7]},
    "lightings": 5,
}


def _config(kind: str, **changes: object) -> RgspipeConfig:
    return with_changes(RgspipeConfig(), {"study.kind": kind} | {f"study.{key}": one for key, one in changes.items()})


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, names in UNUSED.items() for name in names])
def test_a_setting_that_would_do_nothing_is_refused(kind: str, name: str) -> None:
    with pytest.raises(InputError, match=rf"study\.{name}.*study\.kind={kind}.*limit") as caught:
        _config(kind, **{name: OTHERS[name]})
    used = caught.value.expected.partition("which uses ")[2].split(", ")
    assert "limit" in used and not set(used) & set(UNUSED[kind])


# Lamps that are unknown in a capture are found with it, not by fits of targets.
@pytest.mark.parametrize("kind", [kind for kind in study.KINDS if kind != "lamps"])
def test_every_kind_takes_few_targets_where_the_study_or_the_fit_says_so(kind: str) -> None:
    def limits(config: RgspipeConfig) -> set[object]:
        fits = [need for need in study.STAGE.needs(config) if need.stage in ("fit_light", "evaluate")]
        assert fits
        return {need.changes.get("fit.limit", config.fit.limit) for need in fits}

    assert limits(_config(kind)) == {None}
    assert limits(_config(kind, limit=3)) == {3}
    assert limits(with_changes(_config(kind, limit=3), {"fit.limit": 2})) == {2}


@pytest.mark.parametrize(("name", "kind", "limit"), [("robustness", "captures", 6), ("courses", "courses", 1)])
def test_what_is_prepared_takes_few_targets(name: str, kind: str, limit: int) -> None:
    config = compose_config(["stage=study", f"experiment={name}"])
    assert (config.study.kind, config.study.limit) == (kind, limit) and study.STAGE.needs(config)


def test_a_study_depends_on_what_its_kind_reads() -> None:
    assert study.STAGE.keys(_config("captures")) == ("study",)
    assert study.STAGE.keys(_config("classes")) == ("study", "seed")
    assert {"study", "evaluate.success", "fit.truth", "light.type"} <= set(study.STAGE.keys(_config("courses")))
