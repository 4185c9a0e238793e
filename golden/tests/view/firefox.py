# SPDX-License-Identifier: Apache-2.0
"""Debian's Firefox, by its own protocol (Marionette), on a virtual screen.

Without a screen it has no WebGL: Xvfb gives it one, and Mesa draws with the processor.
"""

import json
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PROGRAMS = ("firefox-esr", "Xvfb")
_START_SECONDS, _ANSWER_SECONDS = 120, 300
_PREFERENCES = {
    "marionette.port": 0,
    "webgl.force-enabled": True,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
}


def missing() -> str:
    """Missing programs, as a reason to skip; empty if there are none."""
    gone = [name for name in PROGRAMS if shutil.which(name) is None]
    packages = " ".join(name.lower() for name in gone)
    return f"no {' and '.join(gone)}: sudo apt-get install {packages}" if gone else ""


class Tab:
    """The window of a Firefox: the part of Playwright's pages that tests of both browsers use."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), _ANSWER_SECONDS)
        self._number = 0
        self._answer()  # who it is
        self._call("WebDriver:NewSession")
        seconds = {"script": 1000 * _ANSWER_SECONDS, "pageLoad": 1000 * _ANSWER_SECONDS}
        self._call("WebDriver:SetTimeouts", **seconds)

    def _answer(self) -> Any:
        head = b""
        while not head.endswith(b":"):
            head += self._socket.recv(1)
        left, parts = int(head[:-1]), []
        while left:
            parts.append(self._socket.recv(left))
            left -= len(parts[-1])
        return json.loads(b"".join(parts))

    def _call(self, command: str, **values: Any) -> Any:
        self._number += 1
        text = json.dumps([0, self._number, command, values]).encode()
        self._socket.sendall(b"%d:%b" % (len(text), text))
        _, _, error, result = self._answer()
        if error:
            raise RuntimeError(error["message"])
        return result

    def goto(self, address: str) -> None:
        self._call("WebDriver:Navigate", url=address)

    def resize(self, width: int, height: int) -> None:
        """Make the window so large that its content has this size."""
        for _ in range(2):
            inside = self.evaluate("[innerWidth, innerHeight]")
            window = self._call("WebDriver:GetWindowRect")
            self._call(
                "WebDriver:SetWindowRect",
                width=window["width"] + width - inside[0],
                height=window["height"] + height - inside[1],
            )

    def evaluate(self, expression: str, argument: Any = None) -> Any:
        """The value of an expression, or of a function of the argument, once it is there."""
        script = (
            f"const [given, done] = arguments; (async () => {{ const found = {expression};"
            " return typeof found === 'function' ? found(given) : found; })()"
            ".then((value) => done({ value }), (error) => done({ error: String(error) }));"
        )
        found = self._call("WebDriver:ExecuteAsyncScript", script=script, args=[argument])["value"]
        if "error" in found:
            raise RuntimeError(found["error"])
        return found.get("value")

    def press(self, key: str) -> None:
        """Press a key and let it go."""
        keys = [{"type": kind, "value": key} for kind in ("keyDown", "keyUp")]
        self._call(
            "WebDriver:PerformActions", actions=[{"type": "key", "id": "k", "actions": keys}]
        )

    def wheel(self, x: int, y: int, delta: int) -> None:
        """Turn the wheel at a place of the window."""
        turn = {"type": "scroll", "x": x, "y": y, "deltaX": 0, "deltaY": delta}
        actions = [{"type": "wheel", "id": "w", "actions": [{**turn, "origin": "viewport"}]}]
        self._call("WebDriver:PerformActions", actions=actions)


@contextmanager
def firefox() -> Iterator[Tab]:
    """A Firefox with an empty profile; one window."""
    with tempfile.TemporaryDirectory(prefix="firefox-") as name:
        profile = Path(name)
        lines = [f"user_pref({json.dumps(k)}, {json.dumps(v)});" for k, v in _PREFERENCES.items()]
        (profile / "user.js").write_text("\n".join(lines))
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        with subprocess.Popen(
            ["Xvfb", "-displayfd", "1", "-screen", "0", "1400x1000x24", "-nolisten", "tcp"],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        ) as screen:
            assert screen.stdout is not None
            display = f":{screen.stdout.readline().strip()}"
            command = ["firefox-esr", "--headless", "--marionette", "--profile", name]
            environment = {"DISPLAY": display, "HOME": name, "PATH": "/usr/bin:/bin"}
            with subprocess.Popen(command, env=environment, **quiet) as program:
                try:
                    yield Tab(_port(profile, program))
                finally:
                    program.terminate()
                    program.wait(60)
                    screen.terminate()


def _port(profile: Path, program: "subprocess.Popen[bytes]") -> int:
    """The port that it has chosen, when it listens."""
    end = time.monotonic() + _START_SECONDS
    file = profile / "MarionetteActivePort"
    while time.monotonic() < end and program.poll() is None:
        if file.exists() and file.read_text():
            return int(file.read_text())
        time.sleep(0.1)
    raise RuntimeError("firefox-esr does not start")
