"""The processor cores that training may use, and how its threads wait."""

from __future__ import annotations

import os

from threadpoolctl import ThreadpoolController

# Waiting threads sleep after some microseconds. They spin by default, which next to other busy
# processes makes training many times as slow: a thread that waits at a barrier keeps the one that
# it waits for off its core. Torch reads this when it is first imported.
WAITING = {"OMP_WAIT_POLICY": "PASSIVE", "GOMP_SPINCOUNT": "1000"}
if not os.environ.keys() & WAITING:
    os.environ.update(WAITING)

# OpenBLAS, of which NumPy and SciPy have one each, cannot be told to sleep, so it has one thread:
# beside other busy processes two are many times as slow as one, and the large products of a
# training are Torch's. Libraries that are loaded later read the environment.
SINGLE = {"OPENBLAS_NUM_THREADS": "1"}
if not os.environ.keys() & SINGLE:
    os.environ.update(SINGLE)
    ThreadpoolController().select(internal_api="openblas").limit(limits=1)


def use(count: int) -> None:
    """Give Torch a number of threads."""
    import torch

    torch.set_num_threads(count)


def use_for_tracing(count: int) -> None:
    """Give Dr.Jit as many; call once a variant of Mitsuba is chosen."""
    import drjit

    drjit.set_thread_count(count)
