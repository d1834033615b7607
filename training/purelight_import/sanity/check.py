"""All checks of a lamp's scene."""

from __future__ import annotations

from collections.abc import Iterator

import mitsuba as mi
import numpy as np

from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_import.sanity.glass import glass_doubts
from purelight_import.sanity.light import Leaving, leaving
from purelight_import.sanity.subject import Floats, Subject

SIZES = (0.01, 6.0)  # metres, the largest extent
LUMENS = (1.0, 200_000.0)  # of all emitters
DARK, FAINT = 1e-4, 0.01  # share of the light that leaves
NEEDLES = 5e-3  # as training refuses


def doubts(scene: mi.Scene) -> list[str]:
    """What seems wrong with a lamp, one line each with the remedy; nothing if all seems well.

    Arguments:
        scene: in metres, loaded without Mitsuba's optimisations, which forget names.
    """
    subject = Subject(scene)
    return list(dict.fromkeys([*_size(subject), *glass_doubts(subject), *_light(subject)]))


def _size(subject: Subject) -> Iterator[str]:
    if not SIZES[0] <= subject.extent <= SIZES[1]:
        size = (
            f"{subject.extent:.3g} m" if subject.extent >= 1 else f"{1e3 * subject.extent:.3g} mm"
        )
        yield f"the lamp is {size} across; if that is wrong, say its unit (--units mm, cm, in, ...)"


def _light(subject: Subject) -> Iterator[str]:
    if not subject.scene.emitters():
        return
    infinite = mi.EmitterFlags.Infinite | mi.EmitterFlags.DeltaDirection
    if any(e.is_environment() or mi.has_flag(e.flags(), infinite)
           for e in subject.scene.emitters()):  # fmt: skip
        return  # Training refuses these.
    found = leaving(subject)
    emitted, left = (_lumens(w) for w in (found.emitted, found.left))
    total = float(emitted.sum())
    if total > 0 and not LUMENS[0] <= total <= LUMENS[1]:
        yield (f"the emitters give {total:.3g} lm; if that is wrong, say how much (--lumens 806, "
               "--emitter NAME=806lm)")  # fmt: skip
    yield from _points(subject, found)
    dark = [i for i in np.flatnonzero(emitted > 0) if left[i] <= DARK * emitted[i]]
    if len(dark):
        names = ", ".join(f"'{subject.emitter_name(int(i))}'" for i in dark[:4])
        more = f" and {len(dark) - 4} more" if len(dark) > 4 else ""
        yield (f"no light of emitter {names}{more} leaves the lamp; look whether it faces "
               "inwards, or is covered (--omit what covers it, or make that glass)")  # fmt: skip
    elif total > 0 and left.sum() < FAINT * total:
        yield (f"only {100 * left.sum() / total:.2g} % of the light leaves the lamp; look at the "
               "materials around the emitters")  # fmt: skip


def _points(subject: Subject, found: Leaving) -> Iterator[str]:
    """Point lights whose light leaves in rays that are infinitely thin."""
    needles, all_left = _lumens(found.needles), float(_lumens(found.left).sum())
    if all_left <= 0 or needles.sum() <= NEEDLES * all_left:
        return
    worst = int(needles.argmax())
    share = 100 * needles.sum() / all_left
    yield (f"{share:.3g} % of the light leaves the lamp unscattered from emitters without area, as "
           f"'{subject.emitter_name(worst)}'; it has no radiance: make them small spheres with an "
           "area light, as purelight-import does")  # fmt: skip


def _lumens(watts: Floats) -> Floats:
    """Lumens [E] of W per channel [E, 3]."""
    result: Floats = LUMENS_PER_WATT * watts @ LUMINANCE
    return result
