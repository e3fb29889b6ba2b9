"""Clouds larger than memory on several workers: the installed program with Dask, and a worker killed in the middle."""

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time

import dask
import distributed
import numpy as np
import psutil
import pytest
import yaml

from .conftest import ROOT, call, site

CODE = "import sys; from meshfree_laplacian.command.main import main; sys.exit(main())"
# Tells after a second that nobody answers.
SOON = f"from meshfree_laplacian.command import tile_work; tile_work._CONNECTING = 1; {CODE}"
LENGTH, RADIUS, COUNT = 12.0, 0.1, 2800
OPTIONS = ("--tile-points", 490, "--memory", "2GB", "--format", "npy")
KILLED_AFTER = "agreed-spacing.npz"  # what is there when a worker is killed


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with points of a rod."""
    folder = tmp_path_factory.mktemp("rod")
    rng = np.random.default_rng(0)
    angle, along = rng.uniform(0.0, 2.0 * np.pi, COUNT), rng.uniform(0.0, LENGTH, COUNT)
    np.save(folder / "rod.npy", np.column_stack([along, RADIUS * np.cos(angle), RADIUS * np.sin(angle)]))
    return folder


def measured(store):
    """Return all results in a store, by file and name."""
    found = {}
    for path in sorted(store.rglob("measure.npz")):
        with np.load(path) as arrays:
            found |= {(path.parent.name, name): arrays[name] for name in arrays.files if name != "seconds"}
    return found


def command(out, workers):
    return [sys.executable, "-c", CODE, *map(str, ("tiles", "run", "rod.npy", "--out-dir", out, "--workers", workers)),
            *map(str, OPTIONS)]  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL there")
def test_a_killed_worker_changes_nothing(place, folder):
    known = {"PYTHONPATH": str(site(place)), "OPENBLAS_NUM_THREADS": "1"}
    line = json.loads(call(*command("alone", 1), cwd=folder, env=known))
    assert (line["points"], line["failed_tiles"], line["tiles"]) == (COUNT, 0, 6)
    running = subprocess.Popen(
        command("together", 2), cwd=folder, env={**os.environ, **known}, stdout=subprocess.PIPE, text=True
    )
    try:
        store = folder / "together" / "store"
        while not (store / KILLED_AFTER).exists():
            assert running.poll() is None
            time.sleep(0.02)
        workers = [one for one in psutil.Process(running.pid).children() if "spawn_main" in " ".join(one.cmdline())]
        assert len(workers) == 2
        workers[0].send_signal(signal.SIGKILL)
        printed, _ = running.communicate(timeout=250)
    finally:
        running.kill()
    assert running.returncode == 0
    assert json.loads(printed.splitlines()[-1])["total_area"] == line["total_area"]
    first, second = measured(folder / "alone" / "store"), measured(store)
    assert first.keys() == second.keys()
    assert len(first) > 60
    for key, values in first.items():
        np.testing.assert_array_equal(second[key], values)
    assert not list(store.rglob(".*"))
    assert not list(store.rglob("state-*"))


def ending(place, before=""):
    """Run a task that ends its workers, after some other lines, and return what is printed."""
    code = f"""
import os
from meshfree_laplacian.command import tile_work
{before}
with tile_work.workers(2, "") as spread:
    try:
        list(spread(os._exit, [(1,)]))
    except tile_work.core.NotEnoughMemoryError as error:
        print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(site(place))},
        capture_output=True,
        text=True,
        timeout=250,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


def test_workers_that_end_one_after_the_other_are_told(place):
    told, besides = ending(place)
    assert "--tile-points" in told
    assert "Traceback" not in besides


def test_workers_that_do_not_come_back_are_told(place):
    # Given up as soon as they end, as they are by default where they take longer than 15 s to come back.
    soon = {"distributed.deploy.lost-worker-timeout": "50ms", "distributed.scheduler.no-workers-timeout": "3s"}
    told, besides = ending(place, f"tile_work._LOCAL.update({soon}); tile_work._CLOSING = 5")
    assert "--tile-points" in told
    assert "Traceback" not in besides


def test_workers_that_dask_does_not_close_are_told_and_change_nothing(place):
    told, besides = ending(
        place,
        """
import distributed
async def fail(self):
    raise AssertionError("starting")
distributed.LocalCluster._close = fail
""",
    )
    assert "--tile-points" in told
    assert "did not close them: AssertionError('starting')" in besides


@pytest.mark.skipif(sys.platform == "win32", reason="no Ctrl-C for one program there")
def test_ctrl_c_stops_all_workers_in_a_word(place, folder):
    # A shell that runs programs in the background lets them ignore Ctrl-C.
    listens = f"import signal; signal.signal(signal.SIGINT, signal.default_int_handler); {CODE}"
    python, option, _, *arguments = command("stopped", 2)
    running = subprocess.Popen(
        [python, option, listens, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(site(place)), "OPENBLAS_NUM_THREADS": "1"},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        while not (folder / "stopped" / "store" / KILLED_AFTER).exists():
            assert running.poll() is None
            time.sleep(0.02)
        workers = psutil.Process(running.pid).children(recursive=True)
        os.killpg(running.pid, signal.SIGINT)  # as a terminal sends it, to all of the program's processes
        _, besides = running.communicate(timeout=100)
    finally:
        running.kill()
    assert running.returncode == 130
    assert besides.endswith("Stopped\n")
    assert "Traceback" not in besides
    assert not psutil.wait_procs(workers, timeout=10)[1]


def test_the_manual_has_the_settings_of_dask(place):
    code = "import json; from meshfree_laplacian.command.tile_work import DASK; print(json.dumps(DASK))"
    settings = json.loads(call(sys.executable, "-c", code, env={"PYTHONPATH": str(site(place))}))
    wanted = {}
    dask.config.set(settings, config=wanted)
    page = (ROOT / "docs" / "tiles.md").read_text(encoding="utf-8")
    [text] = re.findall(r"^```yaml\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert yaml.safe_load(text) == wanted


def run(place, folder, *arguments, code=CODE):
    """Run tiles in a folder, and return the exit code, the last line, and what is told besides."""
    known = {**os.environ, "PYTHONPATH": str(site(place)), "OPENBLAS_NUM_THREADS": "1"}
    given = [sys.executable, "-c", code, "tiles", "run", "rod.npy", *map(str, (*arguments, *OPTIONS))]
    done = subprocess.run(given, cwd=folder, env=known, capture_output=True, text=True, timeout=250)
    return done.returncode, json.loads(done.stdout.splitlines()[-1]), done.stderr


@pytest.fixture
def cluster(place):
    """Function that starts a scheduler and a worker, with the program or without it; returns them and the address."""
    started = []

    def start(knows=True):
        known = {**os.environ, "DASK_LOGGING__DISTRIBUTED": "critical", "OPENBLAS_NUM_THREADS": "1"}
        known["PYTHONPATH"] = str(site(place)) if knows else ""
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        address = f"tcp://127.0.0.1:{port}"
        commands = (
            ["dask_scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard"],
            ["dask_worker", address, "--nthreads", 1, "--no-dashboard"],
        )
        for name, *given in commands:
            command = [sys.executable, "-m", f"distributed.cli.{name}", *map(str, given)]
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            started.append(subprocess.Popen(command, env=known, cwd="/", start_new_session=True, **quiet))
        with distributed.Client(address, timeout=60) as client:
            client.wait_for_workers(1, timeout=60)
        return started, address

    yield start
    for one in started:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(one.pid, signal.SIGKILL)
        one.wait()


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nowhere", "tcp://no.such.host.invalid:8786"])
def test_a_scheduler_that_does_not_answer_is_told_before_any_work(place, folder, tmp_path, address):
    code, line, besides = run(place, folder, "--out-dir", tmp_path / "out", "--scheduler", address, code=SOON)
    assert (code, "No scheduler of Dask answers" in line["error"], address in line["error"]) == (1, True, True)
    assert "Traceback" not in besides
    assert not (tmp_path / "out" / "store").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL there")
class TestCluster:
    def test_workers_that_cannot_run_the_program_are_told_before_any_work(self, place, folder, tmp_path, cluster):
        _, address = cluster(knows=False)
        code, line, besides = run(place, folder, "--out-dir", tmp_path / "out", "--scheduler", address)
        assert (code, "cannot run this program" in line["error"]) == (1, True)
        assert "Install the same version there" in line["error"]
        assert "Traceback" not in besides
        assert not (tmp_path / "out" / "store").exists()

    def test_a_scheduler_that_ends_in_the_middle_is_told_and_the_run_goes_on_later(
        self, place, folder, tmp_path, cluster
    ):
        (scheduler, _), address = cluster()
        out = tmp_path / "out"
        known = {**os.environ, "PYTHONPATH": str(site(place)), "OPENBLAS_NUM_THREADS": "1"}
        given = [sys.executable, "-c", CODE, "tiles", "run", "rod.npy", "--out-dir", out, *OPTIONS]
        given += ["--scheduler", address]
        running = subprocess.Popen(
            list(map(str, given)), cwd=folder, env=known, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        try:
            while not (out / "store" / KILLED_AFTER).exists():
                assert running.poll() is None
                time.sleep(0.02)
            os.killpg(scheduler.pid, signal.SIGKILL)
            printed, besides = running.communicate(timeout=250)
        finally:
            running.kill()
        assert running.returncode == 1
        assert "The cluster failed" in json.loads(printed.splitlines()[-1])["error"]
        assert "Traceback" not in besides
        code, line, _ = run(place, folder, "--out-dir", out)
        assert (code, line["points"], line["failed_tiles"]) == (0, COUNT, 0)
