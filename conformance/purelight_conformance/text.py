"""A report for people and for programs."""

from __future__ import annotations

from purelight_conformance.flags import FLAGS
from purelight_conformance.results import OUTCOMES, Report
from purelight_format.members import strict_json

SHOWN = 5  # Failures in the text; the bugs they hunt are all named.
LISTED = 1000  # Failures for programs.


def to_text(report: Report) -> str:
    """Table by group, the bugs found, and the first failures."""
    host = report.host
    lines = [f"{host.name} {host.version}", "", _row("group", ["vectors", *OUTCOMES])]
    groups = report.groups()
    total = {outcome: sum(row[outcome] for row in groups.values()) for outcome in OUTCOMES}
    for name, row in {**groups, "all": total}.items():
        lines.append(_row(name, [sum(row.values()), *row.values()]))
    skipped = sorted({r.vectors.operation for r in report.results} - host.operations)
    if skipped:
        lines += ["", f"skipped, the host does not offer: {', '.join(skipped)}"]
    if report.failures:
        lines += ["", "these vectors hunt:"]
        for flag, (failed, checked) in report.caught().items():
            hunted = FLAGS.get(flag, "see suite.json")
            lines.append(f"  {flag:<14} {failed:>5} of {checked:>5} failed: {hunted}")
        lines += ["", "first failures:"]
        for failure in report.failures[:SHOWN]:
            lines.append(f"  {failure.vector}: {failure.what} ({', '.join(failure.hunts)})")
    if report.fault:
        lines += ["", report.fault]
    verdict = "conforms" if report.conforms else "does not conform"
    return "\n".join([*lines, "", f"{host.name} {verdict}"])


def _row(name: str, cells: list[object] | list[str] | list[int]) -> str:
    return f"{name:<14}" + "".join(f"{cell!s:>9}" for cell in cells)


def to_json(report: Report) -> str:
    """The same for programs."""
    caught = report.caught()
    value = {
        "host": report.host.name,
        "version": report.host.version,
        "operations": sorted(report.host.operations),
        "conforms": report.conforms,
        "fault": report.fault,
        "groups": report.groups(),
        "flags": {flag: {"failed": bad, "checked": total} for flag, (bad, total) in caught.items()},
        "failures": [
            {"vector": f.vector, "what": f.what, "hunts": list(f.hunts)}
            for f in report.failures[:LISTED]
        ],
    }
    return strict_json.shown(value)
