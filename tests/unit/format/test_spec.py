"""The specification and the code say the same."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from purelight_format.issues import CODES
from purelight_format.limits import LIMITS, MIB
from purelight_format.networks.cost import (
    CALL,
    DISTANT,
    ELEMENT,
    FLOAT_REMAINDER,
    INTEGER_DIVISION,
    LARGE_TABLE,
    NAME,
    PRODUCT,
)
from purelight_format.networks.kinds import KINDS
from purelight_format.networks.operators import OPERATORS
from purelight_format.networks.profile import IR_VERSION, OPSET
from purelight_format.networks.vectors import SIGNATURES
from purelight_format.networks.wire import FIELDS_EACH
from purelight_format.usd.text import COMPOSING, LAYER_FIELDS, PRIM_FIELDS, PROPERTY_FIELDS
from purelight_format.validation.validate import validate
from tests.assets import example_page
from tests.support import smallest

ROOT = Path(__file__).parents[3]
SPEC = ROOT / "spec"
PAGES = sorted(SPEC.glob("*.md"))


def rule(page: str, anchor: str) -> str:
    text = (SPEC / page).read_text()
    found = re.search(rf'<a id="{anchor}"></a>(.*?)(?=<a id=|\Z)', text, re.DOTALL)
    assert found is not None
    return found[1]


def table(text: str) -> list[list[str]]:
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def shapes(cell: str) -> dict[str, tuple[int, ...]]:
    """Names and shapes of a sample from a cell such as: `point` [N, 3], `u` [N, 2]."""
    tensors = re.findall(r"`(\w+)` \[N(.*?)\]", cell)
    return {name: tuple(map(int, re.findall(r"\d+", sizes))) for name, sizes in tensors}


def test_the_operators_are_those_of_the_table() -> None:
    named = [op for row in table(rule("onnx_profile.md", "n10")) for op in row[1].split()]
    assert sorted(named) == sorted(OPERATORS)


def test_the_work_of_operators_is_that_of_the_table() -> None:
    stated = {}
    for rate, cell in table(rule("onnx_profile.md", "n14")):
        for op in cell.split(";")[0].split():
            stated[op] = float(rate)
    assert {op: stated.get(op) for op in ELEMENT} == ELEMENT | {"Gather": DISTANT}
    text = rule("onnx_profile.md", "n14")
    assert f"takes {CALL:.0f} ns, {NAME:.0f} ns for each name" in text
    assert f"{PRODUCT} ns for each multiply-add" in text
    assert f"| {INTEGER_DIVISION:.0f} | Asin Atan Cos Sin; Div and Mod of integers |" in text
    assert f"| {ELEMENT['Gather']:.0f} | Gather GatherElements |" in text
    assert f"| {DISTANT:.0f} | Gather from a table of more than {LARGE_TABLE:,} elements |" in text
    assert f"| {FLOAT_REMAINDER:.0f} | Mod of float32 |" in text


def test_the_networks_are_those_of_the_table() -> None:
    text = (SPEC / "onnx_profile.md").read_text().split("## The model")[0]
    rows = {name.strip("`"): row for name, *row in table(text)}
    stated = {name: tuple(map(shapes, sides)) for name, (_, *sides) in rows.items()}
    assert stated == {name: tuple(signature) for name, signature in SIGNATURES.items()}
    for name, (needed, *_) in rows.items():
        assert (needed == "always") == KINDS[name].required
        needing = [f"`{other}`" for other, kind in KINDS.items() if name in kind.needs]
        assert re.findall(r"`\w+`", needed) == needing


@pytest.mark.parametrize(
    ("page", "anchor", "figures"),
    [
        ("plux.md", "c1", [f"{LIMITS.file_bytes // 1024 // MIB} GiB"]),
        ("plux.md", "c10", [f"{LIMITS.members} members"]),
        ("plux.md", "j1", [f"{LIMITS.manifest_bytes // MIB} MiB", f"{LIMITS.json_depth} levels"]),
        ("plux.md", "j3", [f"{LIMITS.json_number_digits} characters"]),
        ("plux.md", "m14", [f"{LIMITS.picture_bytes // MIB} MiB",
                            f"{LIMITS.layer_bytes // MIB} MiB"]),
        ("plux.md", "s5", [f"{LIMITS.crowding:,} times"]),
        ("plux.md", "a3", [f"{LIMITS.array_bytes // MIB} MiB"]),
        ("onnx_profile.md", "n1", [f"{LIMITS.network_bytes // MIB} MiB", f"{LIMITS.nodes:,} nodes",
                                   f"{LIMITS.initializers:,} initializers"]),
        ("onnx_profile.md", "n1", [f"{LIMITS.network_structure_bytes // MIB} MiB besides",
                                   f"{LIMITS.nodes + FIELDS_EACH * LIMITS.initializers:,} fields"]),
        ("usd.md", "u2", [f"{LIMITS.layer_words:,} tokens", f"{LIMITS.layer_depth} deep"]),
        ("usd.md", "u6", list(COMPOSING)),
        ("plux.md", "p1", [f"{LIMITS.picture_pixels:,} pixels"]),
        ("onnx_profile.md", "n11", [f"{LIMITS.node_inputs} inputs",
                                   f"{LIMITS.node_outputs:,} outputs"]),
        ("onnx_profile.md", "n2", [f"version {IR_VERSION}", f"opset {OPSET}"]),
        ("onnx_profile.md", "n14", [f"{LIMITS.sample_floats:,} elements",
                                    f"{LIMITS.sample_floats_sum:,}", f"{LIMITS.sample_macs:,}",
                                    f"{LIMITS.sample_nanoseconds:,} ns"]),
        ("conformance.md", "g2", [f"{LIMITS.vectors:,}", f"{LIMITS.golden_milliseconds:,} ms"]),
    ],
)  # fmt: skip
def test_limits_are_those_of_the_rules(page: str, anchor: str, figures: list[str]) -> None:
    text = rule(page, anchor)
    assert all(figure in text for figure in figures)


@pytest.mark.parametrize(
    ("owner", "fields"),
    [("the layer", LAYER_FIELDS), ("a prim", PRIM_FIELDS), ("a property", PROPERTY_FIELDS)],
)
def test_fields_of_the_layer_are_those_of_the_grammar(owner: str, fields: frozenset[str]) -> None:
    assert f"| {owner} | {' '.join(sorted(fields))} |" in (SPEC / "usd.md").read_text()


def test_every_rule_names_a_code_and_every_code_is_of_a_rule() -> None:
    rules = {
        f"{page.name}#{anchor}": set(re.findall(r"`(PLX_\w+)`", text))
        for page in PAGES
        for anchor, text in re.findall(
            r'<a id="([a-z]\d+)"></a>(.*?)(?=<a id=|\n\n|\Z)', page.read_text(), re.DOTALL
        )
    }
    named = {code: anchor for anchor, codes in rules.items() for code in codes}
    # Rules H are about hosts; the conformance suite finds who breaks them.
    codeless = [anchor for anchor, codes in rules.items() if not codes]
    assert [anchor for anchor in codeless if not anchor.startswith("conformance.md#h")] == []
    assert named == {code.name: code.anchor for code in CODES.values()}


def test_the_example_is_current() -> None:
    remedy = "run: python -m tests.assets.example_page"
    assert example_page.FILE.read_bytes() == smallest.data(), remedy
    assert example_page.PAGE.read_text() == example_page.document(), remedy


def test_the_example_is_valid() -> None:
    assert validate(example_page.FILE).issues == ()


def test_the_bytes_of_the_example_are_those_of_the_file() -> None:
    """The page's dumps, read back, lie in the file where the page says."""
    data = example_page.FILE.read_bytes()
    lines = re.findall(
        r"^    ([0-9a-f]{6})  ((?:[0-9a-f]{2} ?)+)", example_page.PAGE.read_text(), re.M
    )
    assert len(lines) > 20
    for place, text in lines:
        part = bytes.fromhex(text)
        assert data[int(place, 16) :][: len(part)] == part


def test_every_equation_that_code_cites_is_stated() -> None:
    text = "".join(page.read_text() for page in PAGES)
    stated = [int(number) for number in re.findall(r"\*\*Eq\. (\d+)\*\*", text)]
    assert sorted(stated) == list(range(1, len(stated) + 1))
    code = (ROOT / "purelight_format/measures.py").read_text()
    cited = [int(number) for number in re.findall(r"Eq\. (\d+)", code)]
    measures = re.findall(r"\*\*Eq\. (\d+)\*\*", (ROOT / "spec/measures.md").read_text())
    assert cited == sorted(map(int, measures))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)]+)\)", page.read_text()):
        file, _, anchor = target.partition("#")
        path = page.parent / file if file else page
        assert path.exists(), target
        if anchor:
            text = path.read_text()
            headings = {h.lower().replace(" ", "-") for h in re.findall(r"^#+ (.*)$", text, re.M)}
            assert f'<a id="{anchor}">' in text or anchor in headings, target
