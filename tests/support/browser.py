"""A headless Chromium that opens a page of a folder and reads what it says; no GPU is needed."""

from __future__ import annotations

import functools
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

# Chromium reads messages from descriptor 3 and writes to 4.
CONNECT = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(word), fcntl.F_DUPFD, 5) for word in sys.argv[1:3]]
os.dup2(ends[0], 3)
os.dup2(ends[1], 4)
os.execv(sys.argv[3], sys.argv[3:])
"""
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan", "--disable-quic",
    "--no-first-run", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--remote-debugging-pipe",
)  # fmt: skip


def program() -> str:
    """The browser; skips the test where there is none."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip("no Chromium is installed")
    return found


class Quiet(SimpleHTTPRequestHandler):
    """Serves a folder without a word."""

    def log_message(self, *_: Any) -> None:
        """Says nothing."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address at which a folder is served."""
    handler = functools.partial(Quiet, directory=str(folder))
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()


class Browser:
    """Chromium's DevTools protocol over a pair of pipes."""

    def __init__(self, folder: str) -> None:
        down, up = os.pipe(), os.pipe()
        ends = down[0], up[1]
        words = [program(), *FLAGS, f"--user-data-dir={folder}", "about:blank"]
        self.process = subprocess.Popen(
            [sys.executable, "-c", CONNECT, *map(str, ends), *words],
            pass_fds=ends, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(down[0])
        os.close(up[1])
        self._write, self._read = os.fdopen(down[1], "wb"), os.fdopen(up[0], "rb")
        self._count = 0

    def send(self, method: str, session: str = "", **parameters: Any) -> dict[str, Any]:
        """The answer to a message."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        message |= {"sessionId": session} if session else {}
        self._write.write(json.dumps(message).encode() + b"\0")
        self._write.flush()
        while True:
            answer = json.loads(self._line())
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                found: dict[str, Any] = answer["result"]
                return found

    def _line(self) -> bytes:
        line = bytearray()
        while (byte := self._read.read(1)) not in (b"\0", b""):
            line += byte
        assert line, "the browser has ended"
        return bytes(line)

    def close(self) -> None:
        """Ends the browser."""
        self._write.close()
        self.process.terminate()
        self.process.wait(10)
        self._read.close()


def visit(folder: Path, page: str, *, seconds: float = 240) -> tuple[str, str]:
    """Title and `#result` of a page, once its title says that it passed or failed."""
    with tempfile.TemporaryDirectory() as profile, served(folder) as address:
        browser = Browser(profile)
        try:
            return _visited(browser, f"{address}/{page}", seconds)
        finally:
            browser.close()


def _visited(browser: Browser, address: str, seconds: float) -> tuple[str, str]:
    target = browser.send("Target.createTarget", url=address)["targetId"]
    session = browser.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
    expression = "JSON.stringify([document.title, document.getElementById('result')?.textContent])"
    end, title, text = time.monotonic() + seconds, "", ""
    while title not in ("passed", "failed") and time.monotonic() < end:
        time.sleep(0.2)
        found = browser.send("Runtime.evaluate", session, expression=expression)["result"]
        title, text = json.loads(found["value"])
    return title, text or ""
