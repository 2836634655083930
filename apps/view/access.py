"""Rejects requests to the live view that do not come from the page of the view itself.

Every program on this machine can reach a server on 127.0.0.1. A page of any web site that is open
in the browser can also reach the server. Three checks protect the view from pages of other web
sites and from other programs. First, the Host header must name this machine. A Host header with the
domain of a web site is rejected, even if this domain points to 127.0.0.1. Second, the Origin header
of a WebSocket request must name the address of the page itself. Third, a request must contain the
token, either in the address or in the cookie of the first response.
"""

from __future__ import annotations

import secrets
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

_LOOPBACK = {"localhost", "127.0.0.1", "::1"}
_REFUSED = "Open the address that chasles printed, with its token.\n"
_STARTING = threading.Lock()


@dataclass(frozen=True)
class Access:
    """The secret token that protects a view.

    Attributes:
        token: A random text in the address of the page.
    """

    token: str = field(default_factory=lambda: secrets.token_urlsafe(16))

    def address(self, port: int) -> str:
        """Return the address of the page."""
        return f"http://localhost:{port}/?token={self.token}"

    def allows(self, path: str, headers: Any) -> bool:
        """Return whether a request with this path and these headers may connect."""
        host, origin = headers.get("Host", ""), headers.get("Origin")
        if urlsplit(f"//{host}").hostname not in _LOOPBACK:
            return False
        if origin is not None and origin != f"http://{host}":
            return False
        given = (self._in_address(path), self._in_cookie(headers.get("Cookie", ""), host))
        return any(secrets.compare_digest(one.encode(), self.token.encode()) for one in given)

    def cookie(self, host: str) -> str:
        """Return the Set-Cookie header.

        The cookie name contains the port, because browsers share cookies between all ports of a
        host.
        """
        return f"{_cookie_name(host)}={self.token}; HttpOnly; SameSite=Strict; Path=/"

    @staticmethod
    def _in_address(path: str) -> str:
        return parse_qs(urlsplit(path).query).get("token", [""])[0]

    @staticmethod
    def _in_cookie(header: str, host: str) -> str:
        try:
            cookies = SimpleCookie(header)
        except CookieError:
            return ""
        found = cookies.get(_cookie_name(host))
        return found.value if found else ""


def _cookie_name(host: str) -> str:
    return f"chasles-{urlsplit(f'//{host}').port or 80}"


@contextmanager
def checked_by(access: Access) -> Iterator[None]:
    """Make every viser server that starts in this context check each request.

    The context wraps the call of `websockets.asyncio.server.serve` in viser.
    """
    from websockets.asyncio import server  # noqa: PLC0415

    serve = server.serve

    def checking(*arguments: Any, process_request: Callable[..., Any], **options: Any) -> Any:
        def check(connection: Any, request: Any) -> Any:
            headers = request.headers
            if not access.allows(request.path, headers):
                return connection.respond(HTTPStatus.FORBIDDEN, _REFUSED)
            response = process_request(connection, request)
            if response is not None:
                response.headers["Set-Cookie"] = access.cookie(headers["Host"])
            return response

        return serve(*arguments, process_request=check, **options)

    with _STARTING:
        server.serve = checking  # type: ignore[assignment,misc]
        try:
            yield
        finally:
            server.serve = serve  # type: ignore[misc]


@contextmanager
def silent() -> Iterator[None]:
    """Context in which viser prints nothing. The address that viser prints lacks the token."""
    import rich  # noqa: PLC0415

    console = rich.get_console()
    was_quiet, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = was_quiet
