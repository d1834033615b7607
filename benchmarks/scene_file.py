"""A scene's file, read by Mitsuba on any number of threads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from purelight_mitsuba.platform import reading


def load_scene(path: Path, **options: Any) -> Any:
    """`mi.load_file`, which alone would wait forever for images where there is one thread.

    Spheres that shine are turned upright, as Mitsuba's light tracer is wrong about others.

    Arguments:
        options: of `mi.load_file`.
    """
    import mitsuba as mi

    from purelight_train.light.upright_spheres import turn_upright

    with reading():
        scene = mi.load_file(str(path), **options)
    turn_upright(scene)
    return scene
