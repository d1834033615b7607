"""A lamp in a page of its own: `purelight-view --web`."""

from __future__ import annotations

import base64
import gzip
import os
import re
from pathlib import Path

import pytest

from purelight_format.bundle import Bundle
from purelight_onnx import cli, web_page
from tests.assets import bad
from tests.support import lamp

BLOCK = re.compile(r'<script type="application/vnd.purelight" data-name="([^"]*)">([^<]*)</script>')


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    (tmp_path / "my lamp.plux").write_bytes(lamp.seal_as_written())
    return tmp_path / "my lamp.plux"


def write(bundle: Path, output: Path, *options: str) -> int:
    return cli.main(["--web", str(bundle), "--output", str(output), *options])


def test_the_page_holds_the_lamp_and_no_other(bundle: Path, tmp_path: Path) -> None:
    output = tmp_path / "new/lamp.html"
    assert write(bundle, output) == 0
    page = output.read_text(encoding="utf-8")
    ((name, packed),) = BLOCK.findall(page)
    assert name == "my lamp.plux"
    assert gzip.decompress(base64.b64decode(packed)) == bundle.read_bytes()
    assert "<title>Octahedron – PureLight</title>" in page


def test_the_same_lamp_gives_the_same_bytes(bundle: Path) -> None:
    assert web_page.page(Bundle.open(bundle)) == web_page.page(Bundle.open(bundle))


def test_a_file_name_that_is_no_text(bundle: Path, tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"l\xffmp.plux")
    path.write_bytes(bundle.read_bytes())
    assert b'data-name="l\xef\xbf\xbdmp.plux"' in web_page.page(Bundle.open(path))


def test_texts_of_a_lamp_are_texts_in_the_page(tmp_path: Path) -> None:
    name = '</title><script>alert("1")</script>'
    (tmp_path / "a.plux").write_bytes(bad.edited("name", name))
    page = web_page.page(Bundle.open(tmp_path / "a.plux")).decode()
    assert name not in page
    assert "<title>&lt;/title&gt;&lt;script&gt;" in page
    template = web_page.TEMPLATE.read_text(encoding="utf-8")
    examples = template.count("data-example data-name=")
    assert page.count("<script") == template.count("<script") - examples + 1


@pytest.mark.parametrize(
    ("output", "options", "message"),
    [
        ("lamp.exr", [], ".html"),
        ("lamp.html", ["--spp", "3"], "--spp"),
        ("lamp.html", ["--half"], "--half"),
    ],
)
def test_faults_of_the_user_are_one_line(
    bundle: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    output: str,
    options: list[str],
    message: str,
) -> None:
    assert write(bundle, tmp_path / output, *options) == 2
    (error,) = capsys.readouterr().err.strip().splitlines()
    assert error.startswith("purelight-view: error: ")
    assert message in error
    assert not (tmp_path / output).exists()


def test_a_lamp_that_the_page_would_refuse_gets_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad_lamp = bad.golden("vectors/appearance.radiance.npy", lambda y: 2 * y)
    (tmp_path / "a.plux").write_bytes(bad_lamp)
    assert write(tmp_path / "a.plux", tmp_path / "a.html") == 2
    assert "golden vectors are not met" in capsys.readouterr().err
    assert not (tmp_path / "a.html").exists()


def test_a_lamp_that_is_too_large_for_a_page_is_one_line(
    bundle: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(web_page, "LARGEST", 1000)
    assert write(bundle, bundle.with_suffix(".html")) == 2
    assert "do not fit into a page" in capsys.readouterr().err
