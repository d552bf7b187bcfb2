"""The mean of a gather operator and its reciprocal, row by row."""

from __future__ import annotations

import torch
import warp as wp
from torch import Tensor

from rgspipe.renderer.kernels.launch import as_array, launch

wp.set_module_options({"enable_backward": False})

#: Beyond every column: where a row has ended.
PAST_THE_END = wp.constant(2147483647)


@wp.func
def column_at(columns: wp.array(dtype=int), k: int, end: int):
    """The column of entry k, or PAST_THE_END from `end` on."""
    found = PAST_THE_END
    if k < end:
        found = columns[k]
    return found


@wp.kernel
def _count_union(
    offset: int,
    slab: int,
    starts: wp.array(dtype=int),
    columns: wp.array(dtype=int),
    mirrored_starts: wp.array(dtype=int),
    mirrored_columns: wp.array(dtype=int),
    counts: wp.array(dtype=int),
):
    i = wp.tid() + offset
    k = int(starts[i])
    m = int(mirrored_starts[i])
    count = int(0)
    while k < starts[i + 1] or m < mirrored_starts[i + 1]:
        one = column_at(columns, k, starts[i + 1])
        other = column_at(mirrored_columns, m, mirrored_starts[i + 1])
        if one <= other:
            k += 1
        if other <= one:
            m += 1
        count += 1
    counts[i] = count


@wp.kernel
def _mean(
    offset: int,
    slab: int,
    starts: wp.array(dtype=int),
    columns: wp.array(dtype=int),
    values: wp.array(dtype=float),
    mirrored_starts: wp.array(dtype=int),
    mirrored_columns: wp.array(dtype=int),
    mirrored_values: wp.array(dtype=float),
    areas: wp.array(dtype=float),
    packed: wp.array(dtype=int),
    mean_columns: wp.array(dtype=int),
    mean_values: wp.array(dtype=float),
):
    i = wp.tid() + offset
    k = int(starts[i])
    m = int(mirrored_starts[i])
    to = int(packed[i])
    wanted = float(0.0)
    found = float(0.0)
    while k < starts[i + 1] or m < mirrored_starts[i + 1]:
        one = column_at(columns, k, starts[i + 1])
        other = column_at(mirrored_columns, m, mirrored_starts[i + 1])
        value = float(0.0)
        if one <= other:
            value += 0.5 * values[k]
            wanted += values[k]
            k += 1
        if other <= one:
            value += 0.5 * mirrored_values[m] * (areas[other] / areas[i])
            m += 1
        mean_columns[to] = wp.min(one, other)
        mean_values[to] = value
        found += value
        to += 1
    gain = wanted / wp.max(found, 1.0e-12)
    to = int(packed[i])
    while to < packed[i + 1]:
        mean_values[to] = mean_values[to] * gain
        to += 1


Rows = tuple[Tensor, Tensor, Tensor]


def reciprocal_rows(rows: Rows, mirrored: Rows, areas: Tensor) -> Rows:
    """½(F + A⁻¹FᵀA), every row scaled to the sum of F's.

    Args:
        rows, mirrored: F and Fᵀ (N, N), each as starts (N + 1) int32, columns int32 in ascending order within a
            row, and values float32.
        areas: (N,) float32 A, above 0.
    """
    count, device = len(areas), areas.device
    one, other = ([as_array(part) for part in parts] for parts in (rows, mirrored))
    counts = torch.empty(count, dtype=torch.int32, device=device)
    launch(_count_union, count, [*one[:2], *other[:2], as_array(counts)], device)
    starts = torch.nn.functional.pad(counts.cumsum(0, dtype=torch.int32), (1, 0))
    columns = torch.empty(int(starts[-1]), dtype=torch.int32, device=device)
    values = torch.empty(len(columns), dtype=torch.float32, device=device)
    outputs = [as_array(part) for part in (starts, columns, values)]
    launch(_mean, count, [*one, *other, as_array(areas), *outputs], device)
    return starts, columns, values
