"""Every function of a shipped robot has a role, and every solution slot has a label."""

from itertools import chain

import pytest

import chasles
from chasles.contract import read_manifest

NAMES = chasles.robots()
DOMAINS = {
    "q": "actuators",
    "theta": "chain",
    "z": "configuration",
    "w": "configuration",
    "T": "pose",
}
"""Domain of a generated function, keyed by the name of its first input. A function whose first
input is not listed has the domain "task"."""


@pytest.fixture(params=NAMES)
def manifest(request):
    return read_manifest(chasles.find_folder(request.param))


def test_number_of_shipped_robots_is_known():
    assert len(NAMES) == 21


def test_every_function_has_a_role(manifest):
    for function in manifest.functions:
        assert function.role.name != "other", function.name
        expected = DOMAINS.get(function.inputs[0].name, "task")
        assert function.role.domain == expected, function.name


def test_every_slot_has_unique_label(manifest):
    with_slots = [f for f in manifest.functions if f.role.has_slots]
    assert {f.name for f in with_slots} == {
        f.name
        for f in manifest.functions
        if f.name.startswith("ik") and len(f.outputs) == 3 and f.role.name != "nominal inverse"
    } | {f.name for f in manifest.functions if f.name in ("chain_all", "actuators_all")}
    for function in with_slots:
        assert (
            len(function.role.labels)
            == len(set(function.role.labels))
            == function.outputs[0].shape[0]
        )
        assert all(function.role.labels)


def test_fixed_joints_of_inverses_are_coordinates(manifest):
    for function in manifest.functions:
        names = [item.name for item in function.inputs[1:] if function.role.is_inverse]
        own = tuple(int(name[1:]) - 1 for name in names if name in chain_of(manifest))
        if manifest.kind == "serial":
            assert function.role.fixed == own
        elif not names:
            assert function.role.fixed == ()


def chain_of(manifest):
    return {f"q{k + 1}" for k in range(len(manifest.coordinates))}


def test_margin_function_has_domain_of_guarded_function(manifest):
    guards = {f.name: f for f in manifest.functions if f.role.name == "margin"}
    assert {f.margin for f in manifest.functions} - {""} <= {*guards}
    for function in manifest.functions:
        if function.margin:
            assert guards[function.margin].role.domain == function.role.domain


def test_manifest_kinds_match_robot_types():
    kinds = {name: read_manifest(chasles.find_folder(name)).kind for name in NAMES}
    by_kind = {kind: {n for n, k in kinds.items() if k == kind} for kind in set(kinds.values())}
    assert by_kind["platform"] == {"stewart_gough", "planar_3rrr"}
    assert {"delta", "excavator", "four_bar", "bricklaying_gantry"} <= by_kind["hybrid"]
    assert {"ur5e", "jaco2", "bricklaying_planar"} <= by_kind["serial"]
    assert set(chain(*by_kind.values())) == set(NAMES)
