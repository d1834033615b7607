"""Settles, before any test imports a library, what must be known before that."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator

import pytest

from purelight_mitsuba import platform

os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")  # as purelight_train.threads
platform.prepare()


@pytest.fixture(autouse=True)
def threads_of_dr_jit() -> Iterator[None]:
    """What a test sets ends with it: with one thread, Mitsuba reads no EXR file (`reading`)."""
    dr = sys.modules.get("drjit")
    before = dr.thread_count() if dr else None
    yield
    if dr and dr.thread_count() != before:
        dr.set_thread_count(before)
