"""Reads and writes OpenEXR files for a Blender that cannot: see `exr_files`, which runs this as a program."""

import json
import sys
from pathlib import Path

import numpy as np

from rgspipe.datasets.exr import read_channels, write_channels

for line in sys.stdin:
    task, path, arrays = json.loads(line)
    try:
        if task == "read":
            np.savez(arrays, **read_channels(Path(path)))
        else:
            write_channels(Path(path), dict(np.load(arrays)))
        print("done", flush=True)
    except Exception as error:  # told on the other side
        print(f"{type(error).__name__}: {error}".replace("\n", " "), flush=True)
