"""The functions of actuated coordinates of a robot whose loops have no closed form.

The C closes the loops by Newton's iteration (:mod:`.closure_equations`), differentiates them by the
implicit function theorem, and calls the functions of the main chain at the joints found.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from ...chain.kinematics import FUNCTIONS, ROLES
from ...terms.role import Role
from ...terms.symbolic_function import Argument, Result, SymbolicFunction, WrittenFunction
from ..hybrid import Hybrid
from ..maps import Maker
from .closure_equations import LoopClosure

SOLVER = "closure"
FROM_CHAIN = "chain_closure"
"""The same solver where the joints of the main chain are given."""
SYSTEM = 400
"""About how many operations a step of the iteration takes, by the cube of six unknowns."""
STEPS = 8
"""About how many steps lead from the reference to a pose."""
GUARD = "margin"
CHAIN_GUARD = "actuator_margin"
NEAR = ("configuration_near", "fk_near")
"""Functions that start from a configuration given beside the coordinates."""
RATES = {"jacobian": "qd", "twist": "qd", "acceleration": "qdd"}


def inner_makers(closure: LoopClosure) -> dict[str, Maker]:
    """The functions that the iteration calls, in the order in which they are written."""
    return {name: partial(_inner, closure, name) for name in closure.functions}


def _inner(closure: LoopClosure, name: str, _: Hybrid) -> SymbolicFunction:
    return closure.functions[name]


def written_functions(
    closure: LoopClosure, of_chain: Mapping[str, SymbolicFunction]
) -> dict[str, WrittenFunction]:
    """The functions of actuated coordinates by name.

    Args:
        closure: The equations of the loops.
        of_chain: The functions of the main chain, ``chain_fk`` and so on.
    """
    maps = _Maps(closure)
    found = [*maps.all(), *(_of_tool(closure, name, of_chain) for name in FUNCTIONS)]
    found += [maps.margin(), *maps.near(of_chain["chain_fk"])]
    return {function.name: function for function in found}


class _Maps:
    """The joints as functions of the coordinates."""

    def __init__(self, closure: LoopClosure) -> None:
        self.closure, self.hybrid = closure, closure.hybrid
        self.passive = self.hybrid.passive_in_loops

    def all(self) -> list[WrittenFunction]:
        h = self.hybrid
        theta = h.arguments["theta"]
        names = ", ".join(joint.name for joint in h.robot.moving)
        found = [
            self._map("chain", "Joints of the main chain.", f"theta = ({names})", "theta", "chain"),
            self._slope("chain", "theta_D_q", theta.size, "main chain's joints"),
            self._rate("chain_rates", "rates", "thetad = chain_D_q(q) qd", "qd", "map rate"),
            self._rate(
                "chain_accelerations",
                "accelerations",
                "thetadd = chain_D_q(q) qdd + d/dt chain_D_q(q) qd",
                "qdd",
                "map acceleration",
            ),
        ]
        if self.passive:
            names = ", ".join(v.name for v in self.passive)
            text = "Passive joints that are not in the main chain; swings between -pi and pi."
            found.append(self._map("passive", text, f"passive = ({names})", "passive", "passive"))
            found.append(self._slope("passive", "passive_D_q", len(self.passive), "passive joints"))
        names = ", ".join(v.name for v in h.variables)
        text = "All joints, swings and cylinder lengths."
        identity = f"z = ({names}), constraint(z) = 0"
        found.append(self._map("configuration", text, identity, "z", "configuration"))
        found.append(self._slope("configuration", "z_D_q", len(h.variables), "full configuration"))
        return found

    def margin(self) -> WrittenFunction:
        loops = ", ".join(closer.name for closer in self.hybrid.mechanism.closers)
        function = _function(
            self.closure,
            GUARD,
            "Square of the determinant of the loops' equations, 1 at the reference.",
            "0 at a singularity, where the loops do not determine the unknown variables; NaN where "
            "they do not close or a singularity is between the reference and q",
            ("q",),
            (Result("margin", (), (1,), "1", "margin"),),
            Role("margin", "actuators"),
        )
        return replace(function, steps=(loops,), margin="")

    def near(self, fk: SymbolicFunction) -> list[WrittenFunction]:
        z = self.hybrid.arguments["z"]
        seed = replace(z, name="seed", meaning="configuration nearby, swings unused")
        found = Result("z", (), z.shape, z.unit, z.meaning)
        text = "from a configuration nearby, in at most eight steps of Newton's iteration"
        role = Role("near", "actuators", "configuration")
        make = partial(_function, self.closure, margin="", role=role)
        (T,) = fk.outputs
        return [
            make(
                name="configuration_near",
                summary=f"All joints, swings and cylinder lengths, {text}.",
                identity="constraint(z) = 0; NaN where the seed is too far away",
                inputs=("q", seed),
                outputs=(found,),
            ),
            make(
                name="fk_near",
                summary=f"Pose of the tool and configuration, {text}.",
                identity="(fk(q), z) on the branch of the seed; NaN where it is too far away",
                inputs=("q", seed),
                outputs=(replace(T, entries=()), found),
                calls=(fk.name,),
            ),
        ]

    def _map(
        self, name: str, summary: str, identity: str, symbol: str, codomain: str
    ) -> WrittenFunction:
        size = {
            "theta": len(self.hybrid.theta),
            "passive": len(self.passive),
            "z": len(self.hybrid.variables),
        }[symbol]
        result = Result(symbol, (), (size,), "rad or m", summary[0].lower() + summary[1:-1])
        role = Role("map", "actuators", codomain)
        return _function(self.closure, name, summary, identity, ("q",), (result,), role)

    def _slope(self, name: str, symbol: str, rows: int, meaning: str) -> WrittenFunction:
        n = len(self.hybrid.q)
        result = Result(symbol, (), (rows, n), "1, m, 1/m", "derivative")
        return _function(
            self.closure,
            f"{name}_D_q",
            f"Derivative of the {meaning} by the actuated coordinates.",
            f"{name}_D_q[:, k] = d {name} / d q_k",
            ("q",),
            (result,),
            Role("map derivative", "actuators", name),
        )

    def _rate(self, name: str, what: str, identity: str, last: str, role: str) -> WrittenFunction:
        theta = self.hybrid.arguments["thetad" if last == "qd" else "thetadd"]
        result = Result(theta.name, (), theta.shape, theta.unit, f"{what} of the main chain")
        return _function(
            self.closure,
            name,
            f"Joint {what} of the main chain.",
            identity,
            _inputs(last),
            (result,),
            Role(role, "actuators", "chain"),
        )


def actuator_functions(closure: LoopClosure) -> dict[str, WrittenFunction]:
    """The actuated coordinates as functions of the main chain's joints, by name.

    Args:
        closure: The equations of the loops, the main chain's joints given.
    """
    h = closure.hybrid
    made = partial(_function, closure, solver=FROM_CHAIN)
    q, n, size = h.arguments["q"], len(h.q), len(h.theta)
    map_of = partial(replace, Role("map", "chain", "actuators"))
    guarded = partial(made, margin=CHAIN_GUARD)
    found = [
        guarded(
            name="actuators",
            summary="Actuated coordinates from the joints of the main chain.",
            identity="actuators(chain(q)) = q",
            inputs=("theta",),
            outputs=(Result("q", (), (n,), q.unit, "actuated coordinates"),),
            role=map_of(),
        ),
        guarded(
            name="actuators_D_chain",
            summary="Derivative of the actuated coordinates by the main chain's joints.",
            identity="actuators_D_chain[:, k] = d actuators / d theta_k",
            inputs=("theta",),
            outputs=(Result("q_D_theta", (), (n, size), "1, m, 1/m", "derivative"),),
            role=Role("map derivative", "chain", "actuators"),
        ),
        guarded(
            name="actuator_rates",
            summary="Rates of the actuated coordinates.",
            identity="qd = actuators_D_chain(theta) thetad",
            inputs=("theta", "thetad"),
            outputs=(Result("qd", (), (n,), h.arguments["qd"].unit, "actuator rates"),),
            role=map_of(name="map rate"),
        ),
        guarded(
            name="actuator_accelerations",
            summary="Accelerations of the actuated coordinates.",
            identity="qdd = actuators_D_chain(theta) thetadd + d/dt actuators_D_chain(theta)"
            " thetad",
            inputs=("theta", "thetad", "thetadd"),
            outputs=(Result("qdd", (), (n,), h.arguments["qdd"].unit, "actuator accelerations"),),
            role=map_of(name="map acceleration"),
        ),
        replace(
            made(
                name=CHAIN_GUARD,
                summary="Square of the determinant of the loops' equations, the main chain given.",
                identity="1 at the reference, 0 at a singularity, NaN where the loops do not close",
                inputs=("theta",),
                outputs=(Result("margin", (), (1,), "1", "margin"),),
                role=Role("margin", "chain"),
                margin="",
            ),
            steps=(", ".join(closer.name for closer in h.mechanism.closers),),
        ),
    ]
    return {function.name: function for function in found}


def _inputs(last: str) -> tuple[str, ...]:
    order = ("q", "qd", "qdd")
    return order[: order.index(last) + 1]


def _of_tool(
    closure: LoopClosure, name: str, of_chain: Mapping[str, SymbolicFunction]
) -> WrittenFunction:
    """A function of the tool from those of the main chain."""
    chain, calls = of_chain[f"chain_{name}"], [f"chain_{name}"]
    n = len(closure.hybrid.q)
    if name == "hessian_mixed":
        calls.append("chain_jacobian_mixed")
    if name.endswith("_dot"):
        calls.append(f"chain_{name.removesuffix('_dot')}")
    last = {"dot": "qd"}.get(name.rpartition("_")[2], RATES.get(name.partition("_")[0], "q"))
    if name.startswith(("jacobian", "hessian", "fk", "link")) and not name.endswith("_dot"):
        last = "q"
    outputs = tuple(
        replace(result, entries=(), shape=(6, *(n for _ in result.shape[1:])))
        if result.name.startswith(("J", "H"))
        else replace(result, entries=())
        for result in chain.outputs
    )
    return _function(
        closure,
        name,
        chain.summary.replace(", from the main chain's joints", ""),
        chain.identity.replace("theta", "q"),
        _inputs(last),
        outputs,
        Role(ROLES[name], "actuators"),
        calls=tuple(calls),
    )


def _function(
    closure: LoopClosure,
    name: str,
    summary: str,
    identity: str,
    inputs: tuple[str | Argument, ...],
    outputs: tuple[Result, ...],
    role: Role,
    calls: tuple[str, ...] = (),
    margin: str = GUARD,
    solver: str = SOLVER,
) -> WrittenFunction:
    arguments = tuple(
        closure.hybrid.arguments[item] if isinstance(item, str) else item for item in inputs
    )
    return WrittenFunction(
        name,
        summary,
        identity,
        arguments,
        outputs,
        solver,
        (),
        (*calls, *closure.functions),
        1,
        SYSTEM * STEPS,
        role=role,
        margin=margin,
    )
