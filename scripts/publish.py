"""Upload a release to Blender's extensions platform: publish.py VERSION [PLATFORM ...].

The zips of dist/VERSION are sent one by one with the short release notes, and the platform makes one version of them.
It has to know the extension already: the first version is submitted by hand, see docs/releasing.md. The environment
variable BLENDER_EXTENSIONS_TOKEN holds a token of an account that may upload it.
"""

import argparse
import os
import secrets
import sys
import urllib.error
import urllib.request

import changelog
import package
import pythons
import release

PLATFORM = "https://extensions.blender.org"
TOKEN = "BLENDER_EXTENSIONS_TOKEN"
_SECONDS = 600  # for one zip


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """A redirect is an error: the token is for this server only."""

    def redirect_request(self, *_):
        """Follow none."""


def check(folder):
    """Stop unless a folder is a release as it was made."""
    if not (folder / release.SUMS).is_file():
        sys.exit(f"There is no release in {folder}: make release makes it")
    for line in (folder / release.SUMS).read_text(encoding="utf-8").splitlines():
        expected, name = line.split("  ", 1)
        if not (folder / name).is_file() or package.sha256(folder / name) != expected:
            sys.exit(f"{folder / name} is not what {release.SUMS} says: make the release again")


def upload(archive, notes, token, server=PLATFORM):
    """Send a zip as a version, or as another platform of the version, and return the server's answer.

    Parameters
    ----------
    archive : pathlib.Path
    notes : str
        At most 1,024 characters.
    token : str
    server : str
        Address without a path.

    Returns
    -------
    str
    """
    boundary = secrets.token_hex(16)
    fields = (
        ('name="release_notes"', notes.encode()),
        (f'name="version_file"; filename="{archive.name}"\r\nContent-Type: application/zip', archive.read_bytes()),
    )
    parts = [f"--{boundary}\r\nContent-Disposition: form-data; {head}\r\n\r\n".encode() + body for head, body in fields]
    request = urllib.request.Request(
        f"{server}/api/v1/extensions/{package.read_manifest()['id']}/versions/upload/",
        data=b"\r\n".join([*parts, f"--{boundary}--\r\n".encode()]),
        headers={"Authorization": f"Bearer {token}", "Content-Type": f"multipart/form-data; boundary={boundary}"},
        method="POST",
    )
    with urllib.request.build_opener(_NoRedirect).open(request, timeout=_SECONDS) as answer:
        return answer.read().decode("utf-8", "replace")


def publish(folder, platforms, token, server=PLATFORM):
    """Upload the zips of a release for some platforms; stop at the first that is refused, and say what is left."""
    check(folder)
    notes = (folder / release.SHORT_NOTES).read_text(encoding="utf-8")
    if len(notes) > changelog.LONGEST:
        sys.exit(f"{release.SHORT_NOTES} has {len(notes)} characters, more than {changelog.LONGEST}")
    for number, name in enumerate(platforms):
        (archive,) = folder.glob(f"*-{name.replace('-', '_')}.zip")
        try:
            upload(archive, notes, token, server)
        except OSError as error:
            told = error.read().decode("utf-8", "replace") if isinstance(error, urllib.error.HTTPError) else ""
            sys.exit(f"{archive.name} was not taken: {error} {told}\nLeft: {' '.join(platforms[number:])}")
        print(f"{archive.name}: uploaded", flush=True)


def main():
    """Upload a release by the token of the environment."""
    platforms = package.read_manifest()["platforms"]
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("version", help="of the release in dist/")
    parser.add_argument("platforms", nargs="*", metavar="PLATFORM", help=f"all unless named: {', '.join(platforms)}")
    arguments = parser.parse_args()
    unknown = set(arguments.platforms) - set(platforms)
    if unknown:
        parser.error(f"there is no platform {', '.join(sorted(unknown))}")
    if not os.environ.get(TOKEN):
        sys.exit(f"Set {TOKEN} to a token of your account at {PLATFORM}")
    publish(package.OUTPUT / arguments.version, arguments.platforms or platforms, os.environ[TOKEN])


if __name__ == "__main__":
    pythons.use_supported()
    main()
