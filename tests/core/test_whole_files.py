"""Files written whole or not at all: full disks, several writers, and writers that are killed."""

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import core
from core.files import PointTable, holding, replacing, whole, write_points, writing

ROOT = Path(__file__).parents[2]
posix = pytest.mark.skipif(os.name == "nt", reason="Windows has no such locks, limits or signals")


def run(code, *arguments):
    """Start a process that runs some lines, and hands over its standard output."""
    given = [sys.executable, "-c", code, *map(str, arguments)]
    streams = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    return subprocess.Popen(given, cwd=ROOT, text=True, **streams)


HELD = """
import sys
from pathlib import Path
from core.files import replacing
with replacing(Path(sys.argv[1])) as part:
    part.write_text("other")
    print(part, flush=True)
    sys.stdin.readline()
"""


@posix
class TestFullDisk:
    FULL = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from core.files import PointTable, write_arrays, write_points
from core.tiles import cut_to_store
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
points = np.random.default_rng(0).random((20000, 3))
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
for path in map(Path, sys.argv[1:]):
    try:
        if path.name == "store":
            cut_to_store(lambda: [(points, {})], path, 9000)
        elif path.suffix == ".npz":
            write_arrays(path, {"few": points[:9], "points": points})
        else:
            write_points(path, PointTable(points))
    except ValueError as error:
        print(type(error).__name__, error.__cause__.errno, error)
"""

    def test_nothing_is_left_under_the_final_name(self, tmp_path):
        """At the system's limit for the size of a file, which a write may reach in its middle."""
        paths = [tmp_path / name for name in ("a.ply", "a.xyz", "a.csv", "a.npz", "store")]
        told, aside = run(self.FULL, *paths).communicate()
        assert aside == ""
        for path, line in zip(paths, told.splitlines(), strict=True):
            kind, number, *_ = line.split()
            assert (kind, int(number) in (errno.ENOSPC, errno.EFBIG)) == ("PointCloudError", True)
            assert f"{path} cannot be written" in line
        assert list(tmp_path.iterdir()) == []

    def test_an_older_file_stays(self, tmp_path):
        write_points(tmp_path / "a.ply", PointTable(np.eye(3)))
        before = (tmp_path / "a.ply").read_bytes()
        run(self.FULL, tmp_path / "a.ply").communicate()
        assert (tmp_path / "a.ply").read_bytes() == before


class LazrsError(RuntimeError):
    """As that of lazrs."""

    __module__ = "lazrs"


@pytest.mark.parametrize("error", [OSError("9 requested and 3 written"), LazrsError("Failed to call flush")])
def test_a_short_write_is_a_full_disk(tmp_path, error):
    with pytest.raises(core.PointCloudError, match="No space left on device") as caught, writing(tmp_path):
        raise error
    assert caught.value.__cause__.errno == errno.ENOSPC


def test_other_errors_pass(tmp_path):
    with pytest.raises(RuntimeError, match="of another kind"), writing(tmp_path):
        raise RuntimeError("of another kind")


class TestWriters:
    def test_each_of_two_has_a_part_of_its_own(self, tmp_path):
        path = tmp_path / "a.txt"
        with replacing(path) as first:
            first.write_text("first")
            with replacing(path) as second:
                second.write_text("second")
            assert path.read_text() == "second"
        assert path.read_text() == "first"
        assert [known.name for known in tmp_path.iterdir()] == ["a.txt"]

    def test_two_processes(self, tmp_path):
        path = tmp_path / "a.txt"
        other = run(HELD, path)
        other.stdout.readline()
        with replacing(path) as part:
            part.write_text("mine")
        assert path.read_text() == "mine"
        other.communicate("\n")
        assert (path.read_text(), other.returncode) == ("other", 0)
        assert [known.name for known in tmp_path.iterdir()] == ["a.txt"]

    @posix
    def test_parts_of_the_killed_are_deleted_and_those_at_work_stay(self, tmp_path, monkeypatch):
        monkeypatch.setattr(whole, "_cleaned", set())
        killed, living = run(HELD, tmp_path / "a.txt"), run(HELD, tmp_path / "b.txt")
        parts = [Path(process.stdout.readline().strip()) for process in (killed, living)]
        killed.send_signal(signal.SIGKILL)
        killed.communicate()
        assert all(part.exists() for part in parts)
        write_points(tmp_path / "c.ply", PointTable(np.eye(3)))
        assert [part.exists() for part in parts] == [False, True]
        living.communicate("\n")
        assert sorted(known.name for known in tmp_path.iterdir()) == ["b.txt", "c.ply"]

    def test_a_name_may_be_long(self, tmp_path):
        path = tmp_path / ("ä" * 120 + ".txt")
        with replacing(path) as part:
            part.write_text("long")
        assert path.read_text() == "long"


@posix
class TestHolding:
    def test_one_holds_at_a_time(self, tmp_path):
        with holding(tmp_path / "lock") as first:
            with holding(tmp_path / "lock") as second:
                assert (first, second) == (True, False)
            assert (tmp_path / "lock").exists()
        assert list(tmp_path.iterdir()) == []
        with holding(tmp_path / "lock") as again:
            assert again

    def test_the_killed_hold_nothing(self, tmp_path):
        code = HELD.replace("replacing", "holding")
        code = code.replace('    part.write_text("other")\n', "")
        other = run(code, tmp_path / "lock")
        assert other.stdout.readline() == "True\n"
        with holding(tmp_path / "lock") as free:
            assert not free
        other.send_signal(signal.SIGKILL)
        other.communicate()
        with holding(tmp_path / "lock") as free:
            assert free

    def test_where_files_cannot_be_locked_all_hold(self, tmp_path, monkeypatch):
        def fail(*_):
            raise OSError(errno.ENOLCK, "No locks available")

        monkeypatch.setattr(whole.fcntl, "flock", fail)
        with holding(tmp_path / "lock") as first, holding(tmp_path / "lock") as second:
            assert (first, second) == (True, True)


def test_a_cut_that_another_process_is_at_is_told(tmp_path):
    points = core.example_sphere()
    with holding(tmp_path / ".store.lock"), pytest.raises(core.PointCloudError, match="at work in"):
        core.tiles.cut_to_store(lambda: [(points, {})], tmp_path / "store", 400)
    core.tiles.cut_to_store(lambda: [(points, {})], tmp_path / "store", 400)
    assert [known.name for known in tmp_path.iterdir()] == ["store"]
