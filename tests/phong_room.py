"""An exact path tracer for the inside of a unit cube with Phong reflection, in float64: no surfel, no harmonic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PhongRoom:
    """The inside of the cube [−½, ½]³; the floor, z = −½, is glossy.

    Attributes:
        albedo: of all faces. specular, exponent: k_s and n of the floor.
        light: (3,) a point light of intensity 1 W/sr.
    """

    albedo: float
    specular: float
    exponent: float
    light: np.ndarray

    def radiance(
        self, points: np.ndarray, eye: np.ndarray, paths: int, bounces: int, seed: int = 0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Radiance that `points` (Q, 3) on the faces send to `eye` (3,), and its standard error, both (Q,).

        Args:
            bounces: how many the light takes after the first reflection; 0 is direct light.
        """
        generator = np.random.default_rng(seed)
        place = np.repeat(points, paths, axis=0)
        leaving = _unit(eye - place)
        total, share = np.zeros(len(place)), np.ones(len(place))
        for bounce in range(bounces + 1):
            normal = _inward_normal(place)
            to_light = self.light - place
            distance = np.linalg.norm(to_light, axis=1)
            arriving = to_light / distance[:, None]
            cosine = np.maximum((arriving * normal).sum(1), 0.0)
            total += share * self._brdf(place, normal, arriving, leaving) * cosine / distance**2
            if bounce < bounces:
                arriving = _cosine_directions(normal, generator)
                share = share * np.pi * self._brdf(place, normal, arriving, leaving)
                place, leaving = _exit(place, arriving), -arriving
        samples = total.reshape(len(points), paths)
        return samples.mean(axis=1), samples.std(axis=1) / np.sqrt(paths)

    def _brdf(self, place: np.ndarray, normal: np.ndarray, arriving: np.ndarray, leaving: np.ndarray) -> np.ndarray:
        mirror = 2.0 * (arriving * normal).sum(1)[:, None] * normal - arriving
        lobe = np.maximum((mirror * leaving).sum(1), 0.0) ** self.exponent * (self.exponent + 2.0) / (2.0 * np.pi)
        return self.albedo / np.pi + np.where(normal[:, 2] > 0.5, self.specular * lobe, 0.0)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _inward_normal(place: np.ndarray) -> np.ndarray:
    axis = np.abs(place).argmax(axis=1)
    rows = np.arange(len(place))
    normal = np.zeros_like(place)
    normal[rows, axis] = -np.sign(place[rows, axis])
    return normal


def _cosine_directions(normal: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """A point of the unit sphere, moved by the normal, is cosine-distributed around it."""
    return _unit(normal + _unit(generator.normal(size=normal.shape)))


def _exit(place: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Where rays from a face leave the cube again."""
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (0.5 * np.sign(direction) - place) / direction
    reach = np.where(np.isfinite(reach) & (reach > 1e-9), reach, np.inf)
    return place + direction * reach.min(axis=1, keepdims=True)
