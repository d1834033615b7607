"""What the makers of a scene's lamps say about the mode in which it is rendered."""

from __future__ import annotations

import mitsuba as mi

from purelight_format.issues import plain
from purelight_format.verdict.figures import read
from purelight_format.verdict.words import judge
from purelight_mitsuba.lamps.emitter import PureLightEmitter


def against_fast_mode(scene: mi.Scene) -> list[str]:
    """One line for each bundle whose verdict does not recommend fast mode."""
    lamps = {e.luminaire.path: e.luminaire for e in scene.emitters() if _is_lamp(e)}
    lines = []
    for path, lamp in lamps.items():
        found = read(lamp.manifest.fidelity.get("verdict"))
        judgement = found and judge(found, lamp.manifest.provenance)
        if judgement and judgement.fast is False:
            lines.append(
                f"{plain(path.name)}: its maker says, {judgement.on_fast}; "
                "accurate mode would be right here"
            )
    return lines


def _is_lamp(emitter: mi.Emitter) -> bool:
    return isinstance(emitter, PureLightEmitter)
