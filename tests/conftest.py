"""Settles, before any test imports a library, what must be known before that."""

from __future__ import annotations

import os

from purelight_mitsuba import platform

os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # as purelight_train.threads
platform.prepare()
