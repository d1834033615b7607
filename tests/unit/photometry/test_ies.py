"""IES files as they come, made from one table in many odd ways."""

from __future__ import annotations

import numpy as np
import pytest
from photompy import IESFile

from purelight_format.errors import PureLightError
from purelight_format.photometry.opening import BALL, BOX, DRUM
from purelight_format.photometry.reader import ies_photometry, read_ies
from purelight_format.photometry.table import IntensityTable
from tests.support.distributions import ies, skewed

TABLE = skewed()
TEXT = ies(TABLE)


def same(data: bytes, factor: float = 1.0) -> None:
    """The file holds the table."""
    found = ies_photometry(data, "lamp").table
    np.testing.assert_allclose(found.candela, TABLE.candela * factor, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(found.horizontal, TABLE.horizontal)


def broken_lines(text: str, words: int) -> str:
    """The numbers in lines of so many, wherever they fall."""
    head, _, tail = text.partition("TILT=NONE\n")
    numbers = tail.split()
    lines = [" ".join(numbers[k : k + words]) for k in range(0, len(numbers), words)]
    return head + "TILT=NONE\n" + "\n".join(lines) + "\n"


ODD = {
    "crlf": TEXT.replace("\n", "\r\n").encode(),
    "cr": TEXT.replace("\n", "\r").encode(),
    "mixed ends": TEXT.replace("\n", "\r\n", 5).encode(),
    "tabs": TEXT.replace(" ", "\t").encode(),
    "commas": TEXT.replace(" ", ",").encode(),
    "commas and blanks": TEXT.replace(" ", " , ").encode(),
    "byte order mark": b"\xef\xbb\xbf" + TEXT.encode(),
    "utf-16": TEXT.encode("utf-16"),
    "latin-1": TEXT.replace("] Lamp", "] Lämp für Büros").encode("latin-1"),
    "numbers one a line": broken_lines(TEXT, 1).encode(),
    "numbers seven a line": broken_lines(TEXT, 7).encode(),
    "trailing words": (TEXT + "\nEND OF FILE\nsome words 1 2 3\n").encode(),
    "trailing numbers": (TEXT + "0 0 0 0\n").encode(),
    "dos end": (TEXT + "\x1a\0\0\0").encode(),
    "blank lines": TEXT.replace("TILT=NONE\n", "\n\n  TILT=NONE\n\n\n").encode(),
    "spaced tilt": TEXT.replace("TILT=NONE", "tilt = none ").encode(),
    "no keywords": ies(TABLE, head=("IESNA:LM-63-1995",)).encode(),
    "1986": ies(TABLE, head=("A LAMP OF 1986", "REPORT 12")).encode(),
    "no head at all": ies(TABLE, head=()).encode(),
    "1991": ies(TABLE, head=("IESNA91", "[TEST] 1", "[MANUFAC] x")).encode(),
    "2002": ies(TABLE, head=("IESNA:LM-63-2002",)).encode(),
    "simulated": ies(TABLE, factors=(1.0, 1.0, 1.0001)).encode(),
    "accredited": ies(TABLE, factors=(1.0, 1.0, 1.1)).encode(),
    "exponents": TEXT.replace(" 40\n", " 4.0E+01\n").encode(),
    "fortran": TEXT.replace(" 40\n", " 4.0D+01\n").encode(),
    "feet": ies(TABLE, units=1).encode(),
}  # fmt: skip


@pytest.mark.parametrize("data", ODD.values(), ids=ODD)
def test_odd_files_hold_the_same_table(data: bytes) -> None:
    same(data)


def test_names_survive() -> None:
    assert ies_photometry(ODD["latin-1"], "file").name == "Lämp für Büros"
    assert ies_photometry(ODD["1986"], "file").name == "file"


def test_factors_multiply() -> None:
    same(ies(TABLE, factors=(2.0, 0.5, 3.0)).encode())
    same(ies(TABLE, head=("IESNA91",), factors=(2.0, 0.5, 3.0)).encode(), 3.0)


def test_tilt_is_skipped_and_said() -> None:
    block = "INCLUDE\n2\n3\n0 90 180\n1 0.9 0.8"
    same(ies(TABLE, tilt=block).encode())
    (note,) = ies_photometry(ies(TABLE, tilt=block).encode(), "lamp").notes
    assert "TILT=INCLUDE is not applied" in note
    (note,) = ies_photometry(ies(TABLE, tilt="ballast.tlt").encode(), "lamp").notes
    assert "BALLAST.TLT" in note


def test_what_a_bundle_carries_is_strict() -> None:
    for odd in (ies(TABLE, tilt="INCLUDE\n1\n1\n0\n1"), ies(TABLE, kind=2)):
        with pytest.raises(PureLightError, match="its photometry"):
            read_ies(odd.encode(), "lamp.plux")


def test_decimal_commas() -> None:
    lamp = ies_photometry(TEXT.replace(".", ",").replace("LM-63", "LM-63.").encode(), "lamp")
    np.testing.assert_allclose(lamp.table.candela, TABLE.candela, rtol=1e-6)
    assert "decimal points" in lamp.notes[0]


def decimal_commas(*, lines: slice, text: str = TEXT) -> bytes:
    """The text with decimal commas in some of its lines behind TILT."""
    head, _, tail = text.partition("TILT=")
    rows = tail.split("\n")
    rows[lines] = [row.replace(".", ",") for row in rows[lines]]
    return (head + "TILT=" + "\n".join(rows)).encode()


SIMPLE = TEXT.replace("1 -1 1.0 37", "1 -1 1 37").replace("1.0 1.0 40\n", "1 1 40.5\n")
TILTED = ies(TABLE, tilt="INCLUDE\n1\n3\n0 90 180\n1.0 0.9 0.8")


@pytest.mark.parametrize(
    ("lines", "text"),
    [(slice(5, None), SIMPLE), (slice(0, None), SIMPLE), (slice(3, None), SIMPLE),
     (slice(2, 3), SIMPLE), (slice(4, 5), TILTED), (slice(0, None), TILTED)],
    ids=["candela", "everywhere", "angles and candela", "watts", "tilt", "tilt and everywhere"],
)  # fmt: skip
def test_decimal_commas_that_would_pass_as_more_numbers(lines: slice, text: str) -> None:
    lamp = ies_photometry(decimal_commas(lines=lines, text=text), "lamp")
    np.testing.assert_allclose(lamp.table.candela, TABLE.candela, rtol=1e-6)
    assert lamp.watts == ies_photometry(text.encode(), "lamp").watts
    assert "commas are taken as decimal points" in lamp.notes


def test_angles_in_disorder_are_put_in_order() -> None:
    back = IntensityTable(TABLE.vertical[::-1], TABLE.horizontal, TABLE.candela[:, ::-1])
    lamp = ies_photometry(ies(back).encode(), "lamp")
    np.testing.assert_allclose(lamp.table.candela, TABLE.candela, rtol=1e-6)
    assert "put in order" in lamp.notes[0]


def test_negative_intensities_are_dark_and_said() -> None:
    dark = IntensityTable(TABLE.vertical, TABLE.horizontal, TABLE.candela - 200)
    lamp = ies_photometry(ies(dark).encode(), "lamp")
    assert lamp.table.candela.min() == 0
    assert "negative" in lamp.notes[0]


@pytest.mark.parametrize(
    ("size", "shape", "dimensions"),
    [("0.3 1.2 0.1", BOX, (1.2, 0.3, 0.1)), ("-0.3 -0.3 0", DRUM, (0.3, 0.3, 0)),
     ("-0.3 -0.3 -0.3", BALL, (0.3, 0.3, 0.3)), ("-0.3 0 0", DRUM, (0.3, 0.3, 0)),
     ("-0.3 -0.3 0.2", DRUM, (0.3, 0.3, 0.2)), ("0 0 0", BOX, (0, 0, 0))],
)  # fmt: skip
def test_openings(size: str, shape: str, dimensions: tuple[float, float, float]) -> None:
    opening = ies_photometry(ies(TABLE, size=size).encode(), "lamp").opening
    assert opening.shape == shape
    assert (opening.width, opening.length, opening.heights[0]) == dimensions
    feet = ies_photometry(ies(TABLE, size=size, units=1).encode(), "lamp").opening
    assert feet.width == pytest.approx(opening.width * 0.3048)


@pytest.mark.parametrize(
    ("text", "message"),
    [("", "no line TILT"), ("<html>TILT</html>", "no line TILT"), ("TILT=NONE\n", "0 numbers"),
     (TEXT[:-40], "announces"), (ies(TABLE, kind=7), "type 7"),
     (ies(TABLE, tilt="INCLUDE"), "TILT"),
     (TEXT.replace(" 37 25 ", " 99999999 99999999 "), "may be"),
     (TEXT.replace(" 37 25 ", " 37.5 25 "), "37.5 vertical"),
     (TEXT.replace(" 37 25 ", " -3 -8 "), "-3 vertical"),
     (TEXT.replace(" 37 25 ", " 1e300 25 "), "numbers")],
)  # fmt: skip
def test_what_is_no_ies_file_is_refused_in_a_line(text: str, message: str) -> None:
    with pytest.raises(PureLightError, match=f"lamp.ies: .*{message}"):
        ies_photometry(text.encode(), "lamp.ies")


def test_another_library_finds_the_same_flux() -> None:
    for horizontal in ([0.0], [0.0, 30, 60, 90], np.linspace(0, 180, 13), np.linspace(0, 360, 25)):
        kind = 1 if len(horizontal) == 1 else 4 if horizontal[-1] == 90 else 2
        data = ies(skewed(np.array(horizontal, float), kind)).encode()
        other = IESFile.read(data).photometry.total_optical_power()
        assert ies_photometry(data, "lamp").table.flux == pytest.approx(other, rel=0.005)


def gaussian(kind: int, vertical: np.ndarray, horizontal: np.ndarray) -> IntensityTable:
    """A beam about the axis, wider in the horizontal angle, in a table of type A or B."""
    y, x = np.radians(vertical), np.radians(horizontal)[:, None]
    if kind == 3:
        right, up = np.cos(y) * np.sin(x), np.sin(y) + 0 * x
    else:
        right, up = np.sin(x) + 0 * y, np.cos(x) * np.sin(y)
    values = 1e4 * np.exp(-((right / 0.4) ** 2) - (up / 0.2) ** 2)
    return IntensityTable(vertical, horizontal, values)


@pytest.mark.parametrize("kind", [2, 3])
@pytest.mark.parametrize("begin", [-90, 0])
def test_types_a_and_b_become_type_c(kind: int, begin: int) -> None:
    angles = np.linspace(begin, 90, (90 - begin) + 1)
    found = ies_photometry(ies(gaussian(kind, angles, angles), kind=kind).encode(), "x").table
    theta, phi = np.array([0.0, 10, 20, 20, 20, 20]), np.array([0.0, 0, 0, 180, 90, 225])
    up = np.sin(np.radians(theta)) * np.cos(np.radians(phi))
    right = -np.sin(np.radians(theta)) * np.sin(np.radians(phi))
    wanted = 1e4 * np.exp(-((right / 0.4) ** 2) - (up / 0.2) ** 2)
    np.testing.assert_allclose(found.at(theta, phi), wanted, rtol=0.01)
    side = (np.arange(2000) + 0.5) / 1000 - 1
    x, y = np.meshgrid(side, side)
    inside = x**2 + y**2 < 1
    down = np.sqrt(np.where(inside, 1 - x**2 - y**2, 1))
    flux = (1e4 * np.exp(-((x / 0.4) ** 2) - (y / 0.2) ** 2) * inside / down).sum() * 1e-6
    assert found.flux == pytest.approx(flux, rel=0.01)
    assert found.at(np.array([120.0]), np.array([0.0]))[0] == 0


@pytest.mark.parametrize("kind", [2, 3])
@pytest.mark.parametrize(
    ("vertical", "horizontal", "azimuth"), [(30, 0, 0), (-30, 0, 180), (0, 30, 270), (0, -30, 90)]
)
def test_types_a_and_b_turn_as_lm_63_has_them(
    kind: int, vertical: int, horizontal: int, azimuth: int
) -> None:
    """V 90 at H 0 is the horizontal of plane 0, in which the length of the opening lies."""
    angles = np.linspace(-90, 90, 91)
    one = np.zeros((91, 91))
    one[(horizontal + 90) // 2, (vertical + 90) // 2] = 100
    text = ies(IntensityTable(angles, angles, one), kind=kind)
    table = ies_photometry(text.encode(), "x").table
    brightest = table.at(np.full(4, 30.0), np.array([0.0, 90, 180, 270]))
    assert 90 * int(brightest.argmax()) == azimuth
    assert brightest.max() > 50
    assert sorted(brightest)[2] == 0


@pytest.mark.parametrize(
    ("edition", "factor"),
    [("IESNA91", 0.5), ("IESNA:LM-63-1995", 1), ("IESNA:LM-63-2002", 1), ("IES:LM-63-2019", 1)],
)
def test_the_twelfth_number_is_a_factor_before_1995(edition: str, factor: float) -> None:
    even = IntensityTable(np.linspace(0, 90, 10), np.zeros(1), np.full((1, 10), 100.0))
    lines = ies(even).splitlines()
    lines[0] = edition
    place = next(k for k, line in enumerate(lines) if line.startswith("TILT")) + 2
    words = lines[place].split()
    lines[place] = " ".join([words[0], "0.5", *words[2:]])
    found = ies_photometry("\n".join(lines).encode(), "x").table
    assert found.flux == pytest.approx(factor * 200 * np.pi, rel=1e-3)
