"""Read, write and validate PureLight bundles: neural luminaires as one file, `lamp.plux`."""

from __future__ import annotations

__version__ = "0.1.0"

from purelight_format.bundle import Bundle, write
from purelight_format.errors import PureLightError, SpoiltWarning
from purelight_format.issues import FormatError, Issue
from purelight_format.limits import LIMITS, Limits
from purelight_format.measures import BoundingSphere
from purelight_format.members.manifest import Manifest, NetworkInfo
from purelight_format.members.surface import Surface
from purelight_format.networks.vectors import Vectors, compare
from purelight_format.validation.report import Report
from purelight_format.validation.validate import validate

__all__ = [
    "LIMITS", "BoundingSphere", "Bundle", "FormatError", "Issue", "Limits", "Manifest",
    "NetworkInfo", "PureLightError", "Report", "SpoiltWarning", "Surface", "Vectors", "compare",
    "validate", "write",
]  # fmt: skip
