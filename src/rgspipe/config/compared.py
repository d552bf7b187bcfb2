"""What is set beside each other: fits, by studies and by the report, and scenes with what they could have been."""

from __future__ import annotations

from dataclasses import dataclass

from rgspipe.fitting.options import Method
from rgspipe.options import Options, option

#: Keys and sections that ask what would come of another scene or other images than those that are there: of other
#: surfels, or of errors that are put in; and of another method.
OTHER_SCENE, OTHER_METHOD = ("capture", "freeze.surfels", "model_error", "target_capture"), "fit.method"


@dataclass(frozen=True)
class ComparedFits(Options):
    """Which fits are set beside each other."""

    views: tuple[int, ...] = option((1,), low=1, high=1000)
    """numbers of views"""
    methods: tuple[Method, ...] = ("search_lm",)
    """methods"""
    limit: int | None = option(None, low=1, high=100000)
    """targets of each class, where fit.limit does not say; all if null"""
    paper_adam_limit: int | None = option(1, low=1, high=100000)
    """the same for paper_adam, which takes minutes a target"""
    paper_adam_views: tuple[int, ...] | None = option(None, low=1, high=1000)
    """numbers of views that paper_adam is run on; all if null"""

    def fits(self) -> list[tuple[Method, int]]:
        """Each method with each of its numbers of views."""
        return [(method, views) for method in self.methods for views in self._views_of(method)]

    def _views_of(self, method: Method) -> tuple[int, ...]:
        own = self.paper_adam_views if method == "paper_adam" else None
        return self.views if own is None else own

    def limit_of(self, method: Method) -> int | None:
        """Targets of each class for a method, where nothing else is said; all if None."""
        return self.paper_adam_limit if method == "paper_adam" else self.limit
