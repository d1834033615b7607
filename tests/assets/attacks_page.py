"""spec/ATTACKS.md, made from the hostile bundles: python -m tests.assets.attacks_page."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from purelight_format.issues import CODES
from tests.assets import bad
from tests.assets.hostile import ATTACKS, Attack

PATH = Path(__file__).parents[2] / "spec/ATTACKS.md"

HEAD = """# Attacks

What was tried against a reader of bundles, and what stopped it. Generated; do not edit. Every row
of the first tables is a bundle made in `tests/assets/hostile.py`;
`tests/unit/format/test_issues.py` validates each and compares the whole report with the golden
one in `tests/assets/golden_reports.json`. Another {others} bundles in `tests/assets/bad.py` break
one rule each, so that every one of the {codes} codes has its asset. `python -m
benchmarks.validation` measures time and memory of each, and `python -m tests.fuzz` damages them
further. Found a way through? See [SECURITY.md](../SECURITY.md).

A code with a star is a warning: the bundle is harmless, and says something that may be untrue.
"""

KINDS = {
    "Zip": "Archives that two readers understand differently, or that unpack to more.",
    "JSON": "Little text that makes much work, or that means something else elsewhere.",
    "ONNX": "Models that open files, run for ever, take all memory or end the process.",
    "USD": "Layers that compose what lies outside, or explode.",
    "Arrays": "Array headers that are code, or sizes that overflow.",
    "Lies": "Well-formed bundles that say what is not so.",
    "Side files": "The layer beside a bundle.",
}


class FileAttack(NamedTuple):
    """An abuse of files rather than of their bytes: a row with the test that tries it."""

    abuse: str
    defence: str
    test: str


HERE = "tests/unit/format/test_hostile_files.py"
ATOMIC = "tests/unit/format/test_atomic.py"
FILES = (
    FileAttack("a pipe as input, which never answers", "opened without waiting; then refused",
               f"{HERE}::test_a_pipe_is_not_waited_for"),
    FileAttack("`/dev/zero` as input", "regular files only", f"{HERE}::test_a_device_is_not_read"),
    FileAttack("links in a circle", "one line",
               f"{HERE}::test_links_that_lead_nowhere_are_one_line"),
    FileAttack("a file of a terabyte", "its size is asked before it is read",
               f"{HERE}::test_a_file_that_is_too_large_is_not_read"),
    FileAttack("terminal escapes in names of files or networks", "shown escaped",
               f"{HERE}::test_a_files_name_cannot_steer_the_terminal"),
    FileAttack("hostile bundles that make the validator open another file, socket or process",
               "Python's audit events show the bundle and the layer beside it, nothing else",
               f"{HERE}::test_no_hostile_bundle_makes_the_validator_open_anything_else"),
    FileAttack("a pipe in the place of the layer beside", "regular files only",
               f"{HERE}::test_a_pipe_beside_a_bundle_is_left_alone"),
    FileAttack("an output that is a link, a folder or a pipe", "only regular files are replaced",
               f"{ATOMIC}::test_what_is_no_regular_file_is_not_replaced"),
    FileAttack("writing over a file that is still mapped", "a new file takes the name",
               f"{ATOMIC}::test_a_file_that_is_still_mapped_keeps_its_bytes"),
    FileAttack("a full disk, a broken one or a killed process at any step of writing",
               "the old bytes or the new ones",
               f"{ATOMIC}::test_a_process_killed_at_any_step_leaves_old_or_new_bytes"),
)  # fmt: skip

FOUND = """
## What the attacks found

Faults that these attempts brought to light in this project's own code, all closed:

- integer division by a computed -1 passed the profile and ended ONNX Runtime with SIGFPE
  ([N13](onnx_profile.md#n13));
- empty protobuf messages, two bytes each, took 60 times their size in memory before any count was
  checked ([N1](onnx_profile.md#n1));
- half-open `@@@` made the search for asset paths quadratic, and `/* " */` hid paths from it,
  while OpenUSD read them ([U2](usd.md#u2));
- OpenUSD takes a quotation for an asset path, which the fuzzer found after seven million inputs
  ([U5](usd.md#u5));
- value clips name layers in plain strings, and internal references double: neither is an asset
  path ([U6](usd.md#u6));
- duplicate keys were searched in quadratic time, and a long key was repeated in the location of
  each of its faults ([J2](plux.md#j2));
- an empty array could state a size that NumPy refuses with an exception of its own
  ([A1](plux.md#a1));
- a pipe as input was waited for, a device was read, and a file's name could reach the terminal
  unescaped.
"""


def document() -> str:
    """Returns the text of the page."""
    assert {attack.kind for attack in ATTACKS} == set(KINDS)
    others = sum(map(len, (*bad.ASSETS.values(), *bad.BESIDE.values()))) - len(ATTACKS)
    parts = [HEAD.format(others=others, codes=len(bad.ASSETS.keys() | bad.BESIDE.keys()))]
    for kind, about in KINDS.items():
        rows = [_row(attack) for attack in ATTACKS if attack.kind == kind]
        parts.append(f"\n## {kind}\n\n{about}\n\n| attempt | stopped by | code |\n|---|---|---|\n")
        parts += rows
    parts.append("\n## Files\n\n| attempt | stopped by | test |\n|---|---|---|\n")
    parts += [f"| {row.abuse} | {row.defence} | `{row.test}` |\n" for row in FILES]
    return "".join([*parts, FOUND])


def _row(attack: Attack) -> str:
    code = CODES[attack.code]
    star = "" if code.severity.value == "error" else "*"
    link = (
        f"[`{attack.code}`](ISSUES.md){star} [{code.anchor.split('#')[1].upper()}]({code.anchor})"
    )
    return f"| {attack.abuse.replace('|', chr(92) + '|')} | {attack.defence} | {link} |\n"


if __name__ == "__main__":
    PATH.write_text(document())
