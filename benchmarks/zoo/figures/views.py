"""Pictures of a lamp: what it looks like lit, and what is seen through it unlit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.zoo import sheet
from benchmarks.zoo.figures import scenes
from benchmarks.zoo.figures.case import SETTLED, Case
from benchmarks.zoo.figures.enlarged import PATH_TRACING
from benchmarks.zoo.figures.floors import shadow
from benchmarks.zoo.figures.through import seen_through
from purelight_train.truth.metrics import Comparison
from purelight_train.truth.picture import Passes, Picture, means
from purelight_train.truth.thin_lens import ThinLens
from purelight_train.truth.views import three_views
from tests.support import fidelity
from tests.support.fidelity import Figures

PINHOLE = 1e-4
BLOCK = 4  # as in the training's report


def appearance(case: Case) -> Figures:
    """Three views through a thin lens against our light tracer; the brightest also path traced.

    The views are one picture, so that one from the dark side of a shade counts as what it is, and
    pixels are means over `BLOCK` x `BLOCK`: a few photons suffice.
    """
    settings = case.settings
    seen = fidelity.views(case.subject, settings.view_size, settings.view_paths, settings.view_spp)
    told, true = (side_by_side(p) for p in zip(*((v.student, v.truth) for v in seen), strict=True))
    mask = means(np.concatenate([v.mask for v in seen], 1), BLOCK) > 0.25
    if not mask.any():
        return {}
    row = Comparison(told.blocks(BLOCK), true.blocks(BLOCK), mask)
    sheet.save(
        case.large.folder.parent / "appearance.png",
        [sheet.strip(v.truth.image, v.student.image, v.mask) for v in seen],
    )
    return row.to_dict() | {
        "aperture": seen[0].lens.aperture,
        "path_traced": _path_traced(case, max(seen, key=lambda v: v.truth.image.mean())),
    }


def side_by_side(pictures: Sequence[Picture]) -> Picture:
    """Pictures of one height as one."""
    first, second = (np.concatenate([p.halves[k] for p in pictures], 1) for k in (0, 1))
    image, error = (
        np.concatenate([getattr(p, name) for p in pictures], 1) for name in ("image", "error")
    )
    return Picture(image, (first, second), error)


def _path_traced(case: Case, view: fidelity.View) -> Figures | None:
    """Mean radiance of a view by Mitsuba's path tracer over the light-traced one, less one.

    None where a path tracer cannot find all of it, or the view is dark.
    """
    if not case.large.path_traceable or not view.truth.image[view.mask].any():
        return None
    camera = replace(view.lens, sphere=case.large_sphere)
    objects = {"sensor": camera.sensor(), **case.large.lit}
    picture = scenes.passes(objects, PATH_TRACING, case.settings.glass_spp)
    mean = picture.image[view.mask].mean()
    error = np.sqrt((picture.error[view.mask] ** 2).sum()) / (3 * view.mask.sum())
    true = view.truth.image[view.mask].mean()
    noise = np.sqrt((view.truth.error[view.mask] ** 2).sum()) / (3 * view.mask.sum())
    return {
        "mean": float(mean / true - 1),
        "standard_error": float(np.hypot(error / true, noise / true)),
        "settled": bool(error < SETTLED * mean),
    }


def transmittance(case: Case) -> Figures:
    """The unlit lamp before an even background, path traced, and in the sun, light traced.

    Lamps whose media scatter have no truth here: what they scatter no line carries.
    """
    figures: Figures = {"shadow": shadow(case) if case.large.light_traceable else None}
    if "scattering" in case.lamp.traits:
        return figures
    lenses = three_views(ThinLens(case.sphere, case.settings.glass_size, 0, 0, PINHOLE))[:2]
    pairs = [_see_through(case, lens) for lens in lenses]
    told, true = (side_by_side(column) for column in list(zip(*pairs, strict=True))[:2])
    mask = np.concatenate([pair[2] for pair in pairs], 1)
    if not mask.any():
        return figures
    rows = [sheet.strip(r.image, t.image, m, white=1.0) for t, r, m in pairs]
    sheet.save(case.large.folder.parent / "transmittance.png", rows)
    apart = (told.image - true.image)[mask]
    return figures | {
        "truth": float(true.image[mask].mean()),
        "mean": float(apart.mean()),
        "absolute": float(np.abs(apart).mean()),
        "absolute_of_reference": float(0.5 * np.abs(np.subtract(*true.halves))[mask].mean()),
    }


def _see_through(case: Case, lens: ThinLens) -> tuple[Picture, Picture, NDArray[np.bool_]]:
    """A background of one through the lamp: as our networks say, the truth, and where it is."""
    camera = replace(lens, sphere=case.large_sphere)
    true = seen_through(case.large.dark, camera, case.settings.glass_spp)
    told, cover = Passes(), np.zeros(lens.size**2)
    rng = np.random.default_rng(4)
    for _ in range(case.settings.view_spp):
        origin, direction = lens.rays(rng)
        hits = case.subject.surface.intersect(origin, direction)
        query = hits.position, hits.normal, -direction[hits.index]
        value = np.ones((lens.size**2, 3))
        value[hits.index] = case.subject.transmittance(*query)
        cover[hits.index] += 1
        told.add(value.reshape(lens.size, lens.size, 3))
    mask = (2 * cover >= case.settings.view_spp).reshape(lens.size, lens.size)
    return told.picture(), true, mask
