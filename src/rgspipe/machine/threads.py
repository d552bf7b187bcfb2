"""How the numerical libraries share the processor. Applied when rgspipe is imported, before torch can be."""

from __future__ import annotations

import os
from collections.abc import MutableMapping

#: Several OpenMP pools that spin while they wait stall small kernels (84 ms instead of 24 ms for one step of
#: a fit), and numpy's own pool gains nothing on the small matrices it sees here. What is already set stays.
THREAD_DEFAULTS = {"OMP_WAIT_POLICY": "PASSIVE", "OPENBLAS_NUM_THREADS": "1", "KMP_BLOCKTIME": "0"}


def settle_threads(environment: MutableMapping[str, str] = os.environ) -> None:
    """Set the variables of THREAD_DEFAULTS that the user has not set."""
    for name, value in THREAD_DEFAULTS.items():
        environment.setdefault(name, value)
