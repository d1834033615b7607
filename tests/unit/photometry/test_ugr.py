"""Glare ratings, and light in rooms, against what is known of them."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.opening import BALL, DRUM, POINT, Opening
from purelight_format.photometry.room import direct_shares, parallel_view_factor, received
from purelight_format.photometry.table import IntensityTable
from purelight_format.photometry.ugr import ROOMS, UgrTable, position_index
from tests.support.distributions import VERTICAL, lambertian, skewed

PANEL = Opening(0.6, 0.6)


def test_view_factor_of_a_cube_and_of_a_wide_room() -> None:
    assert parallel_view_factor(1, 1) == pytest.approx(0.19982, abs=1e-5)
    assert parallel_view_factor(1000, 1000) == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize(
    ("x", "y", "reflectance", "factors"),
    [(2, 2, (0.2, 0.5, 0.7), (0.220, 0.422, 0.646)), (4, 8, (0.2, 0.5, 0.7), (0.115, 0.211, 0.307)),
     (12, 8, (0.2, 0.3, 0.3), (0.049, 0.059, 0.069))],
)  # fmt: skip
def test_transfer_factors_are_those_of_cie_190(
    x: float, y: float, reflectance: tuple[float, ...], factors: tuple[float, ...]
) -> None:
    """Flux on the walls in the end, of flux that falls on floor, walls (besides) and ceiling."""
    a, b, c = reflectance
    ends = [received(tuple(row), (a, b, c), x, y)[1] for row in np.eye(3)]  # type: ignore[arg-type]
    np.testing.assert_allclose(np.array(ends) - [0, 1, 0], factors, atol=6e-4)


def test_no_light_is_lost_between_white_surfaces() -> None:
    lit = received((0.5, 0.3, 0.2), (0.8, 0.8, 0.8), 3.0, 5.0)
    assert 0.2 * lit.sum() == pytest.approx(1)  # All of it is absorbed in the end.


def test_direct_light_of_even_ceilings_is_the_view_factor() -> None:
    lamp = lambertian(1000, PANEL)
    floor, walls, ceiling = direct_shares(lamp.table, 3.0, 5.0)
    assert floor == pytest.approx(parallel_view_factor(3, 5), abs=2e-3)
    assert (floor + walls, ceiling) == (pytest.approx(1), pytest.approx(0, abs=1e-9))


def test_uplight_reaches_the_ceiling() -> None:
    lamp = lambertian(1000, PANEL)
    up = IntensityTable(VERTICAL, np.zeros(1), lamp.table.candela[:, ::-1])
    assert direct_shares(up, 3.0, 5.0)[2] == pytest.approx(1)


def test_position_index_is_near_the_table_of_cie_117() -> None:
    up = np.array([0.0, 1.0, 0.5, 0.0, 1.0, 1.9, 0.3])
    aside = np.array([0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 2.0])
    known = np.array([1.00, 7.00, 2.91, 2.11, 7.00, 16.0, 4.90])
    np.testing.assert_allclose(position_index(up, aside), known, rtol=0.08)


def test_brighter_and_smaller_lamps_glare_more() -> None:
    table = UgrTable.of(lambertian(1000, PANEL)).values
    twice = UgrTable.of(lambertian(2000, PANEL)).values
    np.testing.assert_allclose(twice - table, 8 * np.log10(2))
    small = UgrTable.of(lambertian(1000, Opening(0.3, 0.3))).values
    np.testing.assert_allclose(small - table, 8 * np.log10(4))


def test_the_table_by_hand() -> None:
    """One room, summed luminaire by luminaire in plain Python."""
    lamp = replace(lambertian(1000, PANEL), table=skewed().scaled(3))
    x, y = 4, 3
    glare = 0.0
    for i in range(16):
        for k in range(12):
            aside, depth = (i + 0.5) * 0.25 - 2, (k + 0.5) * 0.25
            gamma = np.degrees(np.arctan(np.hypot(aside, depth)))
            if 1 / depth > 1.9 or abs(aside) / depth > 3 or gamma > 85:
                continue
            plane = np.degrees(np.arctan2(aside, depth)) % 360
            intensity = lamp.table.at(np.array([gamma]), np.array([plane]))[0]
            area, square = 0.36 * np.cos(np.radians(gamma)), 4 * (1 + aside**2 + depth**2)
            index = position_index(np.array([1 / depth]), np.array([aside / depth]))[0]
            luminance, angle = intensity / area, area / square
            glare += luminance**2 * angle / index**2
    direct = direct_shares(lamp.table, x, y)
    indirect = received(direct, (0.2, 0.5, 0.7), x, y)[1] - direct[1]
    background = lamp.table.flux * 192 * indirect / (2 * 4 * (x + y)) / np.pi
    found = UgrTable.of(lamp).values[ROOMS.index((x, y)), 0]
    assert found == pytest.approx(8 * np.log10(0.25 / background * glare), abs=1e-6)


def test_crosswise_and_endwise_differ_as_the_lamp_is_turned() -> None:
    wide = replace(lambertian(1000, PANEL), table=skewed(kind=4))
    around, rows = wide.table.whole
    turned = replace(wide, table=IntensityTable(VERTICAL, around, np.roll(rows[:-1], 6, 0)[
        np.arange(len(around)) % (len(around) - 1)]))  # fmt: skip
    one, other = UgrTable.of(wide).values, UgrTable.of(turned).values
    assert abs(one[:, :5] - one[:, 5:]).max() > 0.2
    square = [k for k, (x, y) in enumerate(ROOMS) if x == y]
    np.testing.assert_allclose(one[square, :5], other[square, 5:], atol=1e-6)


def test_a_point_and_a_dark_lamp_have_no_rating() -> None:
    with pytest.raises(PureLightError, match="luminous area"):
        UgrTable.of(lambertian(1000, POINT))
    with pytest.raises(PureLightError, match="without light"):
        UgrTable.of(lambertian(0, PANEL))


def test_the_table_is_said() -> None:
    table = UgrTable.of(lambertian(3000, PANEL))
    lines = table.to_text().split("\n")
    assert len(lines) == 4 + 19
    assert lines[4].split()[:2] == ["2H", "2H"]
    assert json.loads(json.dumps(table.to_json()))["crosswise"][3][2] == round(
        table.values[3, 2], 2
    )
    assert "<10" in UgrTable.of(lambertian(1, PANEL)).to_text()


def test_projected_areas() -> None:
    at = np.array([0.0, 90.0, 90.0, 60.0]), np.array([0.0, 0.0, 90.0, 45.0])
    box = Opening(1.0, 2.0, (0.1, 0.2, 0.3, 0.4)).projected_area(*at)
    sine, diagonal = np.sqrt(3) / 2, np.sqrt(0.5)
    slanted = 2 * 0.5 + sine * diagonal * (2 * 0.1 + 1 * 0.2)
    np.testing.assert_allclose(box, [2, 0.2, 0.2, slanted])
    drum = Opening(1.0, 1.0, (0.5,) * 4, DRUM).projected_area(*at)
    np.testing.assert_allclose(drum[:3], [np.pi / 4, 0.5, 0.5])
    ball = Opening(1.0, 1.0, (1.0,) * 4, BALL).projected_area(*at)
    np.testing.assert_allclose(ball, np.pi / 4)


def test_crosswise_is_at_right_angles_to_the_length_of_each_format() -> None:
    """A batten of 1.2 m by 0.1 m: along C90 in EULUMDAT, along horizontal 0 in IES."""
    light = lambertian(2000, PANEL).table
    long, wide = Opening(0.1, 1.2), Opening(1.2, 0.1)
    of_ldt = UgrTable.of(LampPhotometry("x", light, long)).values
    of_ies = UgrTable.of(LampPhotometry("x", light, wide, lengthwise=0.0)).values
    np.testing.assert_allclose(of_ies, of_ldt, atol=1e-9)
    swapped = UgrTable.of(LampPhotometry("x", light, wide)).values
    np.testing.assert_allclose(swapped[:, :5], of_ldt[:, 5:], atol=1e-9)
    opened = Opening(0.1, 1.2, (0.05,) * 4)
    higher = UgrTable.of(LampPhotometry("x", light, opened)).values
    assert not np.allclose(higher[:, :5], higher[:, 5:])
