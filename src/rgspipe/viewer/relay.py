"""A door for others to a server that listens on this machine alone: who does not know the token is turned away.

The token is the first part of the page's path. viser's page asks for its WebSocket below its own address, so that it
gives the token by itself; the door takes it away and hands on what follows.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import secrets
import threading

from rgspipe.errors import InputError

#: Bytes of a token, of a request's head at most, and of a piece that is handed on.
TOKEN, HEAD, PIECE = 18, 65536, 65536

#: Seconds in which a request's head has to arrive.
PATIENCE = 10.0

_REFUSAL = b"HTTP/1.1 403 Forbidden\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"


class Relay:
    """A running door.

    Args:
        address, port: where it is; port 0 for any that is free.
        inner: port of the server on this machine.

    Raises:
        InputError: nothing can listen there.
    """

    def __init__(self, address: str, port: int, inner: int) -> None:
        self._token, self._inner = secrets.token_urlsafe(TOKEN), inner
        self._loop = asyncio.new_event_loop()
        try:
            serving = asyncio.start_server(self._visit, address, port, limit=HEAD)
            self._server = self._loop.run_until_complete(serving)
        except OSError as error:
            self._loop.close()
            remedy = "Give an address of this machine and a free port: address=… port=…"
            where = f"{address}:{port}"
            raise InputError("address", expected="where to listen", found=f"{where}: {error}", remedy=remedy) from error
        bound = self._server.sockets[0].getsockname()[1]
        host = f"[{address}]" if ":" in address else address
        self.url = f"http://{host}:{bound}/{self._token}/"
        self._thread = threading.Thread(target=self._loop.run_forever, name="rgspipe-relay", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Close the door."""
        self._loop.call_soon_threadsafe(self._server.close)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(timeout=PATIENCE)

    async def _visit(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, TimeoutError):
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), PATIENCE)
            inner = without_token(head, self._token)
            if inner is None:
                writer.write(_REFUSAL)
                await writer.drain()
            else:
                await self._hand_on(inner, reader, writer)
        writer.close()

    async def _hand_on(self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        inside, to_inside = await asyncio.open_connection("127.0.0.1", self._inner)
        to_inside.write(head)
        ways = [asyncio.ensure_future(way) for way in (_pour(reader, to_inside), _pour(inside, writer))]
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            to_inside.close()


async def _pour(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    with contextlib.suppress(OSError):
        while piece := await reader.read(PIECE):
            writer.write(piece)
            await writer.drain()


def without_token(head: bytes, token: str) -> bytes | None:
    """The head of a request whose path begins with the token, without it and for one request alone; else None."""
    line, _, rest = head.partition(b"\r\n")
    parts = line.split(b" ")
    if len(parts) != 3:
        return None
    given, _, path = parts[1].removeprefix(b"/").partition(b"/")
    given, mark, query = given.partition(b"?")
    if not hmac.compare_digest(given, token.encode()):
        return None
    # Who has the token need not come from a page of this machine.
    lines = [one for one in rest.split(b"\r\n") if not one.lower().startswith(b"origin:")]
    if not any(one.lower().startswith(b"upgrade:") for one in lines):
        # What else comes on the connection would not be looked at: each request has one of its own.
        lines = [one for one in lines if not one.lower().startswith(b"connection:")]
        lines.insert(0, b"Connection: close")
    return b" ".join([parts[0], b"/" + path + mark + query, parts[2]]) + b"\r\n" + b"\r\n".join(lines)
