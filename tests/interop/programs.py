"""halflightd, the C++ client and an independent client, as processes."""

import contextlib
import json
import os
import pathlib
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]


def plume(frame):
    return str(ROOT / f"tests/data/plume/plume.{frame:04}.ply")


def wait_for(condition, seconds=60):
    """Whether it came true within that time."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def said_by(process):
    """What an independent client has printed, once it has ended."""
    try:
        out, err = process.communicate(timeout=120)
    finally:
        process.kill()
        process.wait()
    if process.returncode != 0:
        raise RuntimeError(err.decode())
    return json.loads(out)


class Programs:
    def __init__(self, client, binaries, node_folder=""):
        self._binaries = pathlib.Path(binaries)
        self._client = {"python": [sys.executable, HERE / "python/main.py"],
                        "node": ["node", pathlib.Path(node_folder) / "main.mjs"]}[client]

    @contextlib.contextmanager
    def halflightd(self, folder, *flags):
        """A server on a unix socket in `folder`, with its log beside it: its address."""
        address = f"unix:{folder}/socket"
        with open(folder / "log", "wb") as log:
            server = subprocess.Popen([self._binaries / "halflightd", "--address", address, *flags],
                                      stderr=log)
        try:
            if not wait_for(lambda: b"listening" in (folder / "log").read_bytes()):
                raise RuntimeError((folder / "log").read_text())
            yield address
        finally:
            server.terminate()
            code = server.wait()
        if code != 0:
            raise RuntimeError(f"halflightd ended with {code}: {(folder / 'log').read_text()}")

    def start_client(self, address, *arguments, token=None):
        """The independent client, with one command."""
        environment = {**os.environ, "HALFLIGHT_PROTOS": str(ROOT / "proto"),
                       "PYTHONDONTWRITEBYTECODE": "1"}
        if token:
            environment["HALFLIGHT_TOKEN"] = token
        return subprocess.Popen([*self._client, address, *map(str, arguments)], env=environment,
                                stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE)

    def call_client(self, address, *arguments, token=None):
        """What the independent client says."""
        return said_by(self.start_client(address, *arguments, token=token))

    def cpp_client(self, *arguments):
        """halflight render, once it has ended."""
        return subprocess.run([self._binaries / "halflight", "render", "--quiet",
                               *map(str, arguments)],
                              capture_output=True, text=True, timeout=300, check=False)
