"""Chromium without a window, told what to do over its debugging protocol by a socket."""

from __future__ import annotations

import base64
import contextlib
import io
import itertools
import json
import os
import shutil
import socket
import struct
import subprocess
import time
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
PATIENCE = 90.0
"""Seconds that a machine under load may take for an answer."""


class Navigated(Exception):
    """The page was asked while another took its place."""


class Browser:
    """One page of a browser that may reach no network; ``events`` is what it told meanwhile."""

    def __init__(self, folder: Path, size: tuple[int, int] = (1300, 1000)) -> None:
        words = (
            "--headless=new --no-sandbox --disable-dev-shm-usage --use-angle=swiftshader --enable-unsafe-swiftshader "
            "--disable-background-networking --no-first-run --remote-debugging-port=0 --proxy-server=127.0.0.1:9"
        )
        assert CHROMIUM
        self._process = subprocess.Popen(
            [
                CHROMIUM,
                *words.split(),
                f"--user-data-dir={folder}",
                f"--window-size={size[0]},{size[1]}",
                "about:blank",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.events: list[dict[str, Any]] = []
        self._numbers = itertools.count(1)
        port = folder / "DevToolsActivePort"
        self.wait(lambda: port.exists() and port.read_text().count("\n"))
        where = port.read_text().split()[0]
        with urllib.request.urlopen(f"http://127.0.0.1:{where}/json/list") as answer:
            page = next(each for each in json.load(answer) if each["type"] == "page")
        host, path = page["webSocketDebuggerUrl"].removeprefix("ws://").split("/", 1)
        self._socket = socket.create_connection(("127.0.0.1", int(host.partition(":")[2])), PATIENCE)
        key = base64.b64encode(os.urandom(16)).decode()
        self._socket.sendall(
            f"GET /{path} HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        self._file = self._socket.makefile("rb")
        while self._file.readline().strip():
            pass
        for name in ("Runtime", "Log", "Network", "Page"):
            self.do(f"{name}.enable")

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._process.terminate()
        self._process.wait()

    def do(self, method: str, **given: Any) -> Any:
        """Call a method of the protocol."""
        number = next(self._numbers)
        data = json.dumps({"id": number, "method": method, "params": given}).encode()
        mask = os.urandom(4)
        size = bytes([0x80 | len(data)]) if len(data) < 126 else b"\xfe" + struct.pack(">H", len(data))
        self._socket.sendall(b"\x81" + size + mask + bytes(x ^ mask[k % 4] for k, x in enumerate(data)))
        while True:
            told = json.loads(self._message())
            if told.get("id") == number:
                if "navigated" in told.get("error", {}).get("message", ""):
                    raise Navigated
                assert "error" not in told, told
                return told["result"]
            self.events.append(told)

    def _message(self) -> bytes:
        data, last = b"", False
        while not last:
            first, size = self._file.read(2)
            last = bool(first & 0x80)
            if size > 125:
                size = int.from_bytes(self._file.read(2 if size == 126 else 8), "big")
            data += self._file.read(size)
        return data

    def ask(self, expression: str) -> Any:
        """The value of an expression in the page."""
        found = self.do("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def open(self, path: Path, ready: str) -> None:
        """Open a file and wait until an expression is true."""
        self.do("Page.navigate", url=path.as_uri())
        self.wait(lambda: self.ask(ready))

    def wait(self, true: Any) -> None:
        """Wait until a function says so."""
        end = time.monotonic() + PATIENCE
        while True:
            with contextlib.suppress(Navigated):
                if true():
                    return
            assert time.monotonic() < end, "the browser does not get ready"
            time.sleep(0.05)

    def seen(self, selector: str) -> np.ndarray:
        """The pixels of an element, ``(height, width, 3)``."""
        self.ask("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")
        x, y, wide, tall = self.box(selector)
        left, top = self.ask("[scrollX, scrollY]")
        clip = {"x": x + left, "y": y + top, "width": wide, "height": tall, "scale": 1}
        data = self.do("Page.captureScreenshot", clip=clip)["data"]
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")).astype(int)

    def box(self, selector: str) -> list[float]:
        """Left, top, width and height of an element that is scrolled into view."""
        return self.ask(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)}); "
            "e.scrollIntoView({block: 'center'}); const b = e.getBoundingClientRect(); "
            "return [b.x, b.y, b.width, b.height]; })()"
        )

    def drag(self, selector: str, by: tuple[int, int], button: str = "left") -> None:
        """Press a button in the middle of an element, move, and let go."""
        x, y, wide, tall = self.box(selector)
        x, y = x + wide / 2, y + tall / 2
        mouse = {"button": button, "clickCount": 1}
        self.do("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, **mouse)
        for k in (1, 2, 3):
            self.do("Input.dispatchMouseEvent", type="mouseMoved", x=x + by[0] * k / 3, y=y + by[1] * k / 3, **mouse)
        self.do("Input.dispatchMouseEvent", type="mouseReleased", x=x + by[0], y=y + by[1], **mouse)

    def complaints(self) -> list[Any]:
        """Errors and warnings that the page made."""
        levels = ("error", "warning")
        return [
            event
            for event in self.events
            if event["method"] == "Runtime.exceptionThrown"
            or (event["method"] == "Runtime.consoleAPICalled" and event["params"]["type"] in (*levels, "assert"))
            or (event["method"] == "Log.entryAdded" and event["params"]["entry"]["level"] in levels)
        ]

    def requests(self) -> list[str]:
        """Addresses that the page asked for."""
        return [e["params"]["request"]["url"] for e in self.events if e["method"] == "Network.requestWillBeSent"]
