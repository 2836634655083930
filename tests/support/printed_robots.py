"""Serial robots for tests of LaTeX articles: shipped robots, and robots with long equations."""

import random
from functools import cache

import sympy as sp

from chasles.derive import Coupling, Joint, Parameter, SerialRobot, derive, read
from chasles.derive.description.conventions import CONVENTIONS
from chasles.derive.latex import fragments
from chasles.derive.model.placements import rotation, translation
from tests.support.chains import random_chain
from tests.support.derivations import NAMES, committed, description

R = sp.Rational
BY_NAME = {convention.name: convention for convention in CONVENTIONS}


def joint(name, convention, kind="revolute", *, pitch=0, direction=1, **given):
    convention = BY_NAME[convention]
    fields = {f.name: sp.sympify(given.get(f.name, 0)) for f in convention.fields}
    before, after = convention(kind, **fields)
    return Joint(
        name,
        kind,
        before,
        after,
        pitch=sp.sympify(pitch),
        direction=direction,
        convention=convention,
        given=convention.scalars(fields),
    )


def awkward():
    """Robot with all joint types, three conventions, unusual angles and clashing names."""
    h, c1, s_1, t1, p_1 = sp.symbols("h c1 s_1 t1 p_1", real=True)
    alpha_2 = sp.Symbol("alpha_2", real=True)
    joints = (
        joint("lift", "dh", "prismatic", d=c1),
        joint("turn", "dh", a=t1, theta=R(3, 10)),
        joint("screw", "dh", "helical", a=s_1, alpha=alpha_2, pitch=h),
        joint("follow", "dh", a=p_1, alpha=sp.pi / 2),
        joint("back", "mdh", alpha=sp.pi / 3, a=R(1, 4), direction=-1),
        joint("down", "mdh", alpha=sp.pi, a=R(1, 8)),
        joint("wrist", "hayati", a=R(1, 8), alpha=R(1, 10), beta=R(1, 20)),
    )
    lengths = tuple(Parameter(str(p), R(k + 1, 5)) for k, p in enumerate((h, c1, s_1, t1, p_1)))
    base = translation(R(0), R(0), R(1, 2)) + rotation("z", sp.pi / 4)
    tool = translation(R(0), R(0), R(1, 10)) + rotation("x", R(1, 5))
    parameters = (*lengths, Parameter("alpha_2", R(2, 5), "angle"))
    couplings = (Coupling("follow", (("turn", 2),), R(1, 10)),)
    return SerialRobot(
        *("awkward", joints),
        base=base,
        tool=tool,
        base_frame="w",
        parameters=parameters,
        couplings=couplings,
    )


def calibrated():
    """Robot with three joints and only symbolic Denavit-Hartenberg parameters."""
    parameters, joints = [], []
    for k in range(1, 4):
        kinds = {"a": "length", "d": "length", "alpha": "angle", "theta": "angle"}
        own = [Parameter(f"{field}_{k}", R(k, 7), kind) for field, kind in kinds.items()]
        parameters += own
        given = {p.name.split("_")[0]: p.symbol for p in own}
        joints.append(joint(f"j{k}", "dh", **given))
    return SerialRobot("calibrated", tuple(joints), parameters=tuple(parameters))


def parallel(count):
    """Robot with groups of three parallel axes."""
    lengths = [sp.Symbol(f"a{k}", real=True) for k in range(1, count + 1)]
    joints = tuple(
        joint(f"j{k}", "dh", a=a, alpha=0 if k % 3 else sp.pi / 2) for k, a in enumerate(lengths, 1)
    )
    return SerialRobot(
        "parallel", joints, parameters=tuple(Parameter(str(a), R(1, 4)) for a in lengths)
    )


def tilted():
    """Return a robot on a tilted base, with constants so long that the LaTeX article names them."""
    tilt, rises = sp.Symbol("tilt", real=True), sp.symbols("d1:10", real=True)
    joints = (
        joint("j1", "dh", d=sum(rises), alpha=sp.pi / 2),
        joint("j2", "dh", a=R(1, 2)),
        joint("j3", "dh", a=R(2, 5), theta=R(1, 3), alpha=R(1, 3)),
    )
    lengths = tuple(Parameter(str(d), R(k, 10)) for k, d in enumerate(rises, 1))
    parameters = (Parameter("tilt", R(1, 3), "angle"), *lengths)
    return SerialRobot("tilted", joints, base=rotation("x", tilt), parameters=parameters)


def named_wrist():
    """Robot with symbolic wrist angles and lengths, which produce long constants."""
    angles = {"alpha1": "-1.5708", "theta2": "-1.5708", "alpha3": "-1.5708", "alpha4": "1.5708"}
    angles |= {"alpha5": "-1.5708", "theta6": "3.14159"}
    lengths = {"d1": "0.29", "a2": "0.27", "a3": "0.07", "d4": "0.302", "d6": "0.072"}
    parameters = [Parameter(name, R(value), "angle") for name, value in angles.items()]
    parameters += [Parameter(name, R(value)) for name, value in lengths.items()]
    joints = []
    for k in range(1, 7):
        given = {p.name[:-1]: p.symbol for p in parameters if p.name.endswith(str(k))}
        joints.append(joint(f"j{k}", "dh", **given))
    return SerialRobot("named_wrist", tuple(joints), parameters=tuple(parameters))


BUILT = {
    "awkward": awkward,
    "calibrated": calibrated,
    "tilted": tilted,
    "named_wrist": named_wrist,
    "fourteen": lambda: parallel(14),
    **{f"random{k}": lambda k=k: random_chain(random.Random(k), 3 + k).robot() for k in range(4)},
}
ROBOTS = [*NAMES, *BUILT]
FUNCTIONS = ("fk", "jacobian_mixed", "jacobian_space")
"""Names of the derived functions, whose equations the LaTeX article prints."""


@cache
def derived(name):
    """Derive the printed functions of a serial robot."""
    if name in BUILT:
        return derive(BUILT[name](), functions=FUNCTIONS)
    return derive(read(description(name)), functions=FUNCTIONS)


@cache
def printed(name):
    """Return the LaTeX fragments of a robot's article, keyed by file name."""
    return committed(name) if name in NAMES else fragments(derived(name))
