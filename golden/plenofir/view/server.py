# SPDX-License-Identifier: Apache-2.0
"""The viewer's server: for this machine only, with a token, and only the page's own files."""

import asyncio
import json
import re
import secrets
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from socket import socket

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler

from plenofir.ground.errors import InputError
from plenofir.view.page import STYLE, Page, Part, PartRequest

ADDRESS = "127.0.0.1"
_BINNINGS = {str(n) for n in range(1, 65)}
_NUMBER = re.compile("[0-9]{1,12}")
_KINDS = {"html": "text/html", "js": "text/javascript", "css": "text/css"}
_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class _Parts:
    """The files that are served: the page's own, by name; parts are made once, in a thread."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.assets = {"": page.document, **{name: name for name in (*page.scripts, STYLE)}}

    def asset(self, name: str) -> Part | None:
        """A file of the page, or None if there is no such file."""
        if name == "field.json":
            return Part(json.dumps(self.page.field, allow_nan=False).encode(), "application/json")
        if name not in self.assets:
            return None
        file = self.assets[name]
        return Part(self.page.asset(file), f"{_KINDS[file.rpartition('.')[2]]}; charset=utf-8")

    def make(self, name: str, request: PartRequest) -> "Future[Part]":
        """Make a part in a thread, which does not keep the program from ending."""
        part: Future[Part] = Future()

        def work() -> None:
            try:
                part.set_result(self.page.parts[name](request))
            except Exception as error:
                part.set_exception(error)

        threading.Thread(target=work, daemon=True).start()
        return part


class _Nothing(RequestHandler):
    """Answers any other address with "no such page"."""

    def set_default_headers(self) -> None:
        """Forbid caching, framing, and loading from elsewhere."""
        self.clear_header("Server")
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        raise HTTPError(404)

    def write_error(self, status_code: int, **kwargs: object) -> None:
        """One line, which the page shows."""
        failure = kwargs.get("exc_info")
        error = failure[1] if isinstance(failure, tuple) else None
        text = str(error) if isinstance(error, InputError) else f"{status_code}: {self._reason}"
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(text)

    def log_exception(self, *_: object) -> None:
        """The page shows it; the terminal stays quiet."""


class _Handler(_Nothing):
    """The page and its parts."""

    def initialize(self, parts: _Parts, hosts: set[str]) -> None:
        """Keep the page."""
        self.parts, self.hosts = parts, hosts

    def prepare(self) -> None:
        """Refuse requests with another host name than this server's address."""
        # Another site's name may resolve to this machine (DNS rebinding).
        if self.request.host not in self.hosts:
            raise HTTPError(403)

    async def get(self, name: str) -> None:
        """Answer with a file of the page, or a part in the binning asked for."""
        part = self.parts.asset(name)
        if part is None and name in self.parts.page.parts:
            binning = self.get_query_argument("bin", "1")
            after = self.get_query_argument("after", "0")
            if binning not in _BINNINGS or not _NUMBER.fullmatch(after):
                raise HTTPError(400)
            query = {name: self.get_query_argument(name) for name in self.request.query_arguments}
            request = PartRequest(int(binning), int(after), query)
            part = await asyncio.wrap_future(self.parts.make(name, request))
        if part is None:
            raise HTTPError(404)
        self.set_header("Content-Type", part.kind)
        for key, value in part.facts.items():
            self.set_header(f"X-{key.capitalize()}", value)
        self.finish(part.content)


def bound(port: int) -> list[socket]:
    """Sockets of this machine's own address, at a port or (0) any free one."""
    try:
        return bind_sockets(port, ADDRESS)
    except OSError as error:
        raise InputError(
            f"{port} cannot be used ({error.strerror}); use a free port, or 0 for any", where="port"
        ) from None


async def serving(
    page: Page, sockets: list[socket], ready: Callable[[str], None], ended: asyncio.Event
) -> None:
    """Serve a page until `ended` is set; see `serve`."""
    port = sockets[0].getsockname()[1]
    token = secrets.token_urlsafe(16)
    hosts = {f"{name}:{port}" for name in (ADDRESS, "localhost")}
    settings = {"parts": _Parts(page), "hosts": hosts}
    application = Application(
        [(rf"/{token}/([^/]*)", _Handler, settings)],
        default_handler_class=_Nothing,
        log_function=lambda _: None,
    )
    server = HTTPServer(application)
    server.add_sockets(sockets)
    try:
        ready(f"http://{ADDRESS}:{port}/{token}/")
        await ended.wait()
    finally:
        server.stop()


def serve(page: Page, port: int, ready: Callable[[str], None]) -> None:
    """Serve a page on this machine until Ctrl-C, on a TCP port, or any free one (0).

    `ready` is called with the page's address, which holds a random token: without it nothing is
    served.
    """
    sockets = bound(port)

    async def until_interrupted() -> None:
        ended = asyncio.Event()
        loop = asyncio.get_running_loop()
        # Without handlers (Windows) Ctrl-C cancels `serving`.
        with suppress(NotImplementedError):
            loop.add_signal_handler(signal.SIGINT, ended.set)
        try:
            await serving(page, sockets, ready, ended)
        finally:
            with suppress(NotImplementedError):
                loop.remove_signal_handler(signal.SIGINT)

    asyncio.run(until_interrupted())
