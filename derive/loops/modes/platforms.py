"""Platforms of parallel robots, supported only by legs.

Each leg is a rod between an actuated body and the platform.

The main chain consists of virtual joints with the coordinates x, y and phi, or with six
coordinates. The length l_i of rod i gives an equation between the main-chain coordinates theta and
the actuated coordinates q:

    |b_i(theta) - a_i(q)| - l_i = 0

The time derivatives of the rod equations give the velocity relation J_x x' = J_q q' with the tool
twist x'. For three planar rods, the rod equations also give all assembly modes.

Source: Gosselin and Angeles 1990, for the matrices J_x and J_q and the three types of singularity.
"""

import re
from collections.abc import Callable, Sequence
from functools import partial

import sympy as sp

from ...chain.kinematics import FUNCTIONS
from ...model.mechanism import Mechanism, Strut
from ...terms.role import Role
from ...terms.symbolic_function import (
    Argument,
    NativeSolverFunction,
    Result,
    SymbolicFunction,
    matrix_entries,
)
from ...terms.tangents import derivative_columns
from ...terms.vectors import named, subtracted
from ..functions.maps import Maker
from ..functions.tool import open_chain
from ..solve.solved_loops import SolvedLoops
from . import hexapod, planar_legs, triad_modes
from .hexapod import hexapod_of
from .rods import Rod, free_platform, is_right_handed, line_coordinates, rods_of, tool_position
from .triad import Triad, triad_mirror, triad_polynomial, triad_position

WrittenMaker = Callable[[SolvedLoops], NativeSolverFunction | None]
ONE, ZERO = sp.Integer(1), sp.Integer(0)
TRIAD = 3
OF_CHAIN = {f"chain_{name}": name for name in FUNCTIONS}
"""Dictionary from the function name of an open main chain, such as ``chain_fk``, to the function
name of a serial robot.
"""


def makers(h: SolvedLoops) -> dict[str, Maker]:
    """Return the builders of the functions of a platform, or {} for a robot without a platform."""
    found: dict[str, Maker] = {}
    if h.forward.open:
        found |= {name: partial(of_open_chain, called) for name, called in OF_CHAIN.items()}
    on_struts, triad = is_platform(h.mechanism), triad_of(h) if h.forward.open else None
    if on_struts:
        found |= {
            "rods": rods,
            "rods_D_chain": rods_D_chain,
            "velocity_relation": velocity_relation,
        }
    elif triad is not None:
        found |= {
            "legs": partial(planar_legs.legs, triad=triad),
            "legs_D_chain": partial(planar_legs.legs_D_chain, triad=triad),
            "velocity_relation": velocity_relation,
        }
    if triad is not None:
        found |= {
            "assembly_polynomial": assembly_polynomial,
            "assembly_position": partial(_assembly, "assembly_position"),
            "assembly_mirror": partial(_assembly, "assembly_mirror"),
        }
    if on_struts and hexapod_of(h) is not None:
        # If the platform can rotate, the actuated coordinates do not determine its pose.
        found |= {"chain_fk": partial(of_open_chain, "fk"), hexapod.CALLED: hexapod.rod_ends}
    return found


def written_makers(h: SolvedLoops) -> dict[str, WrittenMaker]:
    """Return the builders of the functions with handwritten C code."""
    if is_platform(h.mechanism) and hexapod_of(h) is not None:
        return {"modes": hexapod.modes}
    triad = triad_of(h) if h.forward.open else None
    return {} if triad is None else {"modes": lambda h: triad_modes.modes(h, triad)}


def is_platform(mechanism: Mechanism) -> bool:
    """Whether only struts support the tool body, and the main chain has no actuator.

    Each strut connects the tool body to the base or to an actuated body, and has a constant or
    actuated length.
    """
    actuated = {c.moves for c in mechanism.coordinates}
    chain = {joint.name for joint in mechanism.main_chain.moving}
    if mechanism.closures or mechanism.couplings or not mechanism.struts or actuated & chain:
        return False

    def is_leg(strut: Strut) -> bool:
        one, other = (
            {joint.name for joint in mechanism.path_to(frame.body) if joint.kind != "fixed"}
            for frame in (strut.a, strut.b)
        )
        joined = (other == chain and one <= actuated) or (one == chain and other <= actuated)
        return joined and (not strut.is_cylinder or strut.name in actuated)

    return all(map(is_leg, mechanism.struts))


def _residuals(h: SolvedLoops, found: Sequence[Rod]) -> list[sp.Expr]:
    return [h.terms.let(rod.distance - rod.length) for rod in found]


def rods(h: SolvedLoops) -> SymbolicFunction:
    """Build the function ``rods``: the distance between the rod ends, minus the rod length."""
    entries = tuple(_residuals(h, rods_of(h)))
    names = ", ".join(strut.name for strut in h.mechanism.struts)
    return h.function(
        "rods",
        "Distance between the ends of each rod or cylinder, minus its length.",
        f"|b_i(theta) - a_i(q)| - l_i, i = {names}",
        ("theta", "q"),
        Result("residual", entries, (len(entries),), "m", "distance minus length"),
        role=Role("lengths"),
    )


def rods_D_chain(h: SolvedLoops) -> SymbolicFunction:
    """Build the Jacobian of the rod residuals with respect to the main-chain joints."""
    residuals = _residuals(h, rods_of(h))
    columns = derivative_columns(h.terms, residuals, h.theta)
    return h.function(
        "rods_D_chain",
        "Derivative of the rod residuals with respect to the main-chain joints.",
        "rods_D_chain[:, k] = d rods / d theta_k",
        ("theta", "q"),
        Result(
            "residual_D_theta",
            matrix_entries(columns),
            (len(residuals), len(columns)),
            "1, m",
            "derivative",
        ),
        role=Role("lengths derivative"),
    )


def velocity_relation(h: SolvedLoops) -> SymbolicFunction:
    """Build the function for the matrices J_x and J_q of the velocity relation."""
    if is_platform(h.mechanism):
        rows, J_q = _relation_of_rods(h)
    else:
        triad = triad_of(h)
        assert triad is not None
        rows, J_q = planar_legs.relation(h, triad)
    free = free_directions(h)
    J_x = tuple(row[k] for row in rows for k in free)
    return h.function(
        "velocity_relation",
        "Both matrices of the velocity relation of a platform on legs.",
        "J_x x' = J_q q', x' the tool's twist (v, omega) in base axes in the free directions "
        + ", ".join(("v_x", "v_y", "v_z", "omega_x", "omega_y", "omega_z")[k] for k in free),
        ("theta", "q"),
        Result("J_x", J_x, (len(rows), len(free)), "1, m", "rod lines"),
        Result("J_q", J_q, (len(rows), len(h.q)), "1, m", "actuators"),
        role=Role("velocity relation", directions=tuple(free)),
    )


def _relation_of_rods(h: SolvedLoops) -> tuple[list[tuple[sp.Expr, ...]], tuple[sp.Expr, ...]]:
    """Return the rows of J_x, which act on twists in base axes, and the entries of J_q."""
    found = rods_of(h)
    tool = tool_position(h)
    rows = []
    for rod in found:
        n = named(h.terms, (component / rod.distance for component in rod.d))
        r = subtracted(h.terms, rod.b, tool)
        rows.append(tuple(map(h.terms.let, line_coordinates(n, r))))
    columns = derivative_columns(h.terms, _residuals(h, found), h.q, factor=-1)
    return rows, matrix_entries(columns)


def free_directions(h: SolvedLoops) -> list[int]:
    """Return the components of the tool twist (base axes) that the main chain can move."""
    (J,) = of_open_chain("jacobian_mixed", h).outputs
    _, n = J.shape
    return [k for k in range(6) if any(J.entries[k * n + j] != 0 for j in range(n))]


def of_open_chain(name: str, h: SolvedLoops) -> SymbolicFunction:
    """Build the version of a serial-robot function that takes the main-chain joint values theta."""
    function = open_chain(h).function(name)
    return SymbolicFunction(
        f"chain_{name}",
        f"{function.summary[:-1]}, from the main-chain joints.",
        re.sub(r"\bq(?=[d_,)]|$)", "theta", function.identity),
        function.inputs,
        function.outputs,
        h.terms,
        role=Role(function.role.name, "chain"),
    )


# --- three planar rods ---


def triad_of(h: SolvedLoops) -> Triad | None:
    """Return the three legs of a planar platform, or None for other robots."""
    return _rods_in_plane(h) if is_platform(h.mechanism) else planar_legs.legs_of(h)


def _rods_in_plane(h: SolvedLoops) -> Triad | None:
    """Return the three rods of a planar platform on struts, or None for other robots."""
    platform = free_platform(h, planar_legs.VIRTUAL)
    if platform is None or not is_right_handed(h.terms, platform.directions):
        return None
    # A rod with a component along the plane's normal does not give a circle whose radius is the rod
    # length.
    if any(h.terms.let(a[2] - b[2]) != 0 for a, b in platform.ends):
        return None
    A, b = (tuple(end[k][:2] for end in platform.ends) for k in (0, 1))
    return Triad(A, b, tuple(h.terms.let(rod.length) for rod in rods_of(h)))


def assembly_polynomial(h: SolvedLoops) -> SymbolicFunction:
    """Build the function for the polynomial in the platform angle that gives all assembly modes."""
    triad = triad_of(h)
    assert triad is not None
    entries = triad_polynomial(h.terms, triad)
    return h.function(
        "assembly_polynomial",
        "Coefficients of the polynomial whose zeros are the platform angles of all assembly modes.",
        "a_0 + sum_k (a_k cos(k phi) + b_k sin(k phi)) = 0, k = 1, 2, 3: a_0, a_1, b_1, ...",
        ("q",),
        Result("coefficients", entries, (len(entries),), "1", "trigonometric coefficients"),
        role=Role("assembly polynomial"),
    )


def _assembly(name: str, h: SolvedLoops) -> SymbolicFunction:
    """Build the function for the platform pose at a zero of the assembly polynomial."""
    triad = triad_of(h)
    assert triad is not None
    phi = sp.Symbol("_phi", real=True)
    find = triad_mirror if name == "assembly_mirror" else triad_position
    x, y = find(h.terms, triad, *h.terms.cos_sin(phi))
    argument = Argument("phi", (phi,), (), "rad", "angle of the platform")
    residuals = "rods" if is_platform(h.mechanism) else "legs"
    return SymbolicFunction(
        name,
        "Platform pose at an angle phi that solves the assembly polynomial"
        + (", mirrored about the line of two centers." if name == "assembly_mirror" else "."),
        f"{residuals}((x, y, phi), q) = 0 if phi is a zero of assembly_polynomial(q)",
        (h.arguments["q"], argument),
        (Result("theta", (x, y, phi), (TRIAD,), "m, rad", "pose of the platform"),),
        h.terms,
        role=Role("assembly mirror" if find is triad_mirror else "assembly pose", "actuators"),
    )
