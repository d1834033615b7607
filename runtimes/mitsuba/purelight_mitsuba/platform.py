"""Finds an LLVM that Dr.Jit can use, checks versions, and chooses the Mitsuba variant."""

from __future__ import annotations

import importlib
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from types import ModuleType

from purelight_format.errors import PureLightError

LLVM_VARIABLE = "DRJIT_LIBLLVM_PATH"
LLVM_DISTRIBUTION = "karellen-llvm-core"
MINIMUM_LLVM = 17
LEAST_THREADS = 2  # with which Mitsuba reads EXR files
MITSUBA = (3, 9)
DRJIT = (1, 5)
INSTALL = 'pip install "purelight[mitsuba]"'


def use(variant: str = "llvm_ad_rgb") -> ModuleType:
    """Sets the Mitsuba variant on a checked platform and registers PureLight's plugins.

    Arguments:
        variant: An RGB variant of Dr.Jit's, `llvm_ad_rgb` or `cuda_ad_rgb`.

    Returns:
        The module `mitsuba`.

    Raises:
        PureLightError: If Mitsuba, Dr.Jit or LLVM is missing or too old, or the variant unknown.
    """
    prepare()
    try:
        mi = importlib.import_module("mitsuba")
    except ImportError as error:
        raise PureLightError(f"Mitsuba cannot be imported ({error}); {INSTALL}") from error
    dr = importlib.import_module("drjit")
    check_versions(mi.__version__, dr.__version__)
    if variant.startswith("llvm"):
        check_llvm()
    if mi.variant() is None:  # for scenes that others read, on a machine of one core
        dr.set_thread_count(max(dr.thread_count(), LEAST_THREADS))
    if mi.variant() != variant:
        _set_variant(mi, variant)
    importlib.import_module("purelight_mitsuba").register()
    return mi


@contextmanager
def reading() -> Iterator[None]:
    """In here Mitsuba can read files, whatever number of threads Dr.Jit has.

    Mitsuba 3.9 reads EXR files by tasks that it leaves to Dr.Jit's other threads and waits for:
    where there is one thread, as on a machine of one core, it waits forever.
    """
    import drjit as dr

    count = dr.thread_count()
    dr.set_thread_count(max(count, LEAST_THREADS))
    try:
        yield
    finally:
        dr.set_thread_count(count)


def prepare() -> None:
    """Points Dr.Jit at the LLVM that PyPI installs, unless the user chose one.

    Dr.Jit looks for LLVM once, when it is first imported, and Dr.Jit 1.5 aborts the whole process
    on LLVM 16 or older: hence this comes first, and nothing happens once it is too late.
    """
    if os.environ.get(LLVM_VARIABLE) or "drjit" in sys.modules:
        return
    library = find_llvm()
    if library is not None:
        os.environ[LLVM_VARIABLE] = str(library)


def find_llvm() -> Path | None:
    """Returns the LLVM library that `karellen-llvm-core` installed, if it did."""
    names = {"linux": "libLLVM.so", "darwin": "libLLVM.dylib", "win32": "LLVM-C.dll"}
    name = names.get(sys.platform, "libLLVM.so")
    try:
        files = metadata.files(LLVM_DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        return None
    paths = (Path(str(file.locate())) for file in files if file.name == name)
    return next((path.resolve() for path in paths if path.is_file()), None)


def check_llvm() -> None:
    """Raises PureLightError unless the LLVM that Dr.Jit loaded can be used."""
    version = importlib.import_module("drjit").detail.llvm_version()
    if version[0] >= MINIMUM_LLVM:
        return
    found = "no LLVM" if version[0] < 0 else f"LLVM {version[0]}"
    library = find_llvm()
    remedy = (
        f"set {LLVM_VARIABLE}={library} before Python starts, or import purelight_mitsuba "
        "before mitsuba and drjit"
        if library is not None
        else f"pip install {LLVM_DISTRIBUTION}"
    )
    raise PureLightError(f"Dr.Jit loaded {found}, but needs {MINIMUM_LLVM} or newer; {remedy}")


def check_versions(mitsuba: str, drjit: str) -> None:
    """Raises PureLightError unless the versions are the ones this package was written for."""
    for name, text, wanted in (("mitsuba", mitsuba, MITSUBA), ("drjit", drjit, DRJIT)):
        found = tuple(int(part) for part in re.findall(r"\d+", text)[:2])
        if found != wanted:
            series = ".".join(map(str, wanted))
            raise PureLightError(f"{name} {text} is installed, but {series}.* is needed; {INSTALL}")


def _set_variant(mi: ModuleType, variant: str) -> None:
    known = [name for name in mi.variants() if name.endswith("_ad_rgb")]
    if variant not in known:
        raise PureLightError(f"variant {variant} cannot be used; choose one of {', '.join(known)}")
    try:
        mi.set_variant(variant)
    except ImportError as error:
        reason = str(error).splitlines()[0]
        raise PureLightError(f"variant {variant} does not start here: {reason}") from error
