"""Run as a program: prints, as JSON, what one .blend names and does not pack, or why that cannot be told.

See `blend_links`.
"""

from __future__ import annotations

import json
import logging
import os
import resource
import sys
from pathlib import Path

from blender_asset_tracer.trace import deps

#: Bytes that may be taken: damaged files claim anything. One of 500 kB takes 60 MB.
MEMORY = 2**31


def main(path: Path) -> None:
    """Print a list of [path, whether it is the first of a sequence or a pattern], or a sentence."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    # It talks of each file that is not there.
    logging.disable()
    try:
        answer = list(dict.fromkeys((str(usage.abspath), usage.is_sequence) for usage in deps(path)))
    except MemoryError:
        answer = f"it takes more than {MEMORY / 2**30:.0f} GiB"
    except Exception as error:  # whatever the library meets in a file that it does not know
        answer = " ".join(str(error).split()) or type(error).__name__
    print(json.dumps(answer), flush=True)
    os._exit(0)  # where memory ran out, closing the file would fail again


if __name__ == "__main__":
    main(Path(sys.argv[1]))
