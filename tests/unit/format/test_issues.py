"""Every issue code: an asset that has it, a rule that explains it, a line in the list."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from purelight_format.issues import CODES, Severity
from purelight_format.validation.issues_document import document
from tests.assets import bad, golden_reports
from tests.support import lamp

SPEC = Path(__file__).parents[3] / "spec"
# A warning of its own that comes with the error, as the asset cannot be made without it.
COMPANIONS = {
    "PLX_SURFACE_OUTSIDE_SPHERE": {"PLX_SURFACE_FLUX_CLOSURE"},
    "PLX_MANIFEST_NETWORK_MISSING": {"PLX_MEMBER_UNKNOWN"},
    "PLX_MANIFEST_SCHEMA": {"PLX_MANIFEST_UNKNOWN_FIELD"},
    "PLX_MEMBER_TOO_LARGE": set(),
    "PLX_MANIFEST_DARK": {"PLX_GOLDEN_CHANNEL"},  # Its networks are those of a lit lamp
    "PLX_GOLDEN_CHANNEL": {"PLX_MANIFEST_DARK"},
}
GOLDEN = json.loads(golden_reports.PATH.read_text())


def test_the_good_lamp_has_no_issue(tmp_path: Path) -> None:
    assert golden_reports.report_of(None, lamp.seal(lamp.good()), tmp_path).issues == ()
    assert golden_reports.report_of(bad.side_text().encode(), None, tmp_path).issues == ()


@pytest.mark.parametrize("name", golden_reports.NAMES)
def test_a_bad_asset_has_its_golden_report(name: str, tmp_path: Path) -> None:
    report = golden_reports.report(name, tmp_path)
    code = name.split("-")[0]
    found = {issue.code.name for issue in report.issues}
    assert code in found
    assert found <= {code} | COMPANIONS.get(code, set())
    assert report.valid == (CODES[code].severity is Severity.WARNING)
    assert all(issue.message.isprintable() and issue.location for issue in report.issues)
    for issue in report.issues:
        assert not any(blank in issue.message for blank in re.findall(r"{.*?}", issue.code.message))
    assert golden_reports.lines(report) == GOLDEN[name], golden_reports.REMEDY


def test_every_code_has_a_bad_asset_and_a_golden_report() -> None:
    made = set(CODES) - {"PLX_VALIDATOR_FAULT"}  # No file is known to make the validator fail.
    assert {name.split("-")[0] for name in golden_reports.NAMES} == made
    assert {line.split()[1] for lines in GOLDEN.values() for line in lines} == made
    assert list(GOLDEN) == golden_reports.NAMES


def test_codes_are_named_by_stage() -> None:
    assert all(re.fullmatch("PLX(_[A-Z0-9]+){2,}", name) for name in CODES)


@pytest.mark.parametrize("name", CODES)
def test_a_rule_of_the_specification_names_the_code(name: str) -> None:
    file, anchor = CODES[name].anchor.split("#")
    rules = dict(
        re.findall(r'<a id="(\w+)"></a>(.*?)(?=<a id=|\Z)', (SPEC / file).read_text(), re.S)
    )
    assert f"`{name}`" in rules[anchor]


def test_the_specification_names_no_other_code() -> None:
    texts = [path.read_text() for path in SPEC.glob("*.md")]
    named = {name for text in texts for name in re.findall(r"PLX_[A-Z0-9_]+[A-Z0-9]", text)}
    assert named - {"PLX_STAGE_WHAT"} == set(CODES)


def test_the_list_of_issues_is_current() -> None:
    current = (SPEC / "ISSUES.md").read_text()
    assert current == document(), (
        "run: python -m purelight_format.validation.issues_document > spec/ISSUES.md"
    )
