"""What checks shapes in annotations under pytest; see `rgspipe.scene.shapes`."""

from __future__ import annotations

from collections.abc import Callable

from beartype import beartype


def checked(function: Callable) -> Callable:
    """A function whose tensors are checked; what else its annotations say has errors for people, which tests want."""
    shapes = {name: hint for name, hint in function.__annotations__.items() if "Float[" in str(hint)}
    function.__annotations__ = shapes
    return beartype(function) if shapes else function
