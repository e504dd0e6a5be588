"""A relay before a server that damages or cuts what passes: what a bad network does, on purpose."""

import socket
import threading
import time


class Cut(Exception):
    pass


class CutAfter:
    """Ends the first connection after about so many bytes, and a pause in which the server can take
    what it has; `then` is called before the next connection is let through."""

    def __init__(self, count, pause_s, then):
        self.left, self.pause_s, self.then, self.done = count, pause_s, then, False

    def __call__(self, data):
        self.left -= len(data)
        if self.left < 0 and not self.done:
            self.done = True
            time.sleep(self.pause_s)
            raise Cut
        return data


class FlipOnce:
    """Flips one bit, once, somewhere in what is known to come: bytes of `content`."""

    def __init__(self, content):
        self.needles = [content[at:at + 16] for at in range(0, len(content) - 16, 97)]
        self.done = False

    def __call__(self, data):
        at = -1 if self.done else max(map(data.find, self.needles))
        if at < 0:
            return data
        self.done = True
        return data[:at] + bytes([data[at] ^ 1]) + data[at + 1:]


class Relay:
    """Listens on a free port of loopback, and hands connections on to a unix socket."""

    def __init__(self, path, to_server=(), to_client=()):
        self._path, self._to_server, self._to_client = path, to_server, to_client
        self._open = threading.Event()
        self._open.set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:{}".format(self._listener.getsockname()[1])
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._listener.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        self._listener.close()

    def _accept(self):
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client):
        self._open.wait()
        with client, socket.socket(socket.AF_UNIX) as server:
            server.connect(str(self._path))
            back = threading.Thread(target=self._pump, args=(server, client, self._to_client))
            back.start()
            self._pump(client, server, self._to_server)
            back.join()

    def _pump(self, source, sink, hooks):
        try:
            while data := source.recv(65536):
                for hook in hooks:
                    try:
                        data = hook(data)
                    except Cut:
                        self._open.clear()
                        self._end(source, sink)
                        hook.then()
                        self._open.set()
                        return
                sink.sendall(data)
        except OSError:
            pass
        self._end(source, sink)

    @staticmethod
    def _end(*ends):
        for end in ends:
            try:
                end.shutdown(socket.SHUT_RDWR)  # not close: the other direction may be reading
            except OSError:
                pass
