"""Every kernel compiles for CUDA from the source that runs on the CPU; no GPU is needed to see that."""

from __future__ import annotations

import importlib
import pkgutil
import sys
from pathlib import Path

import pytest
import warp as wp

from rgspipe.renderer import kernels

NAMES = [f"{kernels.__name__}.{module.name}" for module in pkgutil.iter_modules(kernels.__path__)]


@pytest.mark.skipif(sys.platform == "darwin", reason="Warp for macOS holds no CUDA compiler")
@pytest.mark.parametrize("name", NAMES)
def test_kernels_compile_for_cuda(name: str, tmp_path: Path) -> None:
    importlib.import_module(name)
    module = wp.get_module(name)
    if not module.kernels:
        assert "@wp.kernel" not in Path(importlib.import_module(name).__file__).read_text()
        return
    wp.compile_aot_module(module, arch=80, module_dir=str(tmp_path), use_ptx=True)
    (code,) = tmp_path.glob("*.ptx")
    assert code.read_text().count(".entry") == len(module.kernels)
