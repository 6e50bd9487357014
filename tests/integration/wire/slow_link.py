"""A TCP forwarder that lets few bytes through."""

import socket
import threading
from contextlib import suppress
from typing import Final, Self

_CHUNK: Final = 16 * 1024


class SlowLink:
    """Forwards connections to a port; what comes back from there comes slowly. Use it in a ``with`` statement.

    Args:
        target: Port to forward to.
        bytes_per_second: How much is let through on the way back.
    """

    def __init__(self, target: int, bytes_per_second: float) -> None:
        self._target = target
        self._pause_s = _CHUNK / bytes_per_second
        self._closed = threading.Event()
        self._sockets: list[socket.socket] = []
        self._threads: list[threading.Thread] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]

    def __enter__(self) -> Self:
        self._start(self._accept)
        return self

    def __exit__(self, *_: object) -> None:
        self._closed.set()
        for one in (self._listener, *self._sockets):
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
        for thread in self._threads:
            thread.join(5.0)

    def _start(self, work: "object", *arguments: object) -> None:
        thread = threading.Thread(target=work, args=arguments, daemon=True)  # type: ignore[arg-type]
        self._threads.append(thread)
        thread.start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                far = socket.socket()
                # Small buffers: a slow network does not keep megabytes for a slow reader either.
                far.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 * _CHUNK)
                far.connect(("127.0.0.1", self._target))
                self._sockets += [near, far]
                self._start(self._forward, near, far, 0.0)
                self._start(self._forward, far, near, self._pause_s)

    def _forward(self, source: socket.socket, target: socket.socket, pause_s: float) -> None:
        with suppress(OSError):
            while data := source.recv(_CHUNK):
                target.sendall(data)
                if pause_s and self._closed.wait(pause_s * len(data) / _CHUNK):
                    return
