"""The outcome of a validation: issues, as text, as JSON, and as an exit code."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from purelight_format.issues import Issue, plain
from purelight_format.limits import LIMITS, Limits
from purelight_format.members import strict_json


@dataclass(frozen=True)
class Report:
    """What a validator found.

    Arguments:
        issues: in the order found, errors and warnings.
        truncated: whether there were more issues than a report holds.
    """

    issues: tuple[Issue, ...] = ()
    truncated: bool = False

    @staticmethod
    def of(issues: Iterable[Issue], limits: Limits = LIMITS) -> Report:
        """Collects issues, errors first, up to the limit."""
        ranked = sorted(issues, key=lambda found: not found.is_error)
        return Report(tuple(ranked[: limits.issues]), len(ranked) > limits.issues)

    @property
    def errors(self) -> tuple[Issue, ...]:
        return tuple(found for found in self.issues if found.is_error)

    @property
    def warnings(self) -> tuple[Issue, ...]:
        return tuple(found for found in self.issues if not found.is_error)

    @property
    def valid(self) -> bool:
        """Whether there is no error."""
        return not self.errors

    @property
    def exit_code(self) -> int:
        """0 for a valid bundle, 1 for an invalid one."""
        return 0 if self.valid else 1

    def to_json(self, path: str) -> str:
        """The report as JSON in ASCII, see spec/schema/report.schema.json."""
        return strict_json.shown(
            {
                "path": plain(path),
                "valid": self.valid,
                "truncated": self.truncated,
                "issues": [_to_json(found) for found in self.issues],
            }
        )

    def to_text(self, path: str) -> str:
        """The report for people, one line for each issue."""
        lines = [
            f"{found.code.severity.value}: {found.code.name} at {found.location}: {found.message}"
            f" [spec/{found.code.anchor}]"
            for found in self.issues
        ]
        more = ", and more" if self.truncated else ""
        counts = f"{_count(self.errors, 'error')}, {_count(self.warnings, 'warning')}{more}"
        lines.append(f"{plain(path)}: {'valid' if self.valid else 'INVALID'} ({counts})")
        return "\n".join(lines)


def _count(issues: tuple[Issue, ...], word: str) -> str:
    return f"{len(issues)} {word}{'' if len(issues) == 1 else 's'}"


def _to_json(found: Issue) -> dict[str, Any]:
    return {
        "code": found.code.name,
        "severity": found.code.severity.value,
        "location": found.location,
        "message": found.message,
        "spec": found.code.anchor,
    }
