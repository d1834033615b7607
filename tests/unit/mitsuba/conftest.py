"""Mitsuba's variant, and the analytic lamps, for every test of the runtime."""

from __future__ import annotations

import sys
from pathlib import Path

from purelight_mitsuba import use

use()
sys.path.append(str(Path(__file__).parent))
