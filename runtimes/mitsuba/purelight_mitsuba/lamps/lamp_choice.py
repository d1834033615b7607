"""Which of many lamps a vertex aims at: one that can give it light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_mitsuba.device_array import device_array
from purelight_mitsuba.lamps.emitter import PureLightEmitter
from purelight_mitsuba.lamps.spheres import spheres
from purelight_mitsuba.sampling.far_field import HORIZONTAL, VERTICAL, FarField

SIDE = 16  # Cells of a map of all directions, along each side.
EVEN = 0.1  # Least part of a lamp's light that counts as going in all directions alike.
DEFENSIVE = 0.1  # Part of the choices made by power alone, since what is estimated may be wrong.
NONE = 0xFFFFFFFF  # No lamp.
LEAST = 1e-30  # Part of all lamps' power, so that single precision has none that shines at zero.


@dataclass
class Scales:
    """How a vertex turns estimates and powers into probabilities."""

    estimate: mi.Float
    power: mi.Float


class LampChoice:
    """Chooses lamps by the irradiance that they would cause at a point if nothing were in between.

    The estimate is power · I / max(d², r²), with the intensity I from the lamp's photometry where
    it has one, relative to an even one; from near its sphere, a lamp's light counts as even, since
    its photometry says nothing there. A part of the choices goes by power alone.

    Arguments:
        emitters: The lamps, not all dark.
    """

    def __init__(self, emitters: Sequence[PureLightEmitter]) -> None:
        power = np.array([e.level * e.luminaire.power * e.placement.scale**2 for e in emitters])
        part = np.where(power > 0, np.maximum(power / power.sum(), LEAST), 0)
        rows, maps = _maps(emitters)
        self._power = device_array(mi.Float, part)
        self._spheres = device_array(mi.Float, _spheres(emitters))
        self._rows, self._maps = device_array(mi.UInt32, rows), device_array(mi.Float, maps)
        self._count = mi.UInt32(len(emitters))
        dr.make_opaque(self._power, self._spheres, self._rows, self._maps, self._count)

    def sample(
        self, u: mi.Float, p: mi.Point3f, active: mi.Bool, own: mi.UInt32
    ) -> tuple[mi.UInt32, mi.Float]:
        """Chooses a lamp for points in the world: its index, and `probability` there.

        Arguments:
            own: The lamp that a point is on, which is never chosen, or `NONE`.
        """
        scales = self._scales(p, active, own)

        def body(
            lamp: mi.UInt32, left: mi.Float, chosen: mi.UInt32, chance: mi.Float
        ) -> tuple[mi.UInt32, mi.Float, mi.UInt32, mi.Float]:
            its = self._chance(lamp, p, own, scales)
            able = its > 0
            return lamp + 1, left - its, dr.select(able, lamp, chosen), dr.select(able, its, chance)

        _, _, chosen, chance = dr.while_loop(
            (mi.UInt32(0), mi.Float(u), mi.UInt32(0), mi.Float(0)),
            lambda lamp, left, *_: active & (lamp < self._count) & (left >= 0),
            body,
            label="choice of a lamp",
        )
        return chosen, chance

    def probability(
        self, lamp: mi.UInt32, p: mi.Point3f, active: mi.Bool, own: mi.UInt32
    ) -> mi.Float:
        """The probability with which points in the world choose a lamp."""
        return self._chance(lamp, p, own, self._scales(p, active, own))

    def _scales(self, p: mi.Point3f, active: mi.Bool, own: mi.UInt32) -> Scales:
        _, total = dr.while_loop(
            (mi.UInt32(0), mi.Float(0)),
            lambda lamp, _: active & (lamp < self._count),
            lambda lamp, total: (lamp + 1, total + self._estimate(lamp, p, own)),
            label="light of all lamps",
        )
        scale = (1 - DEFENSIVE) / total
        sound = dr.isfinite(scale) & (scale > 0)
        power = dr.select(sound, mi.Float(DEFENSIVE), 1) * self._without_own(own)
        return Scales(dr.select(sound, scale, 0), power)

    def _without_own(self, own: mi.UInt32) -> mi.Float:
        """By what powers grow where a point's own lamp is not to be chosen."""
        others = 1 - dr.gather(mi.Float, self._power, own, own != NONE)
        return dr.select(own != NONE, dr.rcp(dr.maximum(others, LEAST)), 1)

    def _chance(self, lamp: mi.UInt32, p: mi.Point3f, own: mi.UInt32, scales: Scales) -> mi.Float:
        power = scales.power * dr.gather(mi.Float, self._power, lamp)
        estimated = scales.estimate * self._estimate(lamp, p, own)
        chance = dr.select(scales.estimate > 0, power + estimated, power)
        return dr.select(lamp == own, 0, chance)

    def _estimate(self, lamp: mi.UInt32, p: mi.Point3f, own: mi.UInt32) -> mi.Float:
        """Irradiance at points, in units that all lamps share."""
        sphere = dr.gather(mi.Vector4f, self._spheres, lamp)
        away = mi.Vector3f(p) - sphere.xyz
        square = dr.maximum(dr.squared_norm(away), sphere.w)
        row = dr.gather(mi.UInt32, self._rows, lamp)
        intensity = dr.gather(mi.Float, self._maps, row * SIDE**2 + cell(away))
        even = dr.maximum(EVEN, sphere.w / square)
        light = dr.gather(mi.Float, self._power, lamp) * dr.lerp(intensity, 1, even) / square
        return dr.select(lamp == own, 0, light)


def cell(direction: mi.Vector3f) -> mi.UInt32:
    """The cell of an octahedral map in which directions of any length lie."""
    x, y, z = direction
    size = dr.abs(x) + dr.abs(y) + dr.abs(z)
    x, y = x / size, y / size
    folded = dr.mulsign(1 - dr.abs(y), x), dr.mulsign(1 - dr.abs(x), y)
    x, y = dr.select(z < 0, folded[0], x), dr.select(z < 0, folded[1], y)
    column, row = (mi.UInt32(dr.clip((t + 1) * (SIDE / 2), 0, SIDE - 1)) for t in (x, y))
    return dr.minimum(row * SIDE + column, SIDE**2 - 1)


def _spheres(emitters: Sequence[PureLightEmitter]) -> np.ndarray:
    """Centres in the world and squared radii of bounding spheres: [L, 4]."""
    centres, radii = spheres(emitters)
    return np.column_stack([centres, radii**2])


def _maps(emitters: Sequence[PureLightEmitter]) -> tuple[np.ndarray, np.ndarray]:
    """Each lamp's row [L], and the rows [M, SIDE²]: equal lamps turned alike share one."""
    keys = [(e.luminaire.digest, e.placement.rotation.tobytes()) for e in emitters]
    different = dict(zip(keys, emitters, strict=True))
    number = {key: index for index, key in enumerate(different)}
    maps = np.stack([intensities(emitter) for emitter in different.values()])
    return np.array([number[key] for key in keys], np.uint32), maps


def intensities(emitter: PureLightEmitter) -> np.ndarray:
    """Mean intensity in the cells of the world's directions, over all of them one: [SIDE²]."""
    try:
        field = FarField.of(emitter.luminaire.photometry(), emitter.luminaire.path.name)
    except PureLightError:  # Photometry is optional, and its text need not be of our kind.
        return np.ones(SIDE**2, np.float32)
    v = np.linspace(0, np.pi, VERTICAL)
    h = np.linspace(0, 2 * np.pi, HORIZONTAL)[:-1, None]
    local = np.broadcast_arrays(np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), -np.cos(v) + 0 * h)
    world = np.stack(local, -1).reshape(-1, 3) @ emitter.placement.rotation.T
    index = cell(mi.Vector3f(world.T.astype(np.float32))).numpy()
    weight = np.broadcast_to(np.sin(v), (len(h), VERTICAL)).ravel()
    light, area = (
        np.bincount(index, weight * values, SIDE**2) for values in (field.values[:-1].ravel(), 1)
    )
    return np.divide(4 * np.pi * light, area, np.ones(SIDE**2), where=area > 0).astype(np.float32)
