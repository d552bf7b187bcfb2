"""rgspipe: from images of a scene, find the lights."""

from rgspipe.threads import settle_threads

settle_threads()

__version__ = "0.1.0"
