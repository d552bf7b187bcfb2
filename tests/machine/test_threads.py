"""Whether results tell how many threads there were, which becomes a part of their recipe."""

from __future__ import annotations

import pytest
import torch

from rgspipe.machine.threads import order_of_sums


@pytest.mark.parametrize("asked", ["", "AUTO,STRICT", "AVX2,STRICT", "avx512,strict"])
def test_threads_do_not_count_where_the_order_of_sums_is_one(asked: str) -> None:
    assert order_of_sums({"MKL_CBWR": asked}) == order_of_sums({}) == "of any number of threads"


@pytest.mark.parametrize("asked", ["AVX2", "COMPATIBLE", "COMPATIBLE,STRICT", "AUTO"])
def test_threads_count_where_mkl_promises_bits_for_one_number_of_them(asked: str) -> None:
    before = torch.get_num_threads()
    said = set()
    for threads in (1, 2):
        torch.set_num_threads(threads)
        said.add(order_of_sums({"MKL_CBWR": asked}))
    torch.set_num_threads(before)
    assert said == {f"of {threads} threads with MKL_CBWR={asked}" for threads in (1, 2)}
