"""Where the configuration files are: at the top of a checkout, or inside an installed package."""

from __future__ import annotations

from pathlib import Path


def resource_folder(name: str) -> Path:
    """The folder "conf" or "pipelines".

    Raises:
        FileNotFoundError: the installation is incomplete.
    """
    package = Path(__file__).resolve().parents[1]
    for folder in (package / name, package.parents[1] / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"rgspipe's folder {name}/ is missing beside {package}: install rgspipe again")
