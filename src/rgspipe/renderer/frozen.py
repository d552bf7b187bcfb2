"""A frozen scene: geometry and materials are fixed, so light moves through precomputed linear operators."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import torch
from torch import Tensor

from rgspipe.arguments import as_count, as_one_of, as_path
from rgspipe.errors import InputError
from rgspipe.renderer.areas import surfel_areas
from rgspipe.renderer.dictionary import GRID, LightDictionary, build_dictionary
from rgspipe.renderer.direct import unit_irradiance
from rgspipe.renderer.effects import ALL_EFFECTS, Effects
from rgspipe.renderer.frozen_file import OWN_SOLVER, load_parts, save_parts
from rgspipe.renderer.frozen_pickle import pickled
from rgspipe.renderer.glossy_transport import GlossyLight, GlossyTransport, build_glossy_transport
from rgspipe.renderer.images.model import SurfelModel
from rgspipe.renderer.images.pixels import PixelModel
from rgspipe.renderer.images.recent_views import RecentViews
from rgspipe.renderer.images.viewed_pixels import ViewedPixels
from rgspipe.renderer.indirect import IndirectSolver, Solver, indirect_solver
from rgspipe.renderer.kernels.surfel_bvh import SurfelBvh
from rgspipe.renderer.mutual_visibility import build_needed_gather
from rgspipe.renderer.openness import openness, void_irradiance
from rgspipe.renderer.rig import rig_irradiance, unit_response
from rgspipe.renderer.sparse import SparseOperator
from rgspipe.renderer.surroundings import OPEN, Surroundings
from rgspipe.renderer.transport import PatchTransport, clustered_transport
from rgspipe.renderer.view_weights import ViewWeights, build_view_weights
from rgspipe.scene.arrays import ArrayLike, as_device, as_tensor, check_finite
from rgspipe.scene.camera import Camera
from rgspipe.scene.grade import SceneGrade
from rgspipe.scene.lights import Light, LightRig, as_rig, check_numbers
from rgspipe.scene.shapes import Float
from rgspipe.scene.surfels import Surfels


@dataclass(frozen=True, eq=False, repr=False)
class FrozenScene:
    """Surfels with their light transport.

    Attributes:
        surfels: N surfels, float32.
        areas: (N,) surface that each stands for, scene units².
        gather: (N, N) which surfels each surfel sees; None where a scene was loaded without it, as a fit needs only
            the patches.
        transport: bounces, averaged over patches.
        solver: how indirect light is found; None for `transport`. See `with_solver`.
        gloss: how light goes over glossy surfels; None for a diffuse scene.
        centers: (N, 3) float64 centres as they were given, which rays and lights are measured from: far from the origin
            float32 cannot hold them. None for `surfels.centers`.
        candidates: its dictionary of lights, if it is made already; see `dictionary`.
        grade: how good it is, where that was measured.
    """

    surfels: Surfels
    areas: Float[Tensor, " N"]
    gather: SparseOperator | None
    transport: PatchTransport
    solver: IndirectSolver | None = None
    gloss: GlossyTransport | None = None
    centers: Float[Tensor, "N 3"] | None = None
    candidates: LightDictionary | None = None
    grade: SceneGrade | None = None

    @classmethod
    def freeze(cls, surfels: Surfels, *, gather_rays: int = 256, patches: int = 1000, seed: int = 0) -> FrozenScene:
        """Precompute the operators of `surfels`, whose gradients end here: the gather, then patch transport.

        Args:
            gather_rays: hemisphere rays of a surfel.
            patches: of the indirect light.
            seed: of the rays.

        Raises:
            InputError: they are no surfels, or have impossible numbers; see `Surfels.check`.
        """
        as_one_of(surfels, Surfels, "surfels", "rg.exact_surfels makes them of a model, rg.train of views.").check()
        surfels = surfels.detached()
        for name, count in (("gather_rays", gather_rays), ("patches", patches), ("seed", seed)):
            as_count(count, name, 0 if name == "seed" else 1, remedy="Leave the default.")
        centers, surfels = surfels.centers.double(), surfels.to(torch.float32)
        exact = replace(surfels, centers=centers)
        bvh = SurfelBvh(exact)
        areas = surfel_areas(bvh, seed=seed)
        gather = build_needed_gather(bvh, gather_rays, seed=seed, areas=areas)
        transport = clustered_transport(gather, exact, areas, patches, seed=seed)
        gloss = build_glossy_transport(exact, gather, transport)
        return cls(surfels, areas, gather, transport, gloss=gloss, centers=centers)

    @classmethod
    def load(cls, folder: str | Path, *, gather: bool = False) -> FrozenScene:
        """The scene in a folder that `save` or the stage freeze wrote, on the CPU.

        Args:
            gather: whether the gather operator is loaded, too, which is most of the bytes; fits work on the patches.

        Raises:
            InputError: a file is missing, broken, or does not belong to the others.
        """
        return cls(**load_parts(as_path(folder, "folder"), gather=gather))

    def save(self, folder: str | Path) -> None:
        """Write surfels and operators, and the dictionary if it is made; docs/reference/formats.md has the files.

        Raises:
            InputError: it has another solver, or a limited number of bounces, which no file has.
        """
        if (self.solver or self.transport) is not self.transport or self.transport.bounces is not None:
            raise InputError("scene", expected="its own solver, with all bounces", found="another", remedy=OWN_SOLVER)
        save_parts(
            as_path(folder, "folder"),
            surfels=self.surfels,
            areas=self.areas,
            centers=(self.surfels.centers if self.centers is None else self.centers).double(),
            gather=self.gather,
            transport=self.transport,
            gloss=self.gloss,
            candidates=self.__dict__.get("dictionary", self.candidates),
            grade=self.grade,
        )

    def __reduce__(self) -> tuple:
        return pickled(self)

    def __repr__(self) -> str:
        return f"FrozenScene({self.surfels!r}, {self.transport.average.shape[0]} patches, size {self.size:.3g})"

    @property
    def device(self) -> torch.device:
        """Where the scene is, and its images are made."""
        return self.surfels.centers.device

    def to(self, device: torch.device | str) -> FrozenScene:
        """The same scene on another device, which must be there; this one if it is there already."""
        device = as_device(device)
        if device.type == self.device.type and device.index in (None, self.device.index):
            return self
        parts = {"gather": self.gather, "solver": self.solver, "gloss": self.gloss, "centers": self.centers}
        parts["candidates"] = self.__dict__.get("dictionary", self.candidates)
        moved = {name: None if part is None else part.to(device) for name, part in parts.items()}
        surfels, areas, transport = self.surfels.to(device), self.areas.to(device), self.transport.to(device)
        return FrozenScene(surfels, areas, transport=transport, grade=self.grade, **moved)

    @cached_property
    def bvh(self) -> SurfelBvh:
        """The hierarchy for shadow and camera rays."""
        return SurfelBvh(self.surfels if self.centers is None else replace(self.surfels, centers=self.centers))

    @cached_property
    def _recent(self) -> RecentViews:
        return RecentViews(self.bvh)

    @cached_property
    def bounds(self) -> tuple[Float[Tensor, " 3"], Float[Tensor, " 3"]]:
        """(3,) lower and upper corner of the surfels' centres, of which there must be some."""
        if not len(self.surfels):
            remedy = "Pass some: rg.exact_surfels makes them of a model, rg.train of views."
            raise InputError("scene", expected="surfels, on which light falls", found="none", remedy=remedy)
        return self.surfels.centers.amin(dim=0), self.surfels.centers.amax(dim=0)

    @property
    def size(self) -> float:
        """Longest side of the bounding box, scene units; 0 of an empty scene."""
        return float((self.bounds[1] - self.bounds[0]).amax()) if len(self.surfels) else 0.0

    @cached_property
    def openness(self) -> float:
        """Share of what the surfaces look at that is void; see `renderer.openness`."""
        return openness(self.bvh, self.bvh.surfels)

    @cached_property
    def void_irradiance(self) -> Float[Tensor, " N"]:
        """(N,) irradiance from a void of radiance 1 all around; made when first asked for, which takes seconds."""
        return void_irradiance(self.bvh)

    @cached_property
    def surroundings(self) -> Surroundings:
        """Where lights may be."""
        lower, upper = (corner.double().cpu() for corner in self.bounds)
        return Surroundings(lower, upper, self.size, self.openness > OPEN)

    @cached_property
    def dictionary(self) -> LightDictionary:
        """Unit lights all over the scene, where searches begin; made when first asked for, which takes seconds."""
        return self.with_dictionary().candidates if self.candidates is None else self.candidates

    def candidates_with(self, shadows: bool) -> LightDictionary:
        """The dictionary, or one like it for lights that nothing stands in the way of."""
        own = self.dictionary
        return own if shadows else self.with_dictionary(own.grid, seed=own.seed, shadows=False).dictionary

    def with_dictionary(self, grid: int = GRID, *, seed: int = 0, shadows: bool = True) -> FrozenScene:
        """The same scene with a dictionary of its own; see `build_dictionary`."""
        made = build_dictionary(self.bvh, self.areas, self.surroundings, grid, seed=seed, shadows=shadows)
        return replace(self, candidates=made)

    def view(self, camera: Camera, supersampling: int = 4) -> ViewWeights:
        """The camera's image as a linear function of the radiance."""
        return build_view_weights(self.bvh, camera, supersampling)

    def unit_irradiance(
        self, positions: ArrayLike, shadows: bool = True, at: Tensor | None = None
    ) -> tuple[Float[Tensor, "L N"], Float[Tensor, "L N 3"]]:
        """Irradiance (L, N) of unit point lights at (L, 3), and derivative (L, N, 3); of surfels `at` (N,), else all.

        Raises:
            InputError: positions have another shape.
        """
        return unit_irradiance(self.bvh, as_tensor(positions, "positions", ("L", 3)), shadows, at)

    def with_solver(
        self, solver: Solver, *, bounces: int | None = None, samples: int = 64, seed: int = 0
    ) -> FrozenScene:
        """The same scene with another way to find indirect light.

        Args:
            solver: `patches`, the default, one small product; `gather`, the full operator bounce by bounce;
                `monte_carlo`, the published method: fresh random rays at every evaluation.
            bounces: how many; None for all of them, of Monte Carlo for MONTE_CARLO_BOUNCES.
            samples: rays a surfel and bounce of Monte Carlo.
            seed: of its rays.

        Raises:
            InputError: the solver has another name, needs the gather operator and the scene was loaded without it, or
                the scene is glossy: light goes over gloss from patch to patch; or a count is out of range.
        """
        return replace(self, solver=indirect_solver(self, solver, bounces, samples, seed))

    def indirect(self, direct: Float[Tensor, "N 3 K"]) -> Float[Tensor, "N 3 K"]:
        """(N, 3, K) indirect part of the radiosity for K lightings with direct radiosity (N, 3, K)."""
        return (self.solver or self.transport).indirect(direct)

    def radiance(self, irradiance: Float[Tensor, "N K"], indirect: bool = True) -> Float[Tensor, "N 3 K"]:
        """Outgoing radiance (N, 3, K) for K direct irradiances (N, K), grey; linear and differentiable."""
        direct = self.surfels.albedo[:, :, None] * (irradiance / math.pi)[:, None, :]
        return direct + self.indirect(direct) if indirect else direct

    def coloured_radiance(self, irradiance: Float[Tensor, "N 3"], indirect: bool = True) -> Float[Tensor, "N 3"]:
        """Outgoing radiance (N, 3) for a coloured direct irradiance (N, 3); linear and differentiable."""
        direct = self.surfels.albedo * (irradiance / math.pi)
        return direct + self.indirect(direct[:, :, None])[:, :, 0] if indirect else direct

    def radiance_of(self, rig: LightRig, effects: Effects = ALL_EFFECTS) -> Float[Tensor, "N 3"]:
        """Outgoing radiance (N, 3) under a rig, differentiable towards the tensors of its lights.

        The lights are added up before their light bounces, so a rig costs as many bounces as one light. Of a glossy
        scene this is the diffuse part, which is the same in all directions; `glossy_light` has all of it.
        """
        if self.gloss is not None and effects.lobes:
            return self.glossy_light(rig, effects).radiance
        return self.coloured_radiance(rig_irradiance(self.bvh, rig, effects), effects.interreflection)

    def render(
        self,
        camera: Camera | ViewWeights,
        lights: Light | Sequence[Light],
        effects: Effects = ALL_EFFECTS,
        *,
        sharp: bool = True,
    ) -> Float[Tensor, "H W 3"]:
        """(height, width, 3) linear radiance that a camera sees under one light or several, black without any.

        Differentiable, once, towards every tensor of the lights that requires gradients, by analytic derivatives.

        Args:
            camera: or the weights of its `view`. The first image of a camera takes longer than the next ones.
            effects: parts of light transport.
            sharp: whether direct light is taken where pixels look, shadows' edges included; else at surfels' centres,
                which is quicker and less accurate.

        Raises:
            InputError: no camera or no lights, but something else, or numbers of light beyond single precision.
        """
        view, rig = self._recent.weights(camera), as_rig(lights)
        check_numbers(rig)
        pixels = ViewedPixels.every(self, [view])
        direct = (self._recent.direct(view),) if sharp else None
        model = SurfelModel(pixels, effects) if direct is None else PixelModel.of(pixels, effects, direct)
        image = pixels.split(model.image(rig))[0]
        check_finite(image, "lights", "The lights are too bright, or too near to surfaces, for single precision.")
        return image

    def glossy_light(self, rig: LightRig, effects: Effects = ALL_EFFECTS) -> GlossyLight:
        """The light of a scene with gloss under `rig`, to be seen from anywhere; differentiable like `radiance_of`.

        Raises:
            ValueError: the scene is diffuse.
        """
        if self.gloss is None:
            raise ValueError("a diffuse scene has no glossy light: use radiance_of")
        response = unit_response(self.bvh, rig, effects)
        return self.gloss.light(self.solver or self.transport, response, effects.interreflection)
