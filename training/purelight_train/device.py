"""Where training computes."""

from __future__ import annotations

from purelight_mitsuba import platform
from purelight_train import threads


def begin(device: str, count: int) -> str:
    """Choose the device, Mitsuba's variant that goes with it, and the processor's threads.

    Call it before anything imports Torch, or what belongs to a variant.

    Arguments:
        device: `cpu`, `cuda`, or `auto`, which is `cuda` where there is one.
        count: threads.

    Returns:
        `cpu` or `cuda`.

    Raises:
        PureLightError: the variant does not start here.
    """
    threads.use(count)
    import torch

    if device == "auto":
        device = "cuda" if torch.cuda.is_available() else "cpu"
    platform.use("llvm_ad_rgb" if device == "cpu" else "cuda_ad_rgb")
    threads.use_for_tracing(count)
    return device
