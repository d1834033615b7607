"""Read, write and validate PureLight bundles: neural luminaires as one file, `lamp.plux`."""

from __future__ import annotations

__version__ = "0.1.0"
