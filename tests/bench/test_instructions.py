"""Counted instructions have not risen since bench/instructions.json was written."""

import json

import pytest

from bench import count

EXPECTED = json.loads(count.EXPECTED.read_text(encoding="utf-8"))


def skip_unless_comparable(*names):
    reason = count.impossible()
    if reason:
        pytest.skip(reason)
    here = count.versions()
    other = [name for name in names if here[name] != EXPECTED["versions"][name]]
    if other:
        pytest.skip(f"counted with another {', '.join(other)}")


def test_kernels_take_exactly_as_many():
    skip_unless_comparable("compiler")
    found = count.kernels()
    assert len(found) == sum(map(len, count.COUNTED.values()))
    assert found == EXPECTED["kernels"]


def test_calls_from_python_take_no_more():
    skip_unless_comparable(*EXPECTED["versions"])
    assert count.rises(EXPECTED["python"], count.python_calls()) == []
