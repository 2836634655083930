"""Functions with branches, such as the inverse of an arm, for tests of generated code."""

from pathlib import Path

import sympy as sp

from chasles.derive.derivation import Derivation, derive
from chasles.derive.emit.c import language
from chasles.derive.emit.manifest import manifest
from chasles.derive.program.programs import Programs, programs
from chasles.derive.terms.role import Role
from chasles.derive.terms.symbolic_function import Argument, Result, SymbolicFunction
from chasles.derive.terms.terms import Terms
from tests.support.derivations import robot_of

D1, A2, A3, D4, D5, D6 = (
    sp.Rational(*pair)
    for pair in (
        *((1625, 10000), (-425, 1000), (-3922, 10000)),
        *((1333, 10000), (997, 10000), (996, 10000)),
    )
)
"""Lengths of a UR5e (meter)."""


def pose(name="T"):
    """Return the description of the argument T, which is a pose (4, 4)."""
    entries = tuple(sp.Symbol(f"{name}_{k}", real=True) for k in range(16))
    return Argument(name, entries, (4, 4), "1, m", "pose of the tip in the base")


def guarded(value, size):
    """Return value / size, or 0 if the size is 0."""
    return sp.Piecewise((value / size, size > sp.Rational(1, 10**9)), (0, True))


def root(square):
    """Return the square root of a number, or 0 for a negative number."""
    return sp.sqrt(sp.Max(0, square))


def arm(name="ik"):
    """Return the 8-branch inverse of an arm with three parallel axes (a UR5e)."""
    terms = Terms({})
    let, T = terms.let, pose()
    n, o, a, p = ([T.symbols[4 * i + j] if i < 3 else None for i in range(3)] for j in range(4))
    shoulder, wrist, elbow = signs = sp.symbols("shoulder wrist elbow", real=True)
    # Angle 1 moves the wrist center to the distance D4 from the arm plane.
    x, y = (let(p[i] - D6 * a[i]) for i in range(2))
    reach = let(x**2 + y**2)
    open_1 = let(reach - D4**2)
    side = let(shoulder * root(open_1))
    size_1 = let(sp.sqrt(let(D4**2 + side**2) * reach))
    s1, c1 = let(guarded(D4 * x + side * y, size_1)), let(guarded(side * x - D4 * y, size_1))
    n, o, a = ([let(c1 * v[0] + s1 * v[1]), v[2], let(s1 * v[0] - c1 * v[1])] for v in (n, o, a))
    # Angles 5 and 6 follow from the components of the tip axes along the parallel axes.
    size_5 = let(sp.sqrt(n[2] ** 2 + o[2] ** 2))
    s5, c5 = let(wrist * size_5), a[2]
    c6 = let(wrist * sp.Piecewise((n[2] / size_5, size_5 > sp.Rational(1, 10**9)), (1, True)))
    s6 = let(-wrist * guarded(o[2], size_5))
    # The tip orientation determines the sum of angles 2, 3 and 4, whose axes are parallel. A
    # triangle with the sides A2 and A3 determines angles 2 and 3.
    s234 = let(-(s6 * n[0] + c6 * o[0]))
    c234 = let(s6 * n[1] + c6 * o[1])
    w = [
        let(c1 * p[0] + s1 * p[1] - D5 * s234 - D6 * a[0]),
        let(p[2] - D1 + D5 * c234 - D6 * a[1]),
    ]
    square = let(w[0] ** 2 + w[1] ** 2)
    asked = let((square - A2**2 - A3**2) / (2 * A2 * A3))
    open_3 = let((1 - asked) * (1 + asked))
    c3 = let(sp.Min(1, sp.Max(-1, asked)))
    s3 = let(elbow * root(open_3))
    along, across = let(A2 + A3 * c3), let(A3 * s3)
    size = let(sp.sqrt(let(along**2 + across**2) * square))
    c2 = let((along * w[0] + across * w[1]) / size)
    s2 = let((along * w[1] - across * w[0]) / size)
    c23, s23 = let(c2 * c3 - s2 * s3), let(s2 * c3 + c2 * s3)
    c4, s4 = let(c234 * c23 + s234 * s23), let(s234 * c23 - c234 * s23)
    angles = [(s1, c1), (s2, c2), (s3, c3), (s4, c4), (s5, c5), (s6, c6)]
    q = tuple(sp.atan2(s, c, evaluate=False) for s, c in angles)
    # Tool pose at the solved joint angles, which the residual compares with the target.
    end = [
        let(A2 * c2 + A3 * c23 + D5 * s234 + D6 * a[0]),
        let(D1 + A2 * s2 + A3 * s23 - D5 * c234 + D6 * a[1]),
        let(D4 + D6 * c5),
    ]
    tip = [let(c1 * end[0] + s1 * end[2]), let(s1 * end[0] - c1 * end[2]), end[1]]
    far = let(sp.sqrt(sum(let(e - f) ** 2 for e, f in zip(tip, p, strict=True))))
    cosine, sine = let(c5 * c6), let(c5 * s6)
    turned = [
        let(c234 * cosine - s234 * s6 - n[0]),
        let(s234 * cosine + c234 * s6 - n[1]),
        let(s5 * c6 - n[2]),
        let(-c234 * sine - s234 * c6 - o[0]),
        let(-s234 * sine + c234 * c6 - o[1]),
        let(-s5 * s6 - o[2]),
    ]
    wrong = let(sp.sqrt(sum(t**2 for t in turned)))
    outputs = (
        Result("q", q, (8, 6), "rad", "joint angles"),
        Result("residual", (sp.Max(far, wrong),), (8,), "m or rad", "what is missing"),
        Result("margin", (sp.Min(open_1, open_3),), (8,), "1", "how far from the edge"),
    )
    role = Role("inverse", "pose", labels=tuple(f"slot {k}" for k in range(8)))
    return SymbolicFunction(name, "All inverses.", "", (T,), outputs, terms, signs=signs, role=role)


def every_kind(n_signs, name=None):
    """Return a symbolic function with 2**n_signs branches.

    Each branch of this function contains all expression types, such as square roots, atan2 and
    conditionals.
    """
    terms = Terms({})
    let = terms.let
    x, y, z = sp.symbols("x y z", real=True)
    signs = sp.symbols(f"s1:{n_signs + 1}", real=True)
    inputs = (
        Argument("x", (x,), (), "1", "a number"),
        Argument("v", (y, z), (2,), "1", "numbers"),
    )
    total = x
    angles = []
    for k, sign in enumerate(signs):
        square = let(total**2 + y - k)
        step = let(sign * root(square))
        total = let(z + step / 4 + total * sp.Rational(1, 3))
        angles += [let(sp.atan2(step, total, evaluate=False))]
        angles += [let(sp.atan2(-total, let(step + y), evaluate=False))]
    slope = let(sp.Piecewise((total / y, (y > 0) & (z < total)), (sp.sqrt(-y), y < 0), (-1, True)))
    turned = let(sp.cos(x) * slope + sp.sin(x) * sum(angle**2 for angle in angles))
    values = (total, slope, turned, sp.Abs(total), sp.sign(z - total), *angles)
    k = 2**n_signs
    outputs = (
        Result("value", values, (k, len(values)), "1", "numbers"),
        Result("least", (sp.Min(total, slope, y),), (k,), "1", "a number"),
        Result(
            "direction", (sp.atan2(slope, sum(signs, x), evaluate=False),), (k,), "rad", "angle"
        ),
    )
    named = name or f"every_kind_{k}"
    return SymbolicFunction(named, "Numbers.", "", inputs, outputs, terms, signs=tuple(signs))


def files(functions, robot):
    """Return the generated C files of symbolic functions, keyed by file name."""
    derived = Derivation(robot, functions[0].terms, (), tuple(functions))
    return language.files(derived, programs_of(functions, robot.name))


def programs_of(functions, prefix):
    """Return the expression graphs of functions.

    The expression graphs of different functions share no terms.
    """
    made = [programs([function], prefix) for function in functions]
    return Programs(
        {name: program for each in made for name, program in each.whole.items()},
        {name: program for each in made for name, program in each.branch.items()},
    )


def write(folder: Path, functions):
    """Write the C files and the manifest of a UR5e with only the given functions to a folder."""
    derived = derive(robot_of("ur5e"), functions=["fk"])
    robot = derived.robot
    texts = dict(files(functions, robot))
    whole = Derivation(robot, derived.terms, (), tuple(functions))
    texts["manifest.json"] = manifest(whole, programs_of(functions, robot.name), {"c": texts})
    for name, text in texts.items():
        (folder / name).write_text(text)
    return folder
