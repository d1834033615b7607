"""A lamp in a closed room, and patches of a room inside its bounding sphere."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from benchmarks.past_lamp import past_lamp
from benchmarks.zoo import sheet
from benchmarks.zoo.figures import near, scenes
from benchmarks.zoo.figures.case import Case
from purelight_train.truth.metrics import Comparison
from purelight_train.truth.picture import Picture
from tests.support.fidelity import Figures

GOAL = 0.015  # noise of a patch that is enough
# Times the samples of ours, all of which are taken: whoever ends early where few are very bright,
# as between a lamp's parts, ends where those are missing
MORE = 16
Image = NDArray[np.float64]


def room(case: Case) -> Figures:
    """A closed room in both modes, and by Mitsuba's light tracer where that is right."""
    settings, sphere = case.settings, case.large_sphere
    objects = scenes.room(sphere, settings.room_size)
    mask = past_lamp(mi.load_dict(objects["sensor"]), sphere)
    pictures = {
        mode: scenes.passes(
            objects | case.large.instance(case.subject.bundle),
            {"type": "purelight", "mode": mode}, settings.room_spp,
        )
        for mode in ("accurate", "fast")
    }  # fmt: skip
    variance = {k: _variance(p, pictures["accurate"], mask) for k, p in pictures.items()}
    figures: Figures = {"variance_fast_over_accurate": variance["fast"] / variance["accurate"]}
    if not case.large.light_traceable:
        return figures
    spp = max(settings.room_paths // settings.room_size**2, 8)
    truth = scenes.passes(objects | case.large.lit, case.large.integrator, spp)
    sheet.save(case.large.folder.parent / "room.png", [
        sheet.strip(truth.image, p.image, mask) for p in pictures.values()
    ])  # fmt: skip
    for mode, picture in pictures.items():
        figures[mode] = Comparison(picture, truth, mask).to_dict() | {
            "fireflies": _fireflies(picture.image, mask) / _fireflies(truth.image, mask)
        }
    return figures


def _variance(picture: Picture, usual: Picture, mask: NDArray[np.bool_]) -> float:
    """Relative variance of a picture, over a level that both have."""
    level = usual.image[mask]
    return float((picture.error[mask] ** 2 / (level**2 + (0.1 * level.mean()) ** 2)).mean())


def _fireflies(image: Image, mask: NDArray[np.bool_]) -> float:
    """99.99th percentile over mean."""
    values = image[mask].mean(-1)
    return float(np.quantile(values, 0.9999) / values.mean())


def near_field(case: Case) -> Figures:
    """Irradiance at small places inside the bounding sphere, outside all bodies."""
    settings, sphere = case.settings, case.large_sphere
    results: list[near.Result] = []
    dark = 0
    lamp, integrator = case.ours("accurate")
    for place in near.places(case.large.lit, sphere):
        if len(results) == settings.patches or dark > settings.patches:
            break
        true = _arriving(case, place)
        if not true.image.any():
            dark += 1
            continue
        objects = scenes.patch(place.at, place.normal, place.half)
        told = scenes.passes(objects | lamp, integrator, MORE * settings.patch_spp // 4, 32)
        results.append(near.compared(scenes.of_patch(told), true, place, sphere))
    return near.summary(results, dark)


def _arriving(case: Case, place: near.Place) -> Picture:
    """Irradiance of a place by the real lamp, which has to light it as if nothing was there."""
    lamp, traced = case.large, case.large.light_traceable
    probe = (scenes.pane if traced else scenes.meter)(place.at, place.normal, place.half)
    spp = case.settings.patch_paths // 4
    found = scenes.passes(probe | lamp.lit, lamp.integrator, spp, 32, GOAL)
    return scenes.of_patch(found) if traced else found
