"""Who does not know the token does not get in, and who does gets what the server inside says."""

from __future__ import annotations

import http.server
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator

import pytest

from rgspipe.errors import InputError
from rgspipe.viewer.relay import Relay, without_token


class Echo(http.server.BaseHTTPRequestHandler):
    """Answers with what was asked for."""

    def do_GET(self) -> None:
        content = f"{self.path} {self.headers.get('Connection')}".encode()
        self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, *args: object) -> None:
        """Silence."""


@pytest.fixture(scope="module")
def relay() -> Iterator[Relay]:
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Echo)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    door = Relay("127.0.0.1", 0, server.server_address[1])
    yield door
    door.stop()
    server.shutdown()
    server.server_close()


def asked(url: str) -> str:
    with urllib.request.urlopen(url, timeout=10) as answer:
        return answer.read().decode()


def test_with_the_token_the_rest_of_the_path_is_asked_for(relay: Relay) -> None:
    assert asked(relay.url) == "/ close"
    assert asked(relay.url + "a/b?c=d") == "/a/b?c=d close"


@pytest.mark.parametrize("path", ["", "wrong/", "wrong", "..", "%2e%2e/"])
def test_without_it_nothing_is_told(relay: Relay, path: str) -> None:
    base = relay.url.rsplit("/", 2)[0]
    with pytest.raises(urllib.error.HTTPError, match="403"):
        asked(f"{base}/{path}")


def test_a_websocket_keeps_its_connection() -> None:
    head = b"GET /key HTTP/1.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\r\n"
    assert without_token(head, "key") == b"GET / HTTP/1.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\r\n"


@pytest.mark.parametrize(
    "head", [b"", b"\r\n\r\n", b"GET /key\r\n\r\n", b"GET /key/../x y HTTP/1.1\r\n\r\n", b"\xff \xff \xff"]
)
def test_what_is_no_request_is_refused(head: bytes) -> None:
    assert without_token(head, "key") is None


def test_where_nothing_can_listen_is_refused() -> None:
    with pytest.raises(InputError, match="address"):
        Relay("203.0.113.1", 0, 1)
