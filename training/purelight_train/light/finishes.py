"""Of what the exit surface of a lamp is made: a finish for each side of each triangle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from purelight_format.limits import LIMITS
from purelight_format.members.finishes import NONE, Finish
from purelight_format.reflection import SHARP
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.finish_bodies import with_bodies
from purelight_train.light.finish_fit import finish_of
from purelight_train.light.interfaces import relative_index
from purelight_train.light.luminaire import Luminaire, triangle_counts
from purelight_train.light.material_probe import Material
from purelight_train.light.walls import thin_walls

PLACES = 16  # on a triangle, to see its texture
PLAIN = 0.02  # relative spread of colours that counts as none
SHADES = 16  # of a textured material, at most
REFRACTS = 1e-3  # of an index of refraction
Array = NDArray[np.float64]
Sides = NDArray[np.uint8]


@dataclass(frozen=True)
class Finished:
    """A lamp's finishes, and which of them each side of each triangle has: [T, 2]."""

    finishes: tuple[Finish, ...]
    sides: Sides


@dataclass(frozen=True)
class Patch:
    """The triangles of one shape that can be seen.

    Arguments:
        triangles: [P] of the exit surface.
        uv: [P, K, 2] places on their textures.
        smooth: whether its normals are interpolated.
    """

    shape: mi.Shape
    triangles: NDArray[np.int64]
    uv: Array
    smooth: bool

    @property
    def key(self) -> tuple[int, bool]:
        """Equal for patches of the same material."""
        return _number(self.shape.bsdf()), self.smooth


def finished(luminaire: Luminaire) -> Finished:
    """What the exit surface of a lamp is made of, found by asking its materials."""
    surface = luminaire.exit_surface
    assert surface.turned is not None
    area = surface.triangle_area
    groups: dict[tuple[int, bool], list[Patch]] = {}
    for patch in patches(luminaire.scene, surface):
        groups.setdefault(patch.key, []).append(patch)
    textured = sum(colors_of(group) is not None for group in groups.values())
    shades = max(1, min(SHADES, (LIMITS.finishes - 2 * len(groups)) // max(2 * textured, 1)))
    made: list[Finish] = []
    sides = np.full((len(area), 2), -1, np.int64)
    for group in groups.values():
        triangles = np.concatenate([patch.triangles for patch in group])
        turned = surface.turned[triangles]
        thin = thin_walls(luminaire.scene, surface, triangles)
        for side, front in enumerate((True, False)):
            found, index = _of_side(group, area[triangles], shades, front=front, thin=thin)
            column = np.where(turned, 1 - side, side)
            sides[triangles, column] = np.where(index < 0, -1, index + len(made))
            made.extend(found)
    return _compact(*with_bodies(luminaire, made, sides), area)


def patches(scene: mi.Scene, surface: ExitSurface) -> Iterator[Patch]:
    """What is seen of each shape."""
    counts = triangle_counts(scene)
    first = np.cumsum([0, *counts])
    source = surface.source
    assert source is not None
    for k, shape in enumerate(scene.shapes()):
        triangles = np.flatnonzero((source >= first[k]) & (source < first[k + 1]))
        if len(triangles):
            normals = surface.vertex_normals
            bent = normals is not None and normals[surface.triangles[triangles]].any()
            yield Patch(shape, triangles, _uv(shape, source[triangles] - first[k]), bool(bent))


def _uv(shape: mi.Shape, faces: NDArray[np.int64]) -> Array:
    """Random places on triangles as texture coordinates; without any, of the whole texture."""
    rng = np.random.default_rng(5)
    parameters = mi.traverse(shape)
    texture = "vertex_texcoords" in parameters and len(parameters["vertex_texcoords"])
    if not texture:
        return rng.random((len(faces), PLACES, 2))
    corners = np.array(parameters["vertex_texcoords"], np.float64).reshape(-1, 2)
    indices = np.array(parameters["faces"]).reshape(-1, 3)[faces]
    weight = rng.dirichlet(np.ones(3), (len(faces), PLACES))
    result: Array = np.einsum("tkc,tcd->tkd", weight, corners[indices])
    return result


def colors_of(group: list[Patch]) -> Array | None:
    """Diffuse colour of each triangle of a group, [P, 3]; None where it does not vary."""
    bsdf = group[0].shape.bsdf()
    uv = np.concatenate([patch.uv for patch in group])
    si = dr.zeros(mi.SurfaceInteraction3f, uv.shape[0] * PLACES)
    si.uv = mi.Point2f(uv.reshape(-1, 2).T.astype(np.float32))
    si.wi, si.n = mi.Vector3f(0, 0, 1), mi.Normal3f(0, 0, 1)
    si.sh_frame = mi.Frame3f(mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1))
    try:
        value = np.array(bsdf.eval_diffuse_reflectance(si), np.float64)
    except RuntimeError:  # Not every material has a diffuse reflectance.
        return None
    if value.ndim < 2 or value.shape[1] != len(uv) * PLACES:
        return None
    color = value.T.reshape(len(uv), PLACES, 3).mean(1)
    mean = color.mean(0)
    varies = color.std(0).max() > PLAIN * max(float(mean.max()), 1e-9)
    return color if varies else None


def _of_side(
    group: list[Patch], area: Array, shades: int, *, front: bool, thin: bool
) -> tuple[list[Finish], NDArray[np.int64]]:
    """Finishes of one side of a material, and which of them each triangle has; -1 for none."""
    shape, smooth = group[0].shape, group[0].smooth
    bsdf, count = shape.bsdf(), len(area)
    index = relative_index(bsdf)
    refracts = abs(index - 1) > REFRACTS
    if refracts and front == (index < 1):  # The inside of glass.
        return [], np.full(count, -1)
    uv = np.concatenate([patch.uv.reshape(-1, 2) for patch in group])
    finish = finish_of(Material(bsdf, uv, front=front), _name(shape), index, smooth=smooth)
    hollow = thin and shape.interior_medium() is None
    sheet = refracts and hollow and finish.roughness**2 < SHARP
    finish = replace(finish, thin_walled=finish.thin_walled or sheet)
    colors = colors_of(group)
    if colors is None or max(finish.base_color) == 0:
        return [finish], np.zeros(count, np.int64)
    mean = (area @ colors) / area.sum()
    middle, label = _palette(colors, area, shades)
    base = np.clip(np.array(finish.base_color) * middle / np.maximum(mean, 1e-9), 0, 1)
    rgb = [tuple(round(float(x), 5) for x in row) for row in base]
    return [replace(finish, base_color=(r, g, b)) for r, g, b in rgb], label


def _palette(colors: Array, area: Array, shades: int) -> tuple[Array, NDArray[np.int64]]:
    """A few colours [S, 3] that stand for those of triangles, and which one each has."""
    count = min(shades, len(np.unique(colors.round(3), axis=0)))
    rng = np.random.default_rng(0)
    drawn = colors[rng.choice(len(colors), 4096, p=area / area.sum())]
    middle, _ = kmeans2(np.sqrt(drawn), count, minit="++", seed=rng)
    distance = ((np.sqrt(colors)[:, None] - middle[None]) ** 2).sum(2)
    label = distance.argmin(1)
    weight = np.maximum(np.bincount(label, area, count), 1e-300)
    mean = np.stack([np.bincount(label, area * c, count) for c in colors.T], 1) / weight[:, None]
    return mean, label


def _compact(made: list[Finish], sides: NDArray[np.int64], area: Array) -> Finished:
    """Equal finishes once, unused ones not at all, and no more than the format has."""
    different = list(dict.fromkeys(made))
    number = np.array([different.index(finish) for finish in made] + [-1])
    sides = number[sides]
    weight = np.bincount(sides[sides >= 0], np.repeat(area, 2)[sides.ravel() >= 0], len(different))
    order = [k for k in np.argsort(-weight, kind="stable") if weight[k] > 0]
    kept = order[: LIMITS.finishes]
    stand_in = {k: j for j, k in enumerate(kept)}
    for k in order[LIMITS.finishes :]:
        stand_in[k] = min(stand_in[j] for j in kept if _apart(different[j], different[k]) == min(
            _apart(different[i], different[k]) for i in kept))  # fmt: skip
    table = np.full(len(different) + 1, NONE)
    for k, j in stand_in.items():
        table[k] = j
    return Finished(tuple(different[k] for k in kept), table[sides].astype(np.uint8))


def _apart(a: Finish, b: Finish) -> float:
    """How different two finishes are."""

    def numbers(f: Finish) -> Array:
        scattered = (*f.scattered_ahead, *f.scattered_back)
        return np.array(
            [*f.base_color, *scattered, f.metalness, f.roughness, 10 * f.opaque, f.smooth]
        )

    return float(np.abs(numbers(a) - numbers(b)).sum())


def _name(shape: mi.Shape) -> str:
    """What the scene calls a material, or else the shape."""
    own = shape.bsdf().id()
    name = shape.id() if not own or own.startswith(("_", "bsdf")) else own
    return "".join(c for c in name if c.isprintable())[:200] or "unnamed"


def _number(bsdf: mi.BSDF) -> int:
    return int(dr.reinterpret_array(mi.UInt32, mi.BSDFPtr(bsdf))[0])
