"""How Torch's threads wait: beside other busy processes, spinning ones are many times as slow."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from purelight_train.threads import WAITING

PROGRAM = """
import importlib, os, sys

class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "torch":
            print(os.environ.get("OMP_WAIT_POLICY"), os.environ.get("GOMP_SPINCOUNT"))

sys.meta_path.insert(0, Watch())
importlib.import_module(sys.argv[1])
import torch
"""
MODULES = (
    "purelight_train.cli", "purelight_train.runs.pipeline", "purelight_export.cli",
    "purelight_examples.demo", "purelight_examples.gallery.cli", "purelight_catalogue.cli",
    "benchmarks.routes",
)  # fmt: skip


def imported(module: str, **environment: str) -> str:
    """What the environment said of waiting when Torch was first imported."""
    own = {name: value for name, value in os.environ.items() if name not in WAITING}
    words = [sys.executable, "-c", PROGRAM, module]
    run = subprocess.run(words, env=own | environment, capture_output=True, text=True, check=True)
    return run.stdout.splitlines()[0]


@pytest.mark.parametrize("module", MODULES)
def test_every_program_lets_them_sleep(module: str) -> None:
    assert imported(module) == "PASSIVE 1000"


def test_who_chose_otherwise_has_it() -> None:
    assert imported("purelight_export.cli", OMP_WAIT_POLICY="ACTIVE") == "ACTIVE None"
