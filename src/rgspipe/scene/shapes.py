"""Shapes of tensors in annotations, such as `Float[Tensor, "N 3"]`: jaxtyping's where that is loaded, as under pytest.

There every call of what is annotated is checked (`--jaxtyping-packages` in pyproject.toml). Elsewhere they are read by
people and type checkers, and cost nothing: jaxtyping takes longer to import than all of the names that it would bring.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any, TypeAlias

from torch import Tensor

if TYPE_CHECKING or "jaxtyping" in sys.modules:
    from jaxtyping import Float
else:

    class Float:
        """Stands for jaxtyping's: `Float[Tensor, "N 3"]` is `Tensor`."""

        def __class_getitem__(cls, item: tuple[type, str]) -> type:
            return item[0]


if TYPE_CHECKING:
    #: A field that holds a tensor, and is given as whatever `as_tensor` takes, which checks its shape.
    Given: TypeAlias = Tensor
else:
    Given = Any

__all__ = ["Float", "Given"]
