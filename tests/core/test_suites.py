"""The program that runs the tests: which parts compute by which kernels of OpenBLAS."""

import sys

import pytest

import run_tests

STUB = """#!/bin/sh
case $OPENBLAS_CORETYPE in
    Haswell) echo Core: Haswell >&2 ;;
    SkylakeX) echo Core: SkylakeX >&2; kill -ILL $$ ;;
    Zen) echo Core: Zen; echo Core: Haswell ;;
    *) echo "Core not found: $OPENBLAS_CORETYPE" >&2; echo Core: Haswell >&2 ;;
esac
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no shell there")
def test_kernels_are_those_that_compute_and_say_so(tmp_path):
    stub = tmp_path / "python"
    stub.write_text(STUB)
    stub.chmod(0o755)
    assert run_tests.kernels(stub) == ["Haswell", "Zen"]


@pytest.mark.parametrize("count", range(6))
def test_all_kernels_and_numbers_of_threads_take_turns(count):
    known = run_tests.KERNELS[:count]
    parts = run_tests.take_turns(known, 0) + run_tests.take_turns(known, 4)
    assert {part.get("OPENBLAS_CORETYPE") for part in parts} == (set(known) or {None})
    assert {(part["OPENBLAS_NUM_THREADS"], part["MESHFREE_CORES"]) for part in parts} == {("1", "1"), ("2", "2")}
    # What a part of the first environment computes with, the same part of the second one does not.
    assert all(one != other for one, other in zip(parts[:4], parts[4:], strict=True))
