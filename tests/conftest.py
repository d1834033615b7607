"""Settles, before any test imports a library, what must be known before that."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import purelight_train  # noqa: F401 - before Torch: how its threads wait
from purelight_mitsuba import platform

platform.prepare()
import drjit  # noqa: E402 - after what settles how it starts


@pytest.fixture(autouse=True)
def threads_of_dr_jit() -> Iterator[None]:
    """What a test sets ends with it: with one thread, Mitsuba reads no EXR file (`reading`)."""
    before = drjit.thread_count()
    yield
    if drjit.thread_count() != before:
        drjit.set_thread_count(before)
