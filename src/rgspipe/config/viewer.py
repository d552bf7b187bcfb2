"""The page of stage=view."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.options import Options, option


@dataclass(frozen=True)
class ViewerConfig(Options):
    """The page of stage=view."""

    port: int = option(8080, low=0, high=65535)
    """of the page; the next free one where it is taken"""
    resolution: int = option(256, low=32, high=2048)
    """pixels along the longer side of pictures at rest"""
    address: str = "127.0.0.1"
    """of this machine to listen at; where others can reach it, the page is under a token that is printed"""
    browser: bool = True
    """whether the page is opened in the browser, where a terminal and a screen are"""
