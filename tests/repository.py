"""A repository of extensions, as a release lists it, on a server of this machine."""

import contextlib
import functools
import threading
import zipfile
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import package

OLDER = "0.0.1"


def make_older(archive, path, **added):
    """Write the zip of an older version: a copy of another one, with files added, by their names and texts."""
    line = 'version = "{}"\n'
    now, then = (line.format(version).encode() for version in (package.read_manifest()["version"], OLDER))
    with zipfile.ZipFile(archive) as packed, zipfile.ZipFile(path, "w") as opened:
        for name in packed.namelist():
            content = packed.read(name)
            if name == "blender_manifest.toml":
                assert content.count(b"\n" + now) == 1
                content = content.replace(b"\n" + now, b"\n" + then)
            opened.writestr(name, content)
        for name, text in added.items():
            opened.writestr(name, text)


class _Handler(SimpleHTTPRequestHandler):
    """Serve a folder as github.com does the latest release: under one address, which redirects to another one."""

    def do_GET(self):
        """Send a file, or where it is."""
        if self.path.startswith("/latest/"):
            self.send_response(302)
            self.send_header("Location", self.path.replace("/latest/", "/v1/"))
            self.end_headers()
        else:
            self.server.asked.append(self.path.partition("?")[0])
            self.path = self.path.replace("/v1/", "/")
            super().do_GET()

    def log_message(self, *_):
        """Say nothing."""


@contextlib.contextmanager
def served(folder):
    """Serve a folder on the loopback address; yield the address of its index, and what is asked for, as it comes."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(_Handler, directory=str(folder)))
    server.asked = []
    thread = threading.Thread(target=server.serve_forever, args=(0.05,))
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/latest/index.json", server.asked
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
