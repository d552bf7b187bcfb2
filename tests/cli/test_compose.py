"""What it takes to begin: how often the configuration is composed, and what is copied for it."""

from __future__ import annotations

import copy
from pathlib import Path

import pytest
from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra.core.config_store import ConfigStore

from rgspipe.cli import main
from rgspipe.cli.compose import compose_config, register_schema


def test_what_is_registered_is_not_copied_and_no_composition_changes_it() -> None:
    register_schema()
    store = ConfigStore.instance()
    assert copy.deepcopy(store) is store
    first, other, again = (compose_config(["stage=freeze", f"seed={seed}"]) for seed in (0, 7, 0))
    assert first == again and other.seed == 7


def test_a_run_composes_to_check_and_to_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And not to ask for a mode that nobody can set."""
    monkeypatch.chdir(tmp_path)
    composed, load = [], ConfigLoaderImpl.load_configuration
    monkeypatch.setattr(
        ConfigLoaderImpl, "load_configuration", lambda *given, **named: composed.append(named) or load(*given, **named)
    )
    assert main(["stage=overview"]) == 0
    assert len(composed) == 2
