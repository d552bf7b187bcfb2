"""How the numerical libraries share the processor, and whether results tell how many threads there were."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, MutableMapping

#: Several OpenMP pools that spin while they wait stall small kernels (84 ms instead of 24 ms for one step of
#: a fit), and numpy's own pool gains nothing on the small matrices it sees here. What is already set stays.
THREAD_DEFAULTS = {"OMP_WAIT_POLICY": "PASSIVE", "OPENBLAS_NUM_THREADS": "1", "KMP_BLOCKTIME": "0"}

#: The variable by which users say how reproducible MKL shall be, and what of it holds for any number of threads.
#: oneMKL Developer Guide, "Conditional Numerical Reproducibility"; COMPATIBLE cannot be strict.
REPRODUCIBILITY = "MKL_CBWR"
STRICT = re.compile(r"(AUTO|AVX2|AVX512\w*),STRICT", re.IGNORECASE)


def settle_threads(environment: MutableMapping[str, str] = os.environ) -> None:
    """Set the variables of THREAD_DEFAULTS that the user has not set; called before torch can be imported."""
    for name, value in THREAD_DEFAULTS.items():
        environment.setdefault(name, value)


def order_of_sums(environment: Mapping[str, str] = os.environ) -> str:
    """How many threads a result is made with, where its last bits depend on that; otherwise that they do not.

    Whoever sets MKL_CBWR has the same bits for one number of threads alone, unless it is STRICT. Without it, the sums
    that rgspipe leaves to MKL have one order, which `make bits` compares.
    """
    asked = environment.get(REPRODUCIBILITY, "").strip()
    if not asked or STRICT.fullmatch(asked):
        return "of any number of threads"
    import torch  # a plan is made without it

    return f"of {torch.get_num_threads()} threads with {REPRODUCIBILITY}={asked}"
