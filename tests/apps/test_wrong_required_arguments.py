"""Public functions reject required arguments of the wrong type."""

import inspect
from importlib import import_module

import numpy as np
import pytest

from chasles import ChaslesError, InputError
from chasles.derive import kutzbach
from chasles.study.planning import mesh, occupancy_map, prm, rrt_connect, shortcut, success_study

MODULES = ("calibration", "derive", "drawing", "se3", "so3", "study", "study.motion", "view")
VALID_WITHOUT_ARGUMENTS = {"pose"}


def public_functions():
    found = {}
    for short in (*MODULES, "study.planning"):
        module = import_module(f"chasles.{short}")
        for name in getattr(module, "__all__", dir(module)):
            value = getattr(module, name)
            if inspect.isfunction(value) and not name.startswith("_"):
                found[name] = value
    return {name: found[name] for name in sorted(found.keys() - VALID_WITHOUT_ARGUMENTS)}


FUNCTIONS = public_functions()


def call(function, wrong):
    parameters = inspect.signature(function).parameters.values()
    needed = [one for one in parameters if one.default is one.empty]
    needed = [one for one in needed if one.kind not in (one.VAR_POSITIONAL, one.VAR_KEYWORD)]
    named = {one.name: wrong for one in needed if one.kind is one.KEYWORD_ONLY}
    return function(*[wrong] * (len(needed) - len(named)), **named)


def test_public_functions_are_found():
    assert {"prm", "mesh", "kutzbach", "identify", "draw", "blend", "exp"} <= set(FUNCTIONS)


@pytest.mark.parametrize("wrong", [None, "wrong", 1.5, object()], ids=["None", "str", "1.5", "obj"])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_wrong_required_arguments_raise_an_error_of_chasles(name, wrong):
    with pytest.raises(ChaslesError) as caught:
        call(FUNCTIONS[name], wrong)
    assert "\n" not in str(caught.value)


SPACE = occupancy_map(np.zeros((4, 4), dtype=bool))
A, B = np.array([0.5, 0.5]), np.array([3.5, 3.5])
PLAN = prm(SPACE, 50).plan(A, B)
CALLS = {
    "prm: space": lambda x: prm(x, 10),
    "prm: samples": lambda x: prm(SPACE, x),
    "prm: neighbors": lambda x: prm(SPACE, 10, neighbors=x),
    "prm: max_step": lambda x: prm(SPACE, 10, max_step=x),
    "prm: dispersion": lambda x: prm(SPACE, 10, dispersion=x),
    "prm: rng": lambda x: prm(SPACE, 10, rng=x),
    "rrt_connect: space": lambda x: rrt_connect(x, A, B),
    "rrt_connect: time_limit": lambda x: rrt_connect(SPACE, A, B, time_limit=x),
    "shortcut: space": lambda x: shortcut(x, PLAN),
    "shortcut: plan": lambda x: shortcut(SPACE, x),
    "shortcut: attempts": lambda x: shortcut(SPACE, PLAN, attempts=x),
    "success_study: space": lambda x: success_study(x, A, B, samples=[10]),
    "success_study: samples": lambda x: success_study(SPACE, A, B, samples=x),
    "success_study: max_steps": lambda x: success_study(SPACE, A, B, samples=[5], max_steps=x),
    "success_study: runs": lambda x: success_study(SPACE, A, B, samples=[5], runs=x),
    "success_study: neighbors": lambda x: success_study(SPACE, A, B, samples=[5], neighbors=x),
    "mesh: path": mesh,
    "kutzbach: links": lambda x: kutzbach(x, 4, 4),
    "kutzbach: joints": lambda x: kutzbach(4, x, 4),
    "kutzbach: freedom": lambda x: kutzbach(4, 4, x),
    "kutzbach: order": lambda x: kutzbach(4, 4, 4, order=x),
}


@pytest.mark.parametrize("wrong", ["wrong", object(), [[1.0, "a"]]], ids=["str", "obj", "list"])
@pytest.mark.parametrize("name", CALLS)
def test_single_wrong_argument_is_named(name, wrong):
    with pytest.raises(InputError, match=rf"^{name}\b") as caught:
        CALLS[name](wrong)
    assert "\n" not in str(caught.value)
