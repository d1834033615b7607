"""Where light goes in an empty room: from luminaires all over its ceiling, and between its walls.

The room is a box of floor, ceiling and walls that reflect diffusely; lengths are in its height,
which is that of the luminaires over the plane that counts as the floor.
"""

from __future__ import annotations

import numpy as np

from purelight_format.photometry.table import IntensityTable

VERTICAL, HORIZONTAL = 181, 144  # Directions that a table is summed over.


def direct_shares(table: IntensityTable, x: float, y: float) -> tuple[float, float, float]:
    r"""Parts of the luminaires' flux that reach floor, walls and ceiling directly.

    Of luminaires evenly over the ceiling, the part :math:`(1-|d_x|/x)^+ (1-|d_y|/y)^+` has the
    floor in a direction that leads to a place displaced by d = tan(theta) (cos phi, sin phi). What
    goes upwards reaches the ceiling.

    Arguments:
        x, y: floor size in heights, along C0 and along C90.
    """
    vertical = (np.arange(VERTICAL) + 0.5) * 180 / VERTICAL
    horizontal = (np.arange(HORIZONTAL) + 0.5) * 360 / HORIZONTAL
    theta, phi = np.radians(vertical), np.radians(horizontal)[:, None]
    flux = table.resampled(vertical, horizontal) * np.sin(theta)
    total = float(flux.sum())
    if not total > 0:
        return 0.0, 0.0, 0.0
    down = theta < np.pi / 2
    reach = np.tan(theta[down])
    here = np.clip(1 - np.abs(reach * np.cos(phi)) / x, 0, 1)
    here *= np.clip(1 - np.abs(reach * np.sin(phi)) / y, 0, 1)
    floor = float((flux[:, down] * here).sum()) / total
    ceiling = float(flux[:, ~down].sum()) / total
    return floor, 1 - floor - ceiling, ceiling


def received(
    direct: tuple[float, float, float],
    reflectance: tuple[float, float, float],
    x: float,
    y: float,
) -> np.ndarray:
    """Flux that floor, walls and ceiling receive in the end, directly and by reflection: [3].

    The balance of three diffuse surfaces: received = direct + F' (reflectance * received).

    Arguments:
        direct: what each receives directly, in any unit.
        reflectance: of floor, walls and ceiling.
        x, y: floor size in heights.
    """
    across = parallel_view_factor(x, y)
    to_floor = (1 - across) * x * y / (2 * (x + y))  # From the walls, by reciprocity.
    factors = np.array([
        [0.0, 1 - across, across],
        [to_floor, 1 - 2 * to_floor, to_floor],
        [across, 1 - across, 0.0],
    ])  # fmt: skip
    balance = np.eye(3) - factors.T * np.array(reflectance)
    result: np.ndarray = np.linalg.solve(balance, np.array(direct))
    return result


def parallel_view_factor(x: float, y: float) -> float:
    """Part of the light of a diffuse rectangle that reaches the same one at distance 1 (Hottel)."""
    a, b = np.sqrt(1 + x * x), np.sqrt(1 + y * y)
    total = np.log(a * b / np.sqrt(1 + x * x + y * y))
    total += x * b * np.arctan(x / b) + y * a * np.arctan(y / a)
    total -= x * np.arctan(x) + y * np.arctan(y)
    return float(2 / (np.pi * x * y) * total)
