"""Limits of memory and cores by the control groups of a process, of both versions, nested, and within containers."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from core import cores, memory
from core.control_groups import groups_of

ROOT = Path(__file__).parents[2]
MEMORY_1, MEMORY_2 = (
    ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    ("memory.max", "memory.current", "inactive_file"),
)
NO_LIMIT = {1: "9223372036854771712", 2: "max"}


def limit(folder, most, version, used=400, cached=100):
    """Make a group with a limit of memory."""
    folder.mkdir(parents=True, exist_ok=True)
    names = MEMORY_1 if version == 1 else MEMORY_2
    (folder / names[0]).write_text(f"{most}\n")
    (folder / names[1]).write_text(f"{used}\n")
    (folder / "memory.stat").write_text(f"anon 300\n{names[2]} {cached}\n")


def free(own, root):
    return min(memory._group_memory(groups_of("memory", own, root)), default=None)


# What the system tells of a process, where its groups are, and the folder in which those of memory begin.
KINDS = {
    "version 2": (2, "0::{path}\n", "."),
    "version 1": (1, "9:name=systemd:/x\n4:memory:{path}\n2:cpu,cpuacct:/y\n0::/\n", "memory"),
    "both": (2, "1:name=systemd:/x\n0::{path}\n", "unified"),
}


@pytest.mark.parametrize("kind", KINDS)
class TestMemory:
    @pytest.fixture
    def group(self, tmp_path, kind):
        """Function that tells of a process in a group, and returns what the system tells, the root, and the home."""
        version, text, home = KINDS[kind]

        def group(path):
            (tmp_path / "own").write_text(text.format(path=path))
            return version, tmp_path / "own", tmp_path / "root", tmp_path / "root" / home

        return group

    def test_its_own_limit(self, group):
        version, own, root, home = group("/slurm/job_7/step_0")
        limit(home / "slurm" / "job_7" / "step_0", 1000, version)
        assert free(own, root) == 1000 - 400 + 100

    def test_the_least_of_those_around_it(self, group):
        version, own, root, home = group("/slurm/job_7/step_0")
        limit(home / "slurm" / "job_7" / "step_0", NO_LIMIT[version], version)
        limit(home / "slurm" / "job_7", 900, version, used=600)
        limit(home / "slurm", 5000, version)
        assert free(own, root) == 900 - 600 + 100
        limit(home / "slurm" / "job_7" / "step_0", 450, version)
        assert free(own, root) == 150

    def test_a_group_that_is_full_has_nothing_left(self, group):
        version, own, root, home = group("/job")
        limit(home / "job", 100, version)
        assert free(own, root) == 0

    def test_groups_of_others_do_not_count(self, group):
        version, own, root, home = group("/job_7")
        limit(home / "job_7", 2000, version)
        limit(home / "job_8", 500, version)
        assert free(own, root) == 1700

    @pytest.mark.parametrize("inner", ["", "/step_0"])
    def test_a_container_sees_its_groups_from_its_own_on(self, group, inner):
        version, own, root, home = group(f"/docker/abc{inner}")
        limit(home, 3000, version)
        if inner:
            limit(home / "step_0", 1000, version)
        assert free(own, root) == (700 if inner else 2700)

    def test_no_limit(self, group):
        version, own, root, home = group("/job")
        assert free(own, root) is None
        limit(home / "job", NO_LIMIT[version], version)
        assert (free(own, root) or 1 << 62) >= 1 << 62


def test_another_system(tmp_path):
    assert list(groups_of("memory", tmp_path / "none", tmp_path)) == []


@pytest.mark.parametrize(
    ("name", "files", "text", "count"),
    [
        (".", {"cpu.max": "max 100000"}, "0::/a/b", None),
        (".", {"cpu.max": "200000 100000"}, "0::/a/b", 2),
        (".", {"cpu.max": "150000 100000"}, "0::/a/b", 2),
        (".", {"cpu.max": "5000 100000"}, "0::/a/b", 1),
        ("cpu", {"cpu.cfs_quota_us": "-1", "cpu.cfs_period_us": "100000"}, "2:cpu,cpuacct:/a/b", None),
        ("cpu", {"cpu.cfs_quota_us": "250000", "cpu.cfs_period_us": "100000"}, "2:cpu:/a/b", 3),
        ("cpu,cpuacct", {"cpu.cfs_quota_us": "50000", "cpu.cfs_period_us": "100000"}, "2:cpu,cpuacct:/a/b", 1),
    ],
)
@pytest.mark.parametrize("group", ["a/b", "a"])
def test_cores(tmp_path, name, files, text, count, group):
    (tmp_path / "own").write_text(text)
    (tmp_path / name / "a" / "b").mkdir(parents=True)
    for file, held in files.items():
        (tmp_path / name / group / file).write_text(f"{held}\n")
    groups = groups_of("cpu", tmp_path / "own", tmp_path)
    assert min(cores._group_cores(groups), default=None) == count


@pytest.fixture
def nested():
    """A real group within one that is limited to 300 MB; the folder of the inner one."""
    homes = [Path("/sys/fs/cgroup/memory"), Path("/sys/fs/cgroup")]
    outer = next((home for home in homes if (home / "cgroup.procs").exists()), homes[1]) / f"meshfree-{os.getpid()}"
    inner = outer / "inner"
    try:
        inner.mkdir(parents=True)
        limits = [outer / name for name in ("memory.limit_in_bytes", "memory.max") if (outer / name).exists()]
        limits[0].write_text(str(300 << 20))
    except (OSError, IndexError):
        pytest.skip("groups of memory cannot be made here")
    try:
        yield inner
    finally:
        inner.rmdir()
        outer.rmdir()


def test_a_real_one(nested):
    code = f"""
import os
from pathlib import Path
Path({str(nested / "cgroup.procs")!r}).write_text(str(os.getpid()))
from core.memory import available_memory
print(available_memory())
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert 100 << 20 < int(done.stdout) < 300 << 20
