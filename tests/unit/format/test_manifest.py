"""The manifest: what is written comes back, and what is wrong is said all at once."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from referencing import Registry

from purelight_format.errors import PureLightError
from purelight_format.issues import FormatError
from purelight_format.members import manifest, strict_json
from purelight_format.members.manifest import Member, parse
from tests.support import lamp

FOLDER = Path(__file__).parents[3] / "spec/schema"
SCHEMAS = {path.name: json.loads(path.read_text()) for path in FOLDER.glob("*.json")}
REGISTRY = Registry().with_contents(SCHEMAS.items())
SCHEMA = jsonschema.Draft202012Validator(SCHEMAS["manifest.schema.json"], registry=REGISTRY)


def stated() -> manifest.Manifest:
    return lamp.parts()[0].with_members({"a/b": Member(3, "0" * 64)})


def changed(**fields: Any) -> bytes:
    return json.dumps({**manifest.to_json(stated()), **fields}).encode()


def codes(data: bytes) -> list[str]:
    return [issue.code.name for issue in manifest.examine(data)[1]]


def test_a_manifest_comes_back() -> None:
    assert parse(stated().to_bytes()) == stated()


def test_the_same_manifest_gives_the_same_bytes() -> None:
    assert parse(stated().to_bytes()).to_bytes() == stated().to_bytes()


def test_unknown_fields_survive() -> None:
    data = changed(mood="cosy", future={"x": [1, {}]})
    value = json.loads(data)
    value["networks"]["sampler"]["tier"] = 2
    read = parse(json.dumps(value).encode())
    assert read.extra == {"mood": "cosy", "future": {"x": [1, {}]}}
    assert json.loads(read.to_bytes()) == value


def test_free_fields_keep_any_json() -> None:
    anything = {"a": [1, 2.5, None, True, {"b": "ü"}]}
    written = replace(stated(), provenance=anything, fidelity=anything, extensions=anything)
    assert parse(written.to_bytes()) == written


def test_a_newer_minor_version_is_read_with_a_warning() -> None:
    data = changed(format_version="1.7", novelty=1)
    found, issues = manifest.examine(data)
    assert found is not None
    assert found.format_version == "1.7"
    assert {issue.code.name for issue in issues} == {
        "PLX_MANIFEST_VERSION_NEWER",
        "PLX_MANIFEST_UNKNOWN_FIELD",
    }


def test_a_newer_major_version_is_refused_in_one_line_whatever_else_it_holds() -> None:
    with pytest.raises(PureLightError, match=r"2\.0.*update purelight") as caught:
        parse(b'{"format_version": "2.0", "everything": "else"}')
    assert "\n" not in str(caught.value)


def test_all_faults_are_reported_at_once_with_their_places() -> None:
    data = changed(name="", flux=[1, 2], r_max="x")
    issues = manifest.examine(data)[1]
    assert [issue.location for issue in issues] == [
        f"manifest.json/{field}" for field in ("name", "flux", "r_max")
    ]


def test_places_are_json_pointers() -> None:
    data = changed(members={"a/b~c": {"size": "x", "sha256": "0" * 64}})
    assert manifest.examine(data)[1][0].location == "manifest.json/members/a~1b~0c/size"


@pytest.mark.parametrize("power", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("radius", [1e-5, 1e5])
def test_small_and_large_lamps_are_lamps(power: float, radius: float) -> None:
    sphere = {"center": [0, 0, 0], "radius": radius}
    flux = [power, 0, 0]
    scale = power / radius**2
    data = changed(
        bounding_sphere=sphere, flux=flux, channels=[True, False, False], radiance_scale=scale
    )
    assert codes(data) == []


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_what_is_not_finite_is_not_written(value: float) -> None:
    with pytest.raises(ValueError):
        replace(stated(), r_max=value).to_bytes()


@pytest.mark.parametrize("text", ['"\\u0000"', '"a\\u202eb"', '"' + "x" * 201 + '"'])
def test_names_are_fit_to_be_shown(text: str) -> None:
    data = stated().to_bytes().replace(b'"Octahedron"', text.encode())
    assert codes(data) == ["PLX_MANIFEST_SCHEMA"]


def test_strict_json_reads_what_it_writes() -> None:
    value = {"a": [1, -2.5e-300, 12345678901234567890, None, True, '"\\\u00e9\U0001f4a1']}
    assert strict_json.loads(strict_json.dumps(value), "test") == value


@pytest.mark.parametrize("depth", [16, 17])
def test_brackets_in_texts_are_no_depth(depth: int) -> None:
    text = b'"' + b"[" * 50 + b'\\"]"'
    data = b"[" * depth + text + b"]" * depth
    if depth > 16:
        with pytest.raises(FormatError, match="PLX_JSON_TOO_DEEP"):
            strict_json.loads(data, "test")
    else:
        strict_json.loads(data, "test")


def test_the_schema_accepts_the_lamp() -> None:
    for schema in SCHEMAS.values():
        jsonschema.Draft202012Validator.check_schema(schema)
    SCHEMA.validate(json.loads(stated().to_bytes()))


@pytest.mark.parametrize(
    "fields",
    [
        {"format_version": "one"},
        {"name": ""},
        {"name": 1},
        {"flux": [1, 2]},
        {"flux": [1, 2, -1]},
        {"channels": [1, 1, 1]},
        {"radiance_scale": 0},
        {"r_max": 1},
        {"units": {}},
        {"bounding_sphere": {"center": [0, 0, 0], "radius": 0}},
        {"members": {"a": {"size": -1, "sha256": "0" * 64}}},
        {"members": {"a": {"size": 1, "sha256": "0" * 63}}},
        {"networks": {"appearance": {}}},
        {"provenance": []},
    ],
)
def test_the_schema_and_the_reader_refuse_the_same(fields: dict[str, Any]) -> None:
    data = changed(**fields)
    assert manifest.examine(data)[0] is None
    with pytest.raises(jsonschema.ValidationError):
        SCHEMA.validate(json.loads(data))
