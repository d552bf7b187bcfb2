"""Operators of many views: in memory up to a budget, in a file beyond it, and the same products everywhere."""

from __future__ import annotations

import gc
import resource
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse
import torch

from painted_room import LIGHT, painted_box, painted_views
from rgspipe.errors import InputError
from rgspipe.machine.description import peak_memory_now_mib, reset_peak_memory
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.training.materials import fit_materials
from rgspipe.training.operator_store import MIB, OperatorStore, PagedOperator


def random_operator(rows: int, columns: int, seed: int, density: float = 0.05) -> SparseOperator:
    matrix = scipy.sparse.random(rows, columns, density, "csr", rng=np.random.default_rng(seed), dtype=np.float32)
    return SparseOperator.from_scipy(matrix)


def assert_same(kept: SparseOperator, operator: SparseOperator) -> None:
    for mine, yours in ((kept.matrix, operator.matrix), (kept.transposed, operator.transposed)):
        assert mine.shape == yours.shape
        for part in ("crow_indices", "col_indices", "values"):
            assert torch.equal(getattr(mine, part)(), getattr(yours, part)()), part


@pytest.mark.parametrize("density", [0.05, 0.0])
def test_paged_operators_are_the_operators_bit_by_bit(tmp_path: Path, density: float) -> None:
    operator = random_operator(70, 50, seed=0, density=density)
    other = operator.with_values(torch.rand(operator.entries, generator=torch.Generator().manual_seed(0)))
    store = OperatorStore(0.0, tmp_path)
    kept = store.keep(operator)
    assert isinstance(kept, PagedOperator)
    assert_same(kept, operator)
    beside = store.keep(kept.with_values(other.matrix.values()))
    assert isinstance(beside, PagedOperator)
    assert_same(beside, other)
    # Gradients go through the file, too.
    operand = torch.rand(50, 3, requires_grad=True)
    (kept @ operand).sum().backward()
    assert torch.equal(operand.grad, operator.transposed @ torch.ones(70, 3))


def test_the_first_operators_stay_in_memory_as_far_as_the_budget_goes(tmp_path: Path) -> None:
    operators = [random_operator(70, 50, seed) for seed in range(4)]
    parts = [
        part for m in (operators[0].matrix, operators[0].transposed) for part in (m.crow_indices(), m.col_indices())
    ]
    one = sum(part.nbytes for part in parts) + 2 * operators[0].matrix.values().nbytes
    store = OperatorStore(2.5 * one / MIB, tmp_path)
    kept = [store.keep(operator) for operator in operators]
    assert [isinstance(operator, PagedOperator) for operator in kept] == [False, False, True, True]
    assert (store.stored.memory, store.stored.file) == (2 * one, 2 * one)
    # What is dropped sooner gets what is left: half of one here, nothing there.
    lent = operators[0].with_values(torch.ones(operators[0].entries))
    half = OperatorStore(1.5 * one / MIB, tmp_path)
    half.keep(operators[0])
    assert not isinstance(half.beside().keep(lent), PagedOperator)
    assert isinstance(store.beside().keep(lent), PagedOperator)


def test_materials_do_not_depend_on_where_operators_are(tmp_path: Path) -> None:
    surfels = replace(painted_box(), albedo=torch.full((864, 3), 0.5))
    options, views = replace(LIGHT, rounds=2, at_pixels=True), painted_views()
    here = fit_materials(surfels, views, options)
    there = fit_materials(surfels, views, replace(options, memory_mib=0.0, scratch=tmp_path))
    part = fit_materials(surfels, views, replace(options, memory_mib=1.0, scratch=tmp_path))
    assert here.stored.file == 0 and there.stored.memory == 0
    assert 0 < part.stored.memory < MIB and part.stored.file > 0
    for found in (there, part):
        assert found.stored.memory + found.stored.file == here.stored.memory
        assert torch.equal(found.surfels.albedo, here.surfels.albedo)
        assert torch.equal(found.radiance, here.radiance)


def test_operators_in_the_file_take_no_lasting_memory(tmp_path: Path) -> None:
    store, size = OperatorStore(0.0, tmp_path), 8 * MIB
    kept = [store.keep(random_operator(1000, 2000, seed, size / 16 / 2e6)) for seed in range(8)]
    assert store.stored.file > 8 * size
    gc.collect()
    reset_peak_memory()
    before = peak_memory_now_mib()
    for operator in kept:
        operator.transposed @ (operator.matrix @ torch.ones(2000, 3))
    # One operator is there at a time: measured 7 of 64 MiB.
    assert peak_memory_now_mib() - before < 16.0


def test_the_file_has_no_name_that_a_killed_training_could_leave(tmp_path: Path) -> None:
    store = OperatorStore(0.0, tmp_path)
    kept = store.keep(random_operator(70, 50, seed=0))
    assert list(tmp_path.iterdir()) == []
    assert kept.entries > 0


def test_a_disk_without_room_says_what_to_do(tmp_path: Path) -> None:
    """The system refuses to let a file grow beyond 1 kB."""
    store, (soft, hard) = OperatorStore(0.0, tmp_path), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, hard))
    try:
        with pytest.raises(InputError, match=r"File too large.*TrainOptions\.memory_mib"):
            store.keep(random_operator(70, 50, seed=0))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
