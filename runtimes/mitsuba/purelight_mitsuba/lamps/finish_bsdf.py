"""Finishes as BSDFs of the mesh of all lamps, so that a path may have a vertex there."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.finishes import Finishes, Look

REFLECTION = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.GlossyReflection
BOTH_SIDES = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide


class _EvaluatedWhole(mi.BSDF):
    """A BSDF whose value and density come from `eval_pdf`."""

    def eval(
        self, context: Any, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True
    ) -> mi.Color3f:
        return self.eval_pdf(context, si, wo, active)[0]

    def pdf(
        self, context: Any, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True
    ) -> mi.Float:
        return self.eval_pdf(context, si, wo, active)[1]


class FinishBSDF(_EvaluatedWhole):
    """What reaches a surface and is reflected by it: a specular lobe or mirror, and a diffuse one.

    Arguments:
        finishes: Of all lamps.
        sides: Finishes of front and back, for each triangle of the mesh.
    """

    def __init__(self, finishes: Finishes, sides: mi.UInt32) -> None:
        super().__init__(mi.Properties())
        flags = REFLECTION | mi.BSDFFlags.DeltaReflection | BOTH_SIDES
        self.m_components, self.m_flags = [int(flags)], int(flags)
        self._finishes, self._sides = finishes, sides

    def _look(self, si: mi.SurfaceInteraction3f, active: Any) -> tuple[Look, mi.Vector3f, mi.Bool]:
        """The finish of the side that is seen, `wi` above it, and whether that is the front."""
        front = dr.dot(si.n, si.to_world(si.wi)) >= 0
        side = dr.select(front, mi.UInt32(0), mi.UInt32(1))
        index = dr.gather(mi.UInt32, self._sides, 2 * si.prim_index + side, active)
        return self._finishes.look(index, mi.Bool(active)), _turned(si.wi, front), front

    def sample(
        self, context: Any, si: mi.SurfaceInteraction3f, sample1: mi.Float, sample2: mi.Point2f,
        active: Any = True,
    ) -> tuple[mi.BSDFSample3f, mi.Color3f]:  # fmt: skip
        look, wi, front = self._look(si, active)
        share = _specular_share(look, wi)
        specular = sample1 < share
        micro = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, dr.maximum(look.alpha, 1e-4), True)
        half = dr.select(look.sharp, mi.Normal3f(0, 0, 1), micro.sample(wi, sample2)[0])
        wo = dr.select(specular, mi.reflect(wi, half), mi.warp.square_to_cosine_hemisphere(sample2))
        mirror = specular & look.sharp
        value, pdf = _value(look, wi, wo, share)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo, bs.eta = _turned(wo, front), mi.Float(1)
        bs.pdf = dr.select(mirror, share, pdf)
        bs.sampled_type = dr.select(
            mirror,
            mi.UInt32(+mi.BSDFFlags.DeltaReflection),
            mi.UInt32(+mi.BSDFFlags.GlossyReflection),
        )
        bs.sampled_component = mi.UInt32(0)
        weight = dr.select(mirror, look.reflectance(wi.z) / share, value / pdf)
        sound = active & (wi.z > 0) & (bs.pdf > 0) & (mirror | _same_side(si, bs.wo, front))
        return bs, dr.select(sound, weight, 0)

    def eval_pdf(
        self, context: Any, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True
    ) -> tuple[mi.Color3f, mi.Float]:
        look, wi, front = self._look(si, active)
        value, pdf = _value(look, wi, _turned(wo, front), _specular_share(look, wi))
        sound = active & _same_side(si, wo, front)
        return dr.select(sound, value, 0), dr.select(sound, pdf, 0)

    def to_string(self) -> str:
        return "FinishBSDF[]"


class ScatterBSDF(_EvaluatedWhole):
    """What leaves a body somewhere else: all of it, in a lobe ahead or back (Eq. 20).

    Its mesh has each triangle of the lamps twice: first for what goes ahead.

    Arguments:
        finishes, sides: As those of `FinishBSDF`.
    """

    def __init__(self, finishes: Finishes, sides: mi.UInt32) -> None:
        super().__init__(mi.Properties())
        flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.DiffuseTransmission | BOTH_SIDES
        self.m_components, self.m_flags = [int(flags)], int(flags)
        self._finishes, self._sides = finishes, sides
        self._count = mi.UInt32(dr.width(sides) // 2)
        dr.make_opaque(self._count)

    def _lobe(self, si: mi.SurfaceInteraction3f, active: Any) -> tuple[mi.Vector3f, mi.Float]:
        """Axis and exponent."""
        front = dr.dot(si.n, si.to_world(si.wi)) >= 0
        side, back = dr.select(front, mi.UInt32(0), mi.UInt32(1)), si.prim_index >= self._count
        triangle = dr.select(back, si.prim_index - self._count, si.prim_index)
        index = dr.gather(mi.UInt32, self._sides, 2 * triangle + side, active)
        look = self._finishes.look(index, mi.Bool(active))
        axis = dr.select(back, si.wi, -si.wi)
        return axis, dr.select(back, look.back_exponent, look.ahead_exponent)

    def sample(
        self, context: Any, si: mi.SurfaceInteraction3f, sample1: mi.Float, sample2: mi.Point2f,
        active: Any = True,
    ) -> tuple[mi.BSDFSample3f, mi.Color3f]:  # fmt: skip
        axis, exponent = self._lobe(si, active)
        cosine = sample2.x ** dr.rcp(exponent + 1)
        sine, turn = dr.safe_sqrt(1 - dr.square(cosine)), 2 * dr.pi * sample2.y
        along = mi.Vector3f(sine * dr.cos(turn), sine * dr.sin(turn), cosine)
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo, bs.eta = mi.Frame3f(axis).to_world(along), mi.Float(1)
        bs.pdf = _power_cosine(exponent, cosine)
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.DiffuseTransmission)
        bs.sampled_component = mi.UInt32(0)
        return bs, dr.select(active & (bs.pdf > 0), mi.Color3f(1), 0)

    def eval_pdf(
        self, context: Any, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: Any = True
    ) -> tuple[mi.Color3f, mi.Float]:
        axis, exponent = self._lobe(si, active)
        pdf = _power_cosine(exponent, dr.dot(axis, wo))
        pdf = dr.select(active, pdf, 0)
        return mi.Color3f(pdf), pdf

    def to_string(self) -> str:
        return "ScatterBSDF[]"


def _power_cosine(exponent: mi.Float, cosine: mi.Float) -> mi.Float:
    """Density per solid angle of a lobe of cos^k about its axis."""
    density = (exponent + 1) * dr.inv_two_pi * dr.maximum(cosine, 1e-30) ** exponent
    return dr.select(cosine > 0, density, 0)


def _turned(w: mi.Vector3f, front: mi.Bool) -> mi.Vector3f:
    """A direction as if the side that is seen were the front, or back again."""
    return mi.Vector3f(w.x, w.y, dr.select(front, w.z, -w.z))


def _same_side(si: mi.SurfaceInteraction3f, wo: mi.Vector3f, front: mi.Bool) -> mi.Bool:
    """Whether a direction leaves on the side that is seen, of the triangle itself."""
    cosine = dr.dot(si.n, si.to_world(wo))
    return dr.select(front, cosine, -cosine) > 0


def _specular_share(look: Look, wi: mi.Vector3f) -> mi.Float:
    """How often the specular reflection is drawn rather than the diffuse one."""
    specular = dr.max(look.reflectance(wi.z))
    diffuse = dr.max(look.diffuse * look.kept(wi.z))
    return dr.select(specular > 0, specular / (specular + diffuse), 0)


def _value(
    look: Look, wi: mi.Vector3f, wo: mi.Vector3f, share: mi.Float
) -> tuple[mi.Color3f, mi.Float]:
    """Eqs. 18 and 19 above the surface, and the density of `sample`, without the mirror."""
    cosine = dr.maximum(wo.z, 0)
    value = look.diffuse * look.kept(wi.z) * look.kept(cosine) * look.even * cosine
    pdf = (1 - share) * cosine * dr.inv_pi
    half = dr.normalize(wi + wo)
    micro = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, dr.maximum(look.alpha, 1e-4), True)
    lobe = micro.eval(half) * micro.G(wi, wo, half) / (4 * wi.z)
    between = dr.dot(half, wo)
    density = micro.pdf(wi, half) / (4 * dr.abs(between))
    above, glossy = (wi.z > 0) & (wo.z > 0), ~look.sharp
    value += dr.select(glossy, look.reflectance(between) * lobe, 0)
    pdf += dr.select(glossy, share * density, 0)
    return dr.select(above, value, 0), dr.select(above, pdf, 0)
