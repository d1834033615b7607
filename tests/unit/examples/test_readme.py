"""The README's example runs as it is printed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.support import lamp

README = Path(__file__).parents[3] / "README.md"


def test_python_example_prints_an_irradiance(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "out/demo").mkdir(parents=True)
    (tmp_path / "out/demo/lamp.plux").write_bytes(lamp.seal(lamp.good()))
    monkeypatch.chdir(tmp_path)
    (example,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.S)
    exec(compile(example, str(README), "exec"), {})
    printed = capsys.readouterr().out
    irradiance = np.array([float(n) for n in re.findall(r"\d+\.\d+(?:e[-+]\d+)?", printed)])
    assert irradiance.shape == (3,)
    assert (irradiance > 0).all()


@pytest.mark.parametrize("link", re.findall(r"\]\(([^)#:]+)\)", README.read_text(encoding="utf-8")))
def test_links_lead_somewhere(link: str) -> None:
    assert (README.parent / link).exists()
