"""The conformance suite: vectors for every host, and the command that puts them to one."""

from __future__ import annotations

from purelight_conformance.maker import make, of_bundle
from purelight_conformance.protocol import serve
from purelight_conformance.runner import Report, run
from purelight_conformance.suite import Suite

__all__ = ["Report", "Suite", "make", "of_bundle", "run", "serve"]
