"""Run as a program: prints, as JSON, what one .blend names and does not pack, and why not all of that can be told.

See `blend_links`. Blocks of data are asked one by one, so that one that the tracer does not understand hides no other.
"""

from __future__ import annotations

import json
import logging
import os
import resource
import sys
from collections.abc import Iterator
from pathlib import Path

from blender_asset_tracer.blendfile import BlendFile, BlendFileBlock
from blender_asset_tracer.blendfile.exceptions import SegmentationFault
from blender_asset_tracer.bpathlib import BlendPath
from blender_asset_tracer.cdefs import eModifierType_Nodes
from blender_asset_tracer.trace import asset_holding_blocks
from blender_asset_tracer.trace.blocks2assets import iter_assets
from blender_asset_tracer.trace.modifier_walkers import modifier_handlers

#: Bytes of memory, and of a copy without compression, that may be taken: damaged files claim anything. One of 500 kB
#: takes 20 MB.
MEMORY, COPY = 2**31, 2**32

#: Structures of nodes that name a file outside, where their mode is `OUTSIDE`: measured lamps and scripts.
NODES, OUTSIDE = ("NodeShaderTexIES", "NodeShaderScript"), 1

#: The value of a node's text that is the path of a file where its subtype is `IS_PATH`, as of nodes that import meshes.
TEXT, IS_PATH = "bNodeSocketValueString", 1


def main(path: Path) -> None:
    """Print [[path, whether it is the first of a sequence or a pattern], …] and a sentence that may be empty."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (COPY, COPY))
    # It talks of each file that is not there.
    logging.disable()
    modifier_handlers[eModifierType_Nodes] = _baked(modifier_handlers[eModifierType_Nodes])
    names: dict[tuple[str, bool], None] = {}
    why = ""
    try:
        for block in BlendFile(path).blocks:
            try:
                names.update(dict.fromkeys(_named(block)))
            except MemoryError:
                raise
            except Exception as error:  # whatever the library meets in what it does not know
                why = why or _words(error)
    except MemoryError:
        why = f"it takes more than {MEMORY / 2**30:.0f} GiB"
    except Exception as error:
        why = _words(error)
    print(json.dumps([list(names), why]), flush=True)
    os._exit(0)  # where memory ran out, closing the file would fail again


def _named(block: BlendFileBlock) -> Iterator[tuple[str, bool]]:
    if block.dna_type_name in NODES and block.get(b"mode") == OUTSIDE:
        yield from _path(block, block.get(b"filepath"))
    elif block.dna_type_name == TEXT and block.get(b"subtype") == IS_PATH:
        yield from _path(block, block.get(b"value"))
    for holding in asset_holding_blocks([block]):
        yield from ((str(usage.abspath), usage.is_sequence) for usage in iter_assets(holding))


def _path(block: BlendFileBlock, path: bytes) -> Iterator[tuple[str, bool]]:
    if path:
        yield str(block.bfile.abspath(BlendPath(path)).to_path()), False


def _baked(handler):
    """What baked geometry nodes name; of those that were not baked, the pointer leads nowhere, which is no damage."""

    def named(*context):
        try:
            yield from handler(*context)
        except SegmentationFault:
            return

    return named


def _words(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


if __name__ == "__main__":
    main(Path(sys.argv[1]))
