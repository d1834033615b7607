"""What a side of a material does with light, found out by asking it, whatever plugin it is."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

SAMPLES = 1 << 16  # of light from each kind of direction
STEEP = 0.5  # tangent of the largest tilt of facets that tell the width
RETRO = 0.5  # cosine of light that is sent back where it came from: all of it is diffuse
Array = NDArray[np.float64]
Flags = mi.BSDFFlags
MIRRORED, GLOSSY, DIFFUSE = Flags.DeltaReflection, Flags.GlossyReflection, Flags.DiffuseReflection
PASSED = (
    Flags.Null, Flags.DiffuseTransmission, Flags.GlossyTransmission, Flags.DeltaTransmission
)  # fmt: skip


@dataclass(frozen=True)
class Asked:
    """Random answers of a material to light from directions of one kind.

    Arguments:
        weight: [N, 3] of the light, and `kind`: [N] flags of what happened.
        tilt: [N] tangent of the angle between the normal and the half vector.
    """

    weight: Array
    kind: NDArray[np.uint32]
    tilt: Array

    def are(self, *flags: mi.BSDFFlags) -> NDArray[np.bool_]:
        """Which answers are of one of these kinds: [N]."""
        chosen: NDArray[np.bool_] = (self.kind & np.uint32(sum(map(int, flags)))) != 0
        return chosen

    def part(self, *flags: mi.BSDFFlags) -> Array:
        """Part of the light that is answered so: [3]."""
        result: Array = (self.weight * self.are(*flags)[:, None]).mean(0)
        return result

    @property
    def width(self) -> float:
        """GGX width of the specular reflection, for light at right angles; 0 for a mirror.

        Of facets tilted by t = tan at most, half are below m with m² / (w² + m²) =
        t² / (w² + t²) / 2. Steeper ones do not count, as Fresnel's reflectance rises there.
        """
        glossy = self.are(GLOSSY) & (self.tilt < STEEP)
        if not glossy.any() or self.part(MIRRORED).sum() > self.part(GLOSSY).sum():
            return 0.0
        limit, middle = STEEP**2, float(np.median(self.tilt[glossy])) ** 2
        return float(np.sqrt(min(limit * middle / max(limit - 2 * middle, 1e-9), 1.0)))


class Material:
    """One side of a material.

    Arguments:
        uv: [M, 2] places on its textures that stand for all.
        front: the side before the surface, else that behind it.
    """

    def __init__(self, bsdf: mi.BSDF, uv: Array, *, front: bool) -> None:
        self._bsdf, self._uv, self._side = bsdf, uv, 1.0 if front else -1.0

    def ask(self, cosine: float | None = None) -> Asked:
        """Light from directions at an angle to the normal, by default from all evenly."""
        si, wi = self._light(cosine)
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(1, SAMPLES)
        context = mi.BSDFContext(mi.TransportMode.Importance)
        drawn, weight = self._bsdf.sample(
            context, si, sampler.next_1d(), sampler.next_2d(), mi.Bool(True)
        )
        value = np.nan_to_num(_rows(weight), nan=0.0, posinf=0.0)
        half = wi + _rows(drawn.wo)
        tilt = np.linalg.norm(half[:, :2], axis=1) / np.maximum(np.abs(half[:, 2]), 1e-9)
        kind = np.broadcast_to(np.array(drawn.sampled_type), SAMPLES).astype(np.uint32)
        return Asked(value, kind, tilt)

    def sent_back(self) -> Array:
        """Colour of the diffuse reflection, as who holds the light sees it: [3]."""
        si, _ = self._light(RETRO)
        value = self._bsdf.eval(mi.BSDFContext(), si, si.wi, mi.Bool(True))
        result: Array = np.nan_to_num(_rows(value)).mean(0) * np.pi / RETRO
        return result

    def _light(self, cosine: float | None) -> tuple[mi.SurfaceInteraction3f, Array]:
        rng = np.random.default_rng(7)
        z = np.sqrt(rng.random(SAMPLES)) if cosine is None else np.full(SAMPLES, cosine)
        turn, across = 2 * np.pi * rng.random(SAMPLES), np.sqrt(np.maximum(1 - z * z, 0))
        wi = np.stack((across * np.cos(turn), across * np.sin(turn), self._side * z), 1)
        si = dr.zeros(mi.SurfaceInteraction3f, SAMPLES)
        si.t, si.n = mi.Float(1), mi.Normal3f(0, 0, 1)
        x, y = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
        si.sh_frame, si.dp_du, si.dp_dv = mi.Frame3f(x, y, mi.Vector3f(0, 0, 1)), x, y
        si.wi = mi.Vector3f(wi.T.astype(np.float32))
        place = self._uv[rng.integers(0, len(self._uv), SAMPLES)]
        si.uv = mi.Point2f(place.T.astype(np.float32))
        return si, wi


def _rows(value: mi.Vector3f | mi.Color3f) -> Array:
    return np.broadcast_to(np.array(value, np.float64).reshape(3, -1).T, (SAMPLES, 3))
