"""Uploads to the extensions platform, to a double of it on this machine."""

import email
import re
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

import package
import publish
import release

PLATFORMS = ["linux-x64", "macos-arm64", "windows-x64"]
NOTES = "- Ümläuts,\n- and *marks*."
TOKEN = "not a token"


class _Platform(BaseHTTPRequestHandler):
    """Take zips as the platform's documented API does, but for those of one platform."""

    def do_POST(self):
        """Read the form."""
        body = self.rfile.read(int(self.headers["Content-Length"]))
        head = f"Content-Type: {self.headers['Content-Type']}\r\n\r\n".encode()
        form = {
            part.get_param("name", header="Content-Disposition"): (part.get_filename(), part.get_payload(decode=True))
            for part in email.message_from_bytes(head + body).get_payload()
        }
        self.server.taken.append((self.path, self.headers["Authorization"], form))
        code = self.server.code if "macos" in form["version_file"][0] else 201
        self.send_response(code)
        if code == 302:
            self.send_header("Location", f"http://127.0.0.1:{self.server.server_port}/elsewhere")
        self.end_headers()
        self.wfile.write(b'{"message": "as a test"}')

    do_GET = do_POST

    def log_message(self, *_):
        """Say nothing."""


@pytest.fixture
def server():
    server = ThreadingHTTPServer(("127.0.0.1", 0), _Platform)
    server.taken, server.code = [], 201
    thread = threading.Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "1.2.3"
    folder.mkdir()
    for name in PLATFORMS:
        (folder / f"x-1.2.3-{name.replace('-', '_')}.zip").write_bytes(f"\r\n--zip of {name}\r\n\0".encode())
    (folder / release.SHORT_NOTES).write_text(NOTES, encoding="utf-8", newline="\n")
    release.write_sums(folder)
    return folder


def send(folder, server, platforms=PLATFORMS):
    publish.publish(folder, platforms, TOKEN, f"http://127.0.0.1:{server.server_port}")


def test_every_zip_comes_with_notes_and_token(folder, server):
    send(folder, server)
    assert [form["version_file"] for _, _, form in server.taken] == [
        (path.name, path.read_bytes()) for path in sorted(folder.glob("*.zip"))
    ]
    assert {form["release_notes"] for _, _, form in server.taken} == {(None, NOTES.encode())}
    paths = {(path, token) for path, token, _ in server.taken}
    assert paths == {(f"/api/v1/extensions/{package.read_manifest()['id']}/versions/upload/", f"Bearer {TOKEN}")}


@pytest.mark.parametrize("code", [302, 400, 401, 500])
def test_the_first_refusal_ends_it_and_what_is_left_is_told(folder, server, code):
    """A redirect is not followed: the token is for one server."""
    server.code = code
    with pytest.raises(SystemExit) as told:
        send(folder, server)
    assert f"{code}" in str(told.value)
    assert "as a test" in str(told.value)
    assert str(told.value).endswith("Left: macos-arm64 windows-x64")
    assert len(server.taken) == 2
    server.code = 201
    send(folder, server, ["macos-arm64", "windows-x64"])
    assert len(server.taken) == 4


def test_no_server_is_told(folder, server):
    server.shutdown()
    server.server_close()
    with pytest.raises(SystemExit, match="was not taken"):
        send(folder, server)


def test_only_a_release_as_it_was_made_is_sent(folder, server):
    (folder / "x-1.2.3-linux_x64.zip").write_text("something else")
    with pytest.raises(SystemExit, match="linux_x64.zip is not what SHA256SUMS says"):
        send(folder, server)
    with pytest.raises(SystemExit, match="no release"):
        send(folder.parent, server)
    (folder / release.SHORT_NOTES).write_text("x" * 1025)
    release.write_sums(folder)
    with pytest.raises(SystemExit, match="1025 characters, more than 1024"):
        send(folder, server)
    assert server.taken == []


def test_a_token_is_needed(monkeypatch):
    monkeypatch.delenv(publish.TOKEN, raising=False)
    monkeypatch.setattr("sys.argv", ["publish.py", "1.2.3"])
    with pytest.raises(SystemExit, match=publish.TOKEN):
        publish.main()


def test_the_workflow_calls_what_there_is():
    workflow = (package.ROOT / ".github" / "workflows" / "release.yml").read_text(encoding="utf-8")
    makefile = (package.ROOT / "Makefile").read_text(encoding="utf-8")
    page = (package.ROOT / "docs" / "releasing.md").read_text(encoding="utf-8")
    targets = re.findall(r"\bmake ([a-z]+)", workflow)
    assert set(targets) >= {"lint", "release", "publish"}
    for target in targets:
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
    scripts = re.findall(r"scripts/\w+\.py", workflow)
    assert scripts
    assert all((package.ROOT / script).is_file() for script in scripts)
    assert f"{publish.TOKEN}: ${{{{ secrets.{publish.TOKEN} }}}}" in workflow
    for name in (publish.TOKEN, *re.findall(r"environment: ([\w-]+)", workflow)):
        assert f"`{name}`" in page
