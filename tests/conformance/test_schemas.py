"""The suite's index and the lines of the protocol are those of their JSON Schemas."""

from __future__ import annotations

import copy
import json
import sys
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from referencing import Registry

from purelight_conformance import runner, suite
from purelight_conformance.client import Client
from purelight_conformance.protocol import READER
from purelight_conformance.suite import REQUIRED, Suite

FOLDER = Path(__file__).parents[2] / "spec/schema"
SCHEMAS = {path.name: json.loads(path.read_text()) for path in FOLDER.glob("*.json")}
REGISTRY = Registry().with_contents(SCHEMAS.items())
HOST = Path(__file__).with_name("faulty_host.py")
ARRAY = {"dtype": "<f4", "shape": [1, 3], "data": "AAAAAAAAAAAAAIA/"}


def schema(name: str) -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(SCHEMAS[f"{name}.schema.json"], registry=REGISTRY)


@pytest.fixture(scope="module")
def index(folder: Path) -> dict[str, Any]:
    value: dict[str, Any] = json.loads((folder / suite.INDEX).read_text())
    return value


@pytest.mark.parametrize("name", ["suite", "protocol"])
def test_the_schemas_are_sound(name: str) -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMAS[f"{name}.schema.json"])


def test_the_suite_is_as_its_schema_says(index: dict[str, Any]) -> None:
    schema("suite").validate(index)
    assert set(index) == set(SCHEMAS["suite.schema.json"]["properties"])
    fields = set(SCHEMAS["suite.schema.json"]["$defs"]["set"]["properties"])
    assert all(set(entry) == fields for entry in index["sets"])


@pytest.mark.parametrize(
    ("operation", "change"),
    [
        ("sampler", {"refusal": "sometimes"}),
        ("sampler", {"inputs": {}}),
        ("sampler", {"file": ""}),
        ("sampler", {"file": "../../passwd"}),
        ("sampler", {"rows": -1}),
        ("sampler", {"flags": {"FAR": [[1, 2, 3]]}}),
        ("sampler", {"outputs": {"toward": {"dtype": "<f2", "shape": [1], "offset": 0}}}),
        ("instance_sample", {"parameters": {"to_world": [[1, 0], [0, 1]]}}),
        ("cap", {"parameters": {"bounding_sphere": {"center": [0, 0, 0]}}}),
        (READER, {"bundle": ""}),
        (READER, {"parameters": {"issue": 7}}),
    ],
)
def test_a_wrong_set_is_not(operation: str, change: dict[str, Any], index: dict[str, Any]) -> None:
    wrong = copy.deepcopy(index)
    entry = next(entry for entry in wrong["sets"] if entry["operation"] == operation)
    entry.update(change)
    assert not schema("suite").is_valid(wrong)


@pytest.fixture(scope="module")
def lines(whole: Suite) -> list[dict[str, Any]]:
    """What runner and host say over one set of each operation, refusals included."""
    spoken: list[bytes] = []
    exchange = Client._exchange

    def recorded(client: Client, line: bytes) -> bytes:
        answer = exchange(client, line)
        spoken.extend((line, answer))
        return answer

    chosen = {(v.operation, v.refusal): v for v in whole.sets if v.rows is None or v.rows == 0}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Client, "_exchange", recorded)
        part = Suite(tuple(chosen.values()), whole.bundles)
        report = runner.run(part, [sys.executable, str(HOST)], statistics=False)
    assert report.conforms
    assert any(refusal == REQUIRED for _, refusal in chosen)
    return [json.loads(line) for line in spoken]


def test_what_is_said_is_as_its_schema_says(lines: list[dict[str, Any]]) -> None:
    for line in lines:
        schema("protocol").validate(line)
    assert {line["do"] for line in lines if "do" in line} == {"hello", "open", "evaluate"}
    fields = SCHEMAS["protocol.schema.json"]["$defs"]["answer"]["properties"].keys() | {"id"}
    assert fields == {name for line in lines if "do" not in line for name in line}


@pytest.mark.parametrize(
    "line",
    [
        {"do": "hello", "protocol": "1.0"},
        {"id": 1, "do": "hello"},
        {"id": 1, "do": "sing"},
        {"id": 1, "do": "open"},
        {"id": 1, "do": "evaluate", "operation": "frame", "inputs": {"axis": ARRAY}},
        {"id": 1, "do": "evaluate", "operation": "frame", "parameters": {},
         "inputs": {"axis": {**ARRAY, "dtype": "<f8"}}},
        {"id": "1"},
        {"id": 1, "protocol": "1.0", "host": "mine", "version": "3"},
        {"id": 1, "protocol": "1", "host": "mine", "version": "3", "operations": []},
        {"id": 1, "protocol": "1.0", "host": "mine", "version": "3", "operations": "frame"},
        {"id": 1, "outputs": [ARRAY]},
        {"id": 1, "outputs": {"tangent": {**ARRAY, "dtype": "O"}}},
        {"id": 1, "outputs": {"tangent": {**ARRAY, "shape": [-1]}}},
        {"id": 1, "outputs": {"tangent": {**ARRAY, "data": "?"}}},
        {"id": 1, "refused": "two\nlines"},
        [],
    ],
)  # fmt: skip
def test_a_wrong_line_is_not(line: Any) -> None:
    assert not schema("protocol").is_valid(line)


def test_what_is_not_known_is_ignored() -> None:
    schema("protocol").validate({"id": 1, "do": "hello", "protocol": "1.3", "mood": "cosy"})
    schema("protocol").validate({"id": 1, "mood": "cosy"})
