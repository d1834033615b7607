"""The processor cores that training may use."""

from __future__ import annotations

import os


def use(count: int) -> None:
    """Give Torch a number of threads; call before anything imports Torch.

    Waiting threads sleep. They spin by default, which next to another busy process makes training
    ten times as slow: a thread that waits at a barrier keeps the one it waits for off its core.
    """
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    import torch

    torch.set_num_threads(count)


def use_for_tracing(count: int) -> None:
    """Give Dr.Jit as many; call once a variant of Mitsuba is chosen."""
    import drjit

    drjit.set_thread_count(count)
