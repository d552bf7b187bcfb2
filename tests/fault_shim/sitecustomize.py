"""Has every Python process that a run starts suffer the same faults as the run itself; see `faults`."""

from __future__ import annotations

import os

if "FAULT" in os.environ:
    import faults

    faults.install(faults.Fault.of(os.environ))
