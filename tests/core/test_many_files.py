"""Many files on the command line: lists, shares, reports, what need not be done again, and exit codes."""

import errno
import io
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere
from command import records, tool_verb, verbs
from command.line import run as run_command

ROOT = Path(__file__).parents[2]
POINTS = fibonacci_sphere(200)


@pytest.fixture
def folder(tmp_path):
    """A folder with eight clouds of a delivery, one of them broken."""
    (tmp_path / "in").mkdir()
    for number in range(8):
        np.save(tmp_path / "in" / f"LHD_{650 + number % 2}_{9 + number}.npy", (1.0 + number) * POINTS)
    (tmp_path / "in" / "LHD_651_12.npy").write_bytes(b"nothing")
    return tmp_path


def names(lines):
    return [line["file"].rpartition("/")[2] for line in lines]


class TestInputs:
    def test_a_folder_stands_for_all_its_files_in_the_order_of_numbers(self, run, folder):
        (folder / "in" / "notes.pdf").write_text("no points")
        _, lines = run("info", folder / "in")
        assert names(lines) == [
            f"LHD_{group}_{n}.npy" for group in (650, 651) for n in range(9, 17) if n % 2 == 651 - group
        ]
        (folder / "empty").mkdir()
        assert run("info", folder / "empty") == (2, [])

    @pytest.mark.parametrize("count", [1, 2])
    def test_a_numbered_name_hides_no_other(self, run, folder, count):
        (folder / "few").mkdir()
        for name in ("north", "south", *(f"east{number}" for number in range(2, 2 + count))):
            np.save(folder / "few" / f"{name}.npy", POINTS)
        _, lines = run("info", folder / "few")
        assert len(names(lines)) == 2 + count
        assert all(line["notices"] == [] for line in lines)

    def test_what_is_left_out_of_a_folder_stands_in_the_report(self, run, folder, capsys):
        (folder / "few").mkdir()
        for name in ("f_10", "f_9", "plan"):
            np.save(folder / "few" / f"{name}.npy", POINTS)
        for number in range(7):
            (folder / "few" / f"{number}.fls").write_text("of another kind")
        report = folder / "r" / "1.jsonl"
        given = "analyze", folder / "few", "--sequence", "--modes", 3, "--report", report
        assert run_command([*map(str, given)], verbs.make_verbs(), "meshfree") == 0
        printed = capsys.readouterr()
        text = f"Left out 8 of the files in {folder / 'few'}: 0.fls, 1.fls, 2.fls, 3.fls, 4.fls, ..."
        assert text in printed.err
        first, second = map(json.loads, report.read_text().splitlines())
        assert names([first, second]) == ["f_9.npy", "f_10.npy"]
        assert [text in " ".join(record["notices"]) for record in (first, second)] == [True, False]

    def test_a_list_in_a_file_or_from_standard_input(self, run, folder, monkeypatch):
        wanted = [folder / "in" / name for name in ("LHD_650_11.npy", "LHD_651_10.npy")]
        text = f"{wanted[0]}\n\n  {wanted[1]}  \n"
        (folder / "list.txt").write_text(text, encoding="utf-8-sig")
        assert names(run("info", "--files-from", folder / "list.txt")[1]) == ["LHD_650_11.npy", "LHD_651_10.npy"]
        monkeypatch.setattr(sys, "stdin", io.StringIO(text))
        assert len(run("info", folder / "in" / "LHD_650_9.npy", "--files-from", "-")[1]) == 3

    @pytest.mark.parametrize("count", [1, 3, 8, 11])
    def test_shares_are_equal_and_hold_each_file_once(self, run, folder, count):
        shares = [names(run("info", folder / "in", "--part", f"{k}/{count}")[1]) for k in range(1, count + 1)]
        assert sorted(name for share in shares for name in share) == sorted(names(run("info", folder / "in")[1]))
        assert max(map(len, shares)) - min(map(len, shares)) <= 1

    @pytest.mark.parametrize(
        "arguments",
        [
            (),
            ("--files-from", "none.txt"),
            ("a.npy", "--part", "0/4"),
            ("a.npy", "--part", "5/4"),
            ("a.npy", "--part", "1"),
            ("a.npy", "--skip-done"),
            ("a.npy", "--report", "a.txt"),
        ],
        ids=" ".join,
    )
    def test_wrong_usage(self, run, arguments):
        assert run("info", *arguments) == (2, [])

    def test_frames_are_not_divided(self, run, folder):
        assert run("analyze", "--sequence", folder / "in", "--modes", 3)[0] == 2  # of two names
        assert run("analyze", "--sequence", folder / "in" / "LHD_650_9.npy", "--modes", 3, "--part", "1/2")[0] == 2

    def test_outputs_of_other_shares_count_too(self, run, folder):
        (folder / "other").mkdir()
        np.save(folder / "other" / "LHD_650_9.npy", POINTS)
        files = folder / "in" / "LHD_650_9.npy", folder / "other" / "LHD_650_9.npy"
        assert run("convert", *files, "--part", "1/2", "--out-dir", folder / "out")[0] == 2


class TestReports:
    def thin(self, run, folder, *options, source="in"):
        given = "--by", "number", "--count", 50, "--out-dir", folder / "out", "--report", folder / "r" / "1.jsonl"
        return run("thin-out", folder / source, *given, *options)

    def test_errors_in_the_report_are_no_failure(self, run, folder):
        code, lines = self.thin(run, folder)
        assert (code, ["error" in line for line in lines].count(True)) == (0, 1)
        assert run("info", folder / "in")[0] == 1
        kept = [json.loads(line) for line in (folder / "r" / "1.jsonl").read_text().splitlines()]
        assert [record["file"] for record in kept] == [line["file"] for line in lines]
        assert all(record["settings"]["count"] == 50 and record["elapsed"] >= 0.0 for record in kept)

    def test_what_is_done_is_left_out(self, run, folder):
        self.thin(run, folder)
        before = {path: path.stat().st_mtime_ns for path in (folder / "out").iterdir()}
        code, lines = self.thin(run, folder, "--skip-done")
        assert (code, [line.get("skipped", False) for line in lines].count(True)) == (0, 7)
        assert [line["file"] for line in lines if "error" in line] == [str(folder / "in" / "LHD_651_12.npy")]
        assert {path: path.stat().st_mtime_ns for path in (folder / "out").iterdir()} == before

    @pytest.mark.parametrize("change", ["input", "output", "no output", "settings", "folder", "verb"])
    def test_what_has_changed_is_done_again(self, run, folder, change):
        self.thin(run, folder)
        inputs, outputs = folder / "in" / "LHD_650_9.npy", folder / "out" / "LHD_650_9.ply"
        options, again = [], {str(inputs)}
        if change == "input":
            np.save(inputs, 3.0 * POINTS)
        elif change == "output":
            outputs.write_bytes(outputs.read_bytes() + b"\n")
        elif change == "no output":
            outputs.unlink()
        elif change == "settings":
            options, again = ["--count", 40], None
        elif change == "folder":
            options, again = ["--out-dir", folder / "new"], None
        if change == "verb":
            given = "--out-dir", folder / "out", "--report", folder / "r" / "1.jsonl", "--skip-done"
            code, lines = run("convert", folder / "in", *given)
            again = None
        else:
            code, lines = self.thin(run, folder, "--skip-done", *options)
        done = {line["file"] for line in lines if "skipped" not in line and "error" not in line}
        assert code == 0
        assert done == again if again else len(done) == 7

    def test_a_share_knows_what_others_have_done(self, run, folder):
        for k in (1, 2):
            self.thin(run, folder, "--part", f"{k}/2", "--report", folder / "r" / f"{k}.jsonl")
        lines = [self.thin(run, folder, "--part", f"{k}/3", "--skip-done")[1] for k in (1, 2, 3)]
        assert sum(line.get("skipped", False) for part in lines for line in part) == 7

    def test_what_is_done_with_several_settings_is_known_for_each(self, run, folder):
        for _ in range(2):
            for count in (50, 40):
                options = "--count", count, "--out-dir", folder / f"out{count}", "--skip-done"
                lines = self.thin(run, folder, *options)[1]
        assert [line.get("skipped", False) for line in lines].count(True) == 7
        assert run("report", folder / "r")[1][0]["files"] == 8

    def test_other_files_that_are_read_count_too(self, run, folder):
        body = POINTS * [1.0, 0.8, 0.5]
        for name in ("a", "plan"):
            np.save(folder / f"{name}.npy", body)
        given = "align", folder / "a.npy", "--reference", folder / "plan.npy", "--report", folder / "r.jsonl"
        assert "skipped" not in run(*given)[1][0]
        assert run(*given, "--skip-done")[1] == [{"file": str(folder / "a.npy"), "skipped": True}]
        np.save(folder / "plan.npy", body + 0.01)
        assert "skipped" not in run(*given, "--skip-done")[1][0]

    def test_a_writer_that_was_killed_leaves_all_but_its_last_line(self, run, folder):
        self.thin(run, folder)
        report = folder / "r" / "1.jsonl"
        lines = report.read_bytes().splitlines(keepends=True)
        report.write_bytes(b"".join(lines[:3]) + lines[3][:40])
        _, printed = self.thin(run, folder, "--skip-done")
        assert [line.get("skipped", False) for line in printed[:3]] == [True] * 3
        found, broken = records.read_reports(folder / "r")
        assert (len(records.last_records(found)), broken) == (8, 1)
        code, [line] = run("report", folder / "r")
        assert (code, line["files"], "1 lines are no records" in line["notices"][0]) == (0, 8, True)

    @pytest.mark.parametrize("shares", [(1, 2), (2,)])
    def test_files_that_were_never_reached_are_counted(self, run, folder, monkeypatch, shares):
        """A program that ends at its second file, as by SIGKILL, and shares that were not begun."""

        def end(self, task):
            if task.path.stem == "LHD_650_13":
                raise KeyboardInterrupt
            return {"points": 200}, []

        monkeypatch.setattr(verbs.Info, "work", end)
        for share in shares:
            given = "info", folder / "in", "--part", f"{share}/2", "--report", folder / "r" / f"{share}.jsonl"
            if share == 1:
                with pytest.raises(KeyboardInterrupt):
                    run(*given)
            else:
                run(*given)
        code, [line] = run("report", folder / "r", "--out", folder / "table.csv")
        assert (code, line["files"], line["points"]) == (0, 8, 600 + 200 * (1 in shares))
        lost = [error["path"] for error in line["errors"] if "not reached" in error["error"]]
        ends = ["650_13", "651_10", "651_14"] if 1 in shares else []
        assert lost == [str(folder / "in" / f"LHD_{end}.npy") for end in ends]
        assert ("share 1 of 2, was not begun: 4 files" in str(line["errors"])) == (1 not in shares)
        assert line["unreached"] == (3 if 1 in shares else 4)
        assert line["failed"] == line["unreached"] + 1
        assert "8 files" in (folder / "table.csv").read_text().splitlines()[-1]
        monkeypatch.undo()
        for share in (1, 2):
            run("info", folder / "in", "--part", f"{share}/2", "--report", folder / "r" / f"{share}.jsonl")
        code, [line] = run("report", folder / "r")
        assert (line["files"], line["failed"], line["unreached"], line["points"]) == (8, 1, 0, 1400)

    def test_files_are_reached_by_the_last_settings_only(self, run, folder, monkeypatch):
        self.thin(run, folder)
        monkeypatch.setattr("command.line._do", lambda *_: 3)
        self.thin(run, folder, "--skip-done")
        assert run_command(["report", str(folder / "r")], verbs.make_verbs(), "meshfree") == 3
        monkeypatch.undo()
        assert run("report", folder / "r")[1][0]["unreached"] == 0
        monkeypatch.setattr("command.line._do", lambda *_: 3)
        self.thin(run, folder, "--count", 40)
        monkeypatch.undo()
        assert run("report", folder / "r")[1][0]["unreached"] == 8

    def test_reports_are_merged_with_totals_and_errors(self, run, folder):
        for k in (1, 2):
            options = "--no-volume", "--part", f"{k}/2", "--report", folder / "r" / f"{k}.jsonl"
            assert run("measure", folder / "in", *options)[0] == 0
        code, [line] = run("report", folder / "r", "--out", folder / "table.csv")
        assert code == 0
        assert (line["files"], line["failed"], line["points"]) == (8, 1, 1400)
        assert line["errors"][0]["path"] == str(folder / "in" / "LHD_651_12.npy")
        exact = 4.0 * np.pi * sum((1.0 + number) ** 2 for number in range(8) if number != 3)
        assert line["total_area"] == pytest.approx(exact, rel=0.02)
        rows = (folder / "table.csv").read_text().splitlines()
        assert rows[0].startswith("path,verb,points,total_area,elapsed")
        assert len(rows) == 10
        assert rows[-1].startswith('"8 files, 1 failed"')
        assert run("report", folder / "r", "--out", folder / "table.json")[0] == 0
        merged = json.loads((folder / "table.json").read_text())
        assert merged["totals"]["points"] == sum(record.get("points", 0) for record in merged["files"])
        assert run("report", folder / "in")[0] == 1
        assert run("report", folder / "none")[0] == 1


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (core.NotEnoughMemoryError("It does not fit."), 3),
        (MemoryError(), 3),
        (OSError(errno.ENOSPC, "No space left on device"), 3),
        (OSError(errno.EACCES, "Permission denied"), 0),
        (core.PointCloudError("It is no surface."), 0),
    ],
    ids=lambda value: type(value).__name__,
)
@pytest.mark.parametrize("wrapped", [False, True])
def test_what_another_machine_may_do_has_an_exit_code_of_its_own(run, folder, monkeypatch, error, code, wrapped):
    def fail(*_):
        if wrapped:
            raise core.PointCloudError("It failed.") from error
        raise error

    monkeypatch.setattr(verbs.Info, "work", fail)
    given = "info", folder / "in" / "LHD_650_9.npy", folder / "in" / "LHD_650_11.npy"
    found, lines = run(*given, "--report", folder / "r.jsonl")
    assert (found, len(lines)) == (code, 2)
    assert all(line["error"] for line in lines)
    assert run(*given)[0] == (code or 1)


@pytest.mark.parametrize("verb", ["info", "convert", "thin-out", "stray-points"])
def test_work_that_does_not_fit_the_memory_is_refused_before_the_start(run, folder, monkeypatch, verb):
    """The system would end the program, and nobody would be told."""
    given = verb, folder / "in" / "LHD_650_9.npy", *([] if verb == "info" else ["--out", folder / "out.ply"])
    monkeypatch.setattr(core.memory, "available_memory", lambda: 40_000)
    code, [line] = run(*given)
    assert (code, (folder / "out.ply").exists()) == (3, False)
    assert re.search(r"200 points would take about .* enough for \d+ points\. Use fewer points", line["error"])
    monkeypatch.setattr(core.memory, "available_memory", lambda: 4_000_000)
    assert run(*given)[0] == 0


@pytest.mark.parametrize(("number", "code"), [(errno.ENOSPC, 3), (errno.EACCES, 1)])
def test_a_report_that_cannot_be_written_is_told(run, folder, monkeypatch, number, code):
    def fail(*_):
        raise OSError(number, "no")

    monkeypatch.setattr(records.Records, "keep", fail)
    assert run("info", folder / "in" / "LHD_650_9.npy", "--report", folder / "r.jsonl")[0] == code


def test_a_full_disk_is_told_as_one(run, folder, monkeypatch):
    """Through the writer of files, which gives it a text of its own."""

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    code, [line] = run("convert", folder / "in" / "LHD_650_9.npy", "--out", folder / "a.ply")
    assert (code, "No space left" in line["error"]) == (3, True)
    assert not (folder / "a.ply").exists()


@pytest.mark.parametrize(("name", "times"), [("a.npy", 3), ("a.xyz", 3)])
def test_a_file_that_does_not_fit_the_memory_is_not_read(run, tmp_path, monkeypatch, name, times):
    np.savetxt(tmp_path / name, POINTS) if name == "a.xyz" else np.save(tmp_path / name, POINTS)
    size = (tmp_path / name).stat().st_size
    monkeypatch.setattr(core.files.formats, "available_memory", lambda: times * size - 1)
    code, [line] = run("info", tmp_path / name)
    assert (code, "GB of memory are free" in line["error"]) == (3, True)
    monkeypatch.setattr(core.files.formats, "available_memory", lambda: times * size)
    assert run("info", tmp_path / name)[0] == 0


class TestBefore:
    """What is told before any work."""

    @pytest.fixture(autouse=True)
    def idle(self, monkeypatch):
        def fail(*_):
            raise AssertionError("it works")

        monkeypatch.setattr(verbs.Info, "work", fail)
        monkeypatch.setattr(tool_verb.PointVerb, "work", fail)

    @pytest.mark.parametrize("option", ["--out-dir", "--out", "--report", "--out is a folder"])
    def test_outputs_that_cannot_be_written(self, folder, capsys, option):
        (folder / "file").write_text("no folder")
        (folder / "folder.ply").mkdir()
        given = {
            "--out-dir": ("--out-dir", folder / "file" / "out"),
            "--out": ("--out", folder / "file" / "out.ply"),
            "--report": ("--report", folder / "file" / "r.jsonl"),
            "--out is a folder": ("--out", folder / "folder.ply"),
        }[option]
        words = ["thin-out", folder / "in" / "LHD_650_9.npy", *given]
        assert run_command([*map(str, words)], verbs.make_verbs(), "meshfree") == 2
        told = capsys.readouterr()
        assert told.out == ""
        assert len(told.err.splitlines()) == 1
        assert str(given[1]) in told.err

    def test_a_full_disk(self, run, folder, monkeypatch):
        def full(*_, **__):
            raise OSError(errno.ENOSPC, "No space left on device")

        monkeypatch.setattr("tempfile.TemporaryFile", full)
        assert run("thin-out", folder / "in", "--out-dir", folder / "out") == (3, [])

    def test_wrong_usage_is_one_line(self, capsys):
        for words in ("analyze", "analyze --none", "none", "", "tiles", "tiles none"):
            assert run_command(words.split(), verbs.make_verbs(), "meshfree") == 2
            told = capsys.readouterr()
            assert (told.out, len(told.err.splitlines())) == ("", 1)
            assert told.err.startswith("meshfree")
            assert told.err.endswith("--help.\n")

    def test_the_version(self, capsys):
        assert run_command(["--version"], verbs.make_verbs(), "meshfree") == 0
        version = re.search('^version = "(.+)"', (ROOT / "blender_manifest.toml").read_text(), re.MULTILINE)[1]
        assert capsys.readouterr().out == f"meshfree {version}\n"

    def test_the_help_of_verbs_of_two_words(self, capsys):
        assert run_command(["tiles", "--help"], verbs.make_verbs(), "meshfree") == 0
        told = capsys.readouterr().out
        assert all(verb.name.partition(" ")[2] in told for verb in verbs.make_verbs() if verb.name.startswith("tiles "))


def test_a_verb_without_any_output_says_so(run, folder):
    given = "thin-out", folder / "in" / "LHD_650_9.npy", "--by", "number", "--count", 50
    assert "No file is written" in run(*given)[1][0]["notices"][-1]
    assert run(*given, "--out", folder / "a.ply")[1][0]["notices"] == []
    assert run("info", folder / "in" / "LHD_650_9.npy")[1][0]["notices"] == []


def test_another_run_on_the_same_share_is_told(run, folder):
    given = "convert", folder / "in" / "LHD_650_9.npy", folder / "in" / "LHD_650_11.npy", "--out-dir", folder / "out"
    (folder / "out").mkdir()
    with core.files.holding(folder / "out" / ".share-1-of-2.lock"):
        _, [line] = run(*given, "--part", "1/2")
        assert line["notices"] == [f"Another run is at work on the same share of {folder / 'out'}."]
        _, [line] = run(*given, "--part", "2/2")
        assert line["notices"] == []
    assert sorted(path.name for path in (folder / "out").iterdir()) == ["LHD_650_11.ply", "LHD_650_9.ply"]


def test_an_error_of_the_program_itself_is_in_the_report_and_the_other_files_are_done(run, folder, monkeypatch):
    def fail(self, task):
        if task.path.stem == "LHD_650_9":
            raise KeyError("x")
        return {"points": 200}, []

    monkeypatch.setattr(verbs.Info, "work", fail)
    code, lines = run("info", folder / "in" / "LHD_650_9.npy", folder / "in" / "LHD_650_11.npy")
    assert (code, lines[0]["error"], lines[1]["points"]) == (1, "KeyError: 'x'", 200)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="Windows has neither such signals nor such pipes")
class TestEnds:
    """As a process: how the program ends where it is stopped, or nobody reads what it prints."""

    CODE = (
        "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler);"
        "from command.main import main; sys.exit(main())"
    )

    def start(self, *words, **streams):
        given = [sys.executable, "-c", self.CODE, *map(str, words)]
        return subprocess.Popen(
            given, cwd=ROOT, text=True, **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **streams}
        )

    def test_a_closed_pipe(self, folder):
        for words in (("info", folder / "in"), ("--help",), ("analyze", folder / "in", "--out-dir", folder / "out")):
            reading, writing = os.pipe()
            os.close(reading)
            running = self.start(*words, stdout=writing)
            os.close(writing)
            _, told = running.communicate()
            assert running.returncode == 141 or words == ("--help",)
            assert "Traceback" not in told
            assert "Broken" not in told

    def test_closed_pipes_for_both(self, folder):
        reading, writing = os.pipe()
        os.close(reading)
        running = self.start("analyze", folder / "in", "--report", folder / "r.jsonl", stdout=writing, stderr=writing)
        os.close(writing)
        assert running.wait() == 141
        assert not (folder / "r.jsonl").exists() or "Broken" not in (folder / "r.jsonl").read_text()

    def test_ctrl_c(self, folder):
        np.save(folder / "large.npy", fibonacci_sphere(40000))
        running = self.start(
            "analyze", folder / "large.npy", "--out", folder / "out.ply", "--report", folder / "r.jsonl"
        )
        while "Neighbors" not in running.stderr.readline():
            assert running.poll() is None
        running.send_signal(signal.SIGINT)
        _, told = running.communicate()
        assert (running.returncode, told.splitlines()[-1]) == (130, "Stopped")
        assert "Traceback" not in told
        assert not (folder / "out.ply").exists()

    @pytest.mark.parametrize("module", ["numpy", "command.line", "command.tile_verbs"])
    def test_ctrl_c_while_modules_load(self, module):
        code = f"""
class Stop:
    def find_spec(self, name, *_):
        if name == {module!r}:
            signal.raise_signal(signal.SIGINT)
sys.meta_path.insert(0, Stop())
"""
        start, end = self.CODE.split("; ", 1)
        given = [sys.executable, "-c", f"{start}{code}{end}", "--version"]
        done = subprocess.run(given, cwd=ROOT, text=True, capture_output=True)
        assert (done.returncode, done.stdout, done.stderr) == (130, "", "Stopped\n")

    @pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")
    def test_standard_output_on_a_full_disk(self, folder):
        with open("/dev/full", "w") as full:
            running = self.start("convert", folder / "in", "--out-dir", folder / "out", stdout=full)
            _, told = running.communicate()
        assert running.returncode == 3
        assert "Standard output cannot be written: No space left" in told
        assert "Traceback" not in told
        assert len(list((folder / "out").iterdir())) == 7
