"""The configuration: a class of options for every group, those of the library wherever they mean the same.

The files under conf/ set these; a key that is not here is refused. `RgspipeConfig` is what a stage sees; the library
below the stages takes its own options and plain arguments and knows nothing of it. Nothing here loads torch.
"""

from rgspipe.config.core import get_value, with_changes
from rgspipe.config.root import RgspipeConfig

__all__ = ["RgspipeConfig", "get_value", "with_changes"]
