"""Surfaces that no camera saw: where they must be, and surfels in their place."""

from rgspipe.completion.unseen import with_unseen_surfaces

__all__ = ["with_unseen_surfaces"]
