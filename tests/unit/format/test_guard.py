"""Whatever the validator did not foresee is an error of the bundle, never an exception."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from purelight_format.errors import PureLightError
from purelight_format.validation import validate as module
from purelight_format.validation.validate import Examination, examine, validate
from tests.assets import bad
from tests.support import lamp

STAGES = ("_container", "_manifest", "_digests", "_layer", "_members", "_networks", "_surface",
          "_vectors", "_values")  # fmt: skip


def failing(error: Exception) -> Callable[[Examination], Iterator[Any]]:
    def stage(examination: Examination) -> Iterator[Any]:
        raise error
        yield

    return stage


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize(
    "error", [ValueError("\x1b[2Jbad\n\u202e"), MemoryError(), RecursionError(), OSError(36, "x")]
)
def test_a_stage_that_fails_makes_one_plain_issue(
    stage: str, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, stage, failing(error))
    report = examine(lamp.seal(lamp.good())).report
    assert [issue.code.name for issue in report.issues] == ["PLX_VALIDATOR_FAULT"]
    assert report.issues[0].message.isprintable()
    assert type(error).__name__ in report.issues[0].message


def test_a_missing_package_is_still_the_callers_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_networks", failing(PureLightError("pip install")))
    with pytest.raises(PureLightError, match="pip install"):
        examine(lamp.seal(lamp.good()))


def test_warnings_as_errors_change_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    stage = module._values

    def noisy(examination: Examination) -> Iterator[Any]:
        warnings.warn("overflow", RuntimeWarning, stacklevel=1)
        yield from stage(examination)

    monkeypatch.setattr(module, "_values", noisy)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert validate(lamp.seal(lamp.good())).valid


def test_names_too_long_for_a_layer_beside_change_no_verdict(tmp_path: Path) -> None:
    path = tmp_path / f"{'l' * 250}.plux"  # 255 bytes; that of the layer has as many.
    path.write_bytes(lamp.seal_as_written())
    assert validate(path).valid
    beside = tmp_path / "lamp.plux"
    beside.write_bytes(path.read_bytes())
    layer = bad.side_text().replace("@./lamp.usda@", f"@./{'x' * 1000}@")
    beside.with_suffix(".usda").write_text(layer)
    report = validate(beside)
    assert report.valid
    assert {issue.code.name for issue in report.issues} == {"PLX_SIDE_LAYER_INVALID"}
