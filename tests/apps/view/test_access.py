"""The live view accepts only the page that has its token."""

import socket
from http.client import HTTPConnection
from urllib.parse import urlsplit

import pytest

import chasles
from chasles.view import LiveView

pytest.importorskip("viser", reason="viser is not installed")
FORBIDDEN, OK = 403, 200


@pytest.fixture(scope="module")
def page():
    view = LiveView(chasles.load("scara"))
    yield urlsplit(view.address)
    view.close()


def test_no_address_without_the_token_is_printed(capfd):
    LiveView(chasles.load("scara")).close()
    printed = capfd.readouterr()
    assert printed.out + printed.err == ""


def answer(page, path, **headers):
    connection = HTTPConnection("127.0.0.1", page.port, timeout=60)
    connection.request("GET", path, headers={"Host": page.netloc, **headers})
    response = connection.getresponse()
    response.read()
    connection.close()
    return response


def connects(page, path="/", **headers):
    """Test whether a WebSocket client connects."""
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    host = headers.pop("Host", page.netloc)
    try:
        with connect(
            f"ws://{host}{path}",
            additional_headers=headers,
            subprotocols=["viser-v0"],
            sock=socket.create_connection(("127.0.0.1", page.port), timeout=60),
            open_timeout=60,
        ):
            return True
    except InvalidStatus as error:
        return error.response.status_code != FORBIDDEN


def test_page_needs_the_token(page):
    assert answer(page, f"/?{page.query}").status == OK
    for path in ("/", "/?token=", f"/?{page.query}x", "/index.html", "/?token=%FF"):
        assert answer(page, path).status == FORBIDDEN


def test_cookie_of_first_response_admits_files_and_web_socket(page):
    cookie = answer(page, f"/?{page.query}").headers["Set-Cookie"]
    assert {"HttpOnly", "SameSite=Strict"} <= set(cookie.split("; "))
    pair = cookie.partition(";")[0]
    assert answer(page, "/index.html", Cookie=pair).status == OK
    assert connects(page, Cookie=pair, Origin=f"http://{page.netloc}")
    assert not connects(page, Cookie=pair + "x")
    assert not connects(page)


@pytest.mark.parametrize("origin", ["http://example.org", "null", "http://localhost:1", ""])
def test_page_of_another_origin_cannot_connect(page, origin):
    assert not connects(page, f"/?{page.query}", Origin=origin)


@pytest.mark.parametrize("host", ["example.org", "localhost.example.org", "10.0.0.1", ""])
def test_foreign_name_of_this_machine_is_refused(page, host):
    port = f":{page.port}" if host else ""
    assert answer(page, f"/?{page.query}", Host=host + port).status == FORBIDDEN
