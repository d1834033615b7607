"""The instances of a `PointInstancer`: which prototypes are where."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray


def instances(
    prim: Any, time: Any, note: Callable[[Any, str], None]
) -> Iterator[tuple[Any, NDArray[np.float64]]]:
    """Each prototype that is shown, and its instances.

    Ids that are invisible or inactive are left out.

    Arguments:
        prim: The instancer.
        time: A `Usd.TimeCode`.
        note: Is told of what is not shown as the prim says.

    Returns:
        The root prim of a prototype, and [N, 4, 4] from its own frame to the instancer's, for
        column vectors.
    """
    from pxr import UsdGeom

    instancer = UsdGeom.PointInstancer(prim)
    at = _numeric(instancer, time)
    prototypes = instancer.GetPrototypesRel().GetForwardedTargets()
    chosen = np.asarray(instancer.GetProtoIndicesAttr().Get(at) or [], np.int64)
    if not len(chosen):
        return
    if not 0 <= chosen.min() <= chosen.max() < len(prototypes):
        note(prim, "an index names no prototype; the instancer was left out")
        return
    mask = np.asarray(instancer.ComputeMaskAtTime(at) or np.ones(len(chosen)), bool)
    places = _transforms(instancer, at, len(chosen))
    if places is None or len(mask) != len(chosen):
        note(prim, "its arrays are not of one length; the instancer was left out")
        return
    if _varies(prim):
        note(prim, "primvars of single instances are not supported and were ignored")
    for index, path in enumerate(prototypes):
        prototype = prim.GetStage().GetPrimAtPath(path)
        own = places[mask & (chosen == index)]
        if not len(own):
            continue
        if not prototype or _invisible(prototype, time):
            note(prim, f"its prototype {path} is missing or invisible and was left out")
            continue
        yield prototype, own @ _local(prototype, time)


def _numeric(instancer: Any, time: Any) -> Any:
    """A time at which velocities can be reckoned with: the first sample's for the earliest."""
    from pxr import Usd

    if not time.IsEarliestTime():
        return time
    sampled = (instancer.GetPositionsAttr(), instancer.GetProtoIndicesAttr())
    starts = [samples[0] for a in sampled if (samples := a.GetTimeSamples())]
    return Usd.TimeCode(max(starts)) if starts else Usd.TimeCode.Default()


def _transforms(instancer: Any, time: Any, count: int) -> NDArray[np.float64] | None:
    """[N, 4, 4] for column vectors, without those of the prototypes; None if there are not N."""
    from pxr import UsdGeom

    kind = UsdGeom.PointInstancer
    positions = instancer.GetPositionsAttr().Get(time)
    if positions is None or len(positions) != count:
        return None
    found = instancer.ComputeInstanceTransformsAtTime(
        time, time, kind.ExcludeProtoXform, kind.IgnoreMask
    )
    if len(found) != count:
        return None
    matrices = np.array(found).reshape(-1, 4, 4).swapaxes(1, 2)
    return matrices if np.isfinite(matrices).all() else None


def _local(prototype: Any, time: Any) -> NDArray[np.float64]:
    """The transform of a prototype's own root."""
    from pxr import UsdGeom

    xformable = UsdGeom.Xformable(prototype)
    return np.array(xformable.GetLocalTransformation(time)).T if xformable else np.eye(4)


def _invisible(prim: Any, time: Any) -> bool:
    from pxr import UsdGeom

    imageable = UsdGeom.Imageable(prim)
    return bool(imageable) and imageable.ComputeVisibility(time) == UsdGeom.Tokens.invisible


def _varies(prim: Any) -> bool:
    """Whether a primvar has a value for each instance."""
    from pxr import UsdGeom

    primvars = UsdGeom.PrimvarsAPI(prim).GetPrimvarsWithAuthoredValues()
    return any(str(p.GetInterpolation()) not in ("constant", "uniform") for p in primvars)
