"""The emitter plugin of `rays`. Import it once a variant of Mitsuba is set."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from purelight_train.light.plugins import ray_file_plugin

RayFileEmitter: Any = ray_file_plugin()


class ReplayEmitter(RayFileEmitter):
    """A ray file whose power grows with the square of the lamp's size, as that of our bundles."""

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self._scale *= self.placement.scale**2
        dr.make_opaque(self._scale)
