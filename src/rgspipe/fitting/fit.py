"""The entry to all fits: images of a frozen scene in, lights out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from rgspipe.arguments import as_one_of
from rgspipe.errors import InputError
from rgspipe.fitting.in_sight.search import fit_on_lookout, fit_without
from rgspipe.fitting.model.capture import BaseImages, ImageCapture
from rgspipe.fitting.model.emitter import Emitter
from rgspipe.fitting.result import FitResult
from rgspipe.fitting.search_lm import fit_from
from rgspipe.fitting.solvers import Search, Solver
from rgspipe.fitting.spec import LightSpec
from rgspipe.fitting.target_views import Cameras, TargetViews
from rgspipe.renderer.effects import ALL_EFFECTS, Effects
from rgspipe.renderer.frozen import FrozenScene
from rgspipe.scene import Light
from rgspipe.scene.arrays import ArrayLike, as_list
from rgspipe.scene.lights import as_rig, check_numbers

#: What is known of lamps in sight: their pixels, that there are none, or nothing.
Emitters: TypeAlias = "str | Sequence[ArrayLike] | ArrayLike | None"


@dataclass(frozen=True)
class FitViews(TargetViews):
    """Views made ready for any number of fits, of targets that the same cameras see and of whose lights the same is
    known.
    """

    def fit(
        self,
        images: Sequence[ArrayLike] | ArrayLike,
        *,
        solver: Solver | None = None,
        capture: ImageCapture | None = None,
        emitters: Emitters = "auto",
    ) -> FitResult:
        """The lights of one image a view; see `fit_lights`."""
        stacked = self.prepared.stack_images(images)
        solver = Search() if solver is None else solver
        if isinstance(solver, type) or not isinstance(solver, Solver):
            raise InputError(
                "solver",
                expected="a way of fitting with its options, such as rg.Search(starts=8) or rg.PaperAdam()",
                found=f"{solver!r}",
                remedy="Pass such an object.",
            )
        capture = as_one_of(capture or ImageCapture(), ImageCapture, "capture", "Pass ImageCapture(…).")

        if not isinstance(emitters, str | None):
            masks = self.prepared.emitter_masks(as_list(emitters, axes=2))
            return fit_without(self, stacked, capture, solver, masks)
        if emitters not in {"auto", None}:
            raise InputError("emitters", expected='"auto", masks or None', found=repr(emitters), remedy="Choose one.")
        # The published method has no way to look twice.
        if emitters == "auto" and isinstance(solver, Search):
            return fit_on_lookout(self, stacked, capture, solver)
        return solver.fit(self, stacked, capture)

    def refit(
        self,
        images: Sequence[ArrayLike] | ArrayLike,
        start: Light | Sequence[Light],
        capture: ImageCapture | None = None,
    ) -> FitResult:
        """The lights of one image a view, as many and of those kinds that `start` has, from there downhill.

        Raises:
            InputError: see `fit_lights`, or there is no light to start from, or one that is nowhere.
        """
        stacked, rig = self.prepared.stack_images(images), as_rig(start)
        check_numbers(rig)
        if not rig:
            raise InputError("start", expected="a light to start from", found="none", remedy="Pass one, or use fit.")
        return fit_from(self.problem(stacked, capture, Search().loss), [Emitter.of(light) for light in rig])


def fit_lights(
    scene: FrozenScene,
    cameras: Cameras,
    images: Sequence[ArrayLike] | ArrayLike,
    *,
    lights: str | LightSpec = "point",
    solver: Solver | None = None,
    base: Sequence[ArrayLike] | ArrayLike | None = None,
    masks: Sequence[ArrayLike] | ArrayLike | None = None,
    capture: ImageCapture | None = None,
    effects: Effects = ALL_EFFECTS,
    sharp: bool = True,
    mask_edges: bool = True,
    emitters: Emitters = "auto",
) -> FitResult:
    """Recover the lights of images of a frozen scene.

    `FitViews.prepare(scene, cameras, …).fit(images, …)` does the same, and is quicker for several targets of the same
    cameras.

    Args:
        scene: the scene.
        cameras: of the images, or their weights; one stands for a list of it, as of images and masks.
        images: (H, W, 3) linear radiance per camera, premultiplied by alpha.
        lights: what is known of the lights: the name of a kind, of which there is one, or "auto" for one of
            any kind; or all that there is to know.
        solver: how, such as `Search(starts=8)` or `PaperAdam(seed=1)`; `Search()` if None.
        base: what `images` show with the lamps off, taken as they were; it is taken away from them. More can be said of
            it in `capture`, which has it then instead.
        masks: (H, W) per camera, the scene's share of each pixel (the image's alpha); 1 if None.
        capture: what is known of how the images were taken; as radiance, with known exposures, if None.
        effects: parts of light transport.
        sharp: whether the last steps take direct light where pixels look, shadows' edges included; else at surfels'
            centres, which is quicker and less accurate.
        mask_edges: whether a search leaves out pixels on silhouettes, creases and depth jumps.
        emitters: lamps that are in sight, whose own pixels no light explains: "auto" for a `Search` that finds them,
            left out and looked for where they are seen; (H, W) masks per camera that are 1 there; None if there is
            none to be left out.

    Returns:
        The lights, why the fit stopped, and how it got there. A target that is black gives a result without
        lights, not an error.

    Raises:
        InputError: images or masks do not fit the cameras, are not finite, or leave no pixel; or a kind of light that
            is not known.
        ValueError: the solver cannot do without what is not known of the lights.
    """
    views = FitViews.prepare(
        scene, cameras, lights=lights, masks=masks, effects=effects, sharp=sharp, mask_edges=mask_edges
    )
    if base is not None:
        capture = capture or ImageCapture()
        if capture.base is not None:
            remedy = "Give them once; what is known of them is said in the capture's."
            raise InputError("base", expected="nothing beside the capture's own", found="images", remedy=remedy)
        capture = replace(capture, base=BaseImages(base))
    return views.fit(images, solver=solver, capture=capture, emitters=emitters)
