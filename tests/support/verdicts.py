"""The verdict on a lamp that is good in every way."""

from __future__ import annotations

from purelight_format.verdict.figures import Look, Mode, Places, Verdict, Zones

EVEN = Zones(0.0, 0.001, -0.002)
FINE = Verdict(
    photons=1 << 23,
    accurate=Mode(0.03, 0.02, 0.001, 0.98, EVEN),
    share=Zones(0.2, 0.5, 0.3),
    pattern=0.2,
    fast=Mode(0.06, 0.02, -0.002, 0.9, EVEN),
    near=Places(0.04, 0.02, 0.001),
    look=Look(0.01562, 0.95, 0.02, 0.1, 0.05, 0.02),
    grain=1.5,
)
