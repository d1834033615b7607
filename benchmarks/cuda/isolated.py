"""Work in a process of its own, in which one variant is set, and a crash is one error."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import sys
from importlib import import_module
from typing import Any

from purelight_format.errors import PureLightError
from purelight_mitsuba.platform import use

LIMIT, PARTING = 900, 10  # Seconds.
WORK = "benchmarks.cuda.on_device"
DRIVER = ("DRJIT_LIBCUDA_PATH", "libcuda.so.1")
OPTIX = ("DRJIT_LIBOPTIX_PATH", "libnvoptix.so.1")


def call(variant: str, name: str, *arguments: Any) -> Any:
    """Calls a function of `on_device` in a process of its own.

    Raises:
        PureLightError: If it raises, crashes or takes too long; and what it says.
    """
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(sender, variant, name, arguments))
    process.start()
    sender.close()
    try:
        if not receiver.poll(LIMIT):
            raise PureLightError(f"{variant}: not done after {LIMIT} s")
        done, result = receiver.recv()
        process.join(PARTING)
    except EOFError:
        process.join()
        raise PureLightError(f"{variant}: crashed with exit code {process.exitcode}") from None
    finally:
        process.kill()
    if not done:
        raise PureLightError(result)
    return result


def _child(sender: Any, variant: str, name: str, arguments: tuple[Any, ...]) -> None:
    try:
        require_device(variant)
        use(variant).set_log_level(import_module("mitsuba").LogLevel.Error)
        sender.send((True, getattr(import_module(WORK), name)(*arguments)))
    except Exception as error:  # Every kind is told by the parent.
        known = isinstance(error, PureLightError)
        text = str(error) if known else f"{type(error).__name__}: {error}"
        sender.send((False, text.splitlines()[0]))


def require_device(variant: str) -> None:
    """Looks for what a CUDA variant needs of the machine.

    Raises:
        PureLightError: Saying what is missing.
    """
    if not variant.startswith("cuda"):
        return
    dr = import_module("drjit")
    if not dr.has_backend(dr.JitBackend.CUDA):
        driver = _loads(*DRIVER)
        raise PureLightError(
            f"{variant}: no CUDA: the NVIDIA driver is there, but Dr.Jit finds no GPU, or needs a "
            "newer driver (R570); see nvidia-smi"
            if driver
            else f"{variant}: no CUDA: {DRIVER[1]} of the NVIDIA driver is missing; install the "
            f"driver (R570 or newer), or set {DRIVER[0]}"
        )
    if not _loads(*OPTIX):
        raise PureLightError(
            f"{variant}: no OptiX: {OPTIX[1]} of the NVIDIA driver is missing; install the "
            "driver's ray-tracing part (in a container NVIDIA_DRIVER_CAPABILITIES=all), or set "
            f"{OPTIX[0]}"
        )


def _loads(variable: str, library: str) -> bool:
    """Whether a library of the driver is there; only Linux has a fixed name for it."""
    if sys.platform != "linux":
        return True
    try:
        ctypes.CDLL(os.environ.get(variable, library))
    except OSError:
        return False
    return True
