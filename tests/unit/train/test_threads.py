"""How threads wait: beside other busy processes, spinning ones are many times as slow."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from purelight_train.threads import SINGLE, WAITING

PROGRAM = """
import importlib, os, sys

class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "torch":
            print(os.environ.get("OMP_WAIT_POLICY"), os.environ.get("GOMP_SPINCOUNT"))
            sys.exit()

sys.meta_path.insert(0, Watch())
importlib.import_module(sys.argv[1])
import torch
"""
OPENBLAS = """
import sys
for name in sys.argv[1:]:
    __import__(name)
from threadpoolctl import threadpool_info
print(*(i["num_threads"] for i in threadpool_info() if i["internal_api"] == "openblas"))
"""
MODULES = (
    "purelight_train.cli", "purelight_train.runs.pipeline", "purelight_export.cli",
    "purelight_examples.demo", "purelight_examples.gallery.cli", "purelight_catalogue.cli",
    "benchmarks.routes",
)  # fmt: skip


def printed(program: str, *words: str, **environment: str) -> list[str]:
    """The lines of a program in an environment where nobody chose threads but `environment`."""
    chosen = {*WAITING, *SINGLE, "OMP_NUM_THREADS"}
    own = {name: value for name, value in os.environ.items() if name not in chosen}
    words = (sys.executable, "-c", program, *words)
    run = subprocess.run(words, env=own | environment, capture_output=True, text=True, check=True)
    return run.stdout.splitlines()


def imported(module: str, **environment: str) -> str:
    """What the environment said of waiting when Torch was first imported."""
    return printed(PROGRAM, module, **environment)[0]


@pytest.mark.parametrize("module", MODULES)
def test_every_program_lets_them_sleep(module: str) -> None:
    assert imported(module) == "PASSIVE 1000"


def test_who_chose_otherwise_has_it() -> None:
    assert imported("purelight_export.cli", OMP_WAIT_POLICY="ACTIVE") == "ACTIVE None"


def of_openblas(*modules: str, **environment: str) -> set[str]:
    """How many threads NumPy's and SciPy's OpenBLAS have, where modules are imported in turn."""
    return set(printed(OPENBLAS, *modules, "scipy.linalg", **environment)[0].split())


@pytest.fixture(scope="module")
def may_have_two() -> None:
    """Skips where NumPy or SciPy has another BLAS, or there is one processor."""
    if of_openblas("numpy", OPENBLAS_NUM_THREADS="2") != {"2"}:
        pytest.skip("no OpenBLAS here that could have two threads")


@pytest.mark.usefixtures("may_have_two")
@pytest.mark.parametrize("before", [(), ("numpy",), ("scipy.linalg",)])
@pytest.mark.parametrize("module", ["purelight_train.cli", "purelight_train.runs.pipeline"])
def test_openblas_has_one_thread_whoever_loads_it(before: tuple[str, ...], module: str) -> None:
    assert of_openblas(*before, module) == {"1"}


@pytest.mark.usefixtures("may_have_two")
def test_openblas_keeps_the_threads_that_were_chosen() -> None:
    assert of_openblas("purelight_train.cli", OPENBLAS_NUM_THREADS="2") == {"2"}
