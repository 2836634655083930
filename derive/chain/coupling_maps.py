"""Linear maps theta = C q + c between coordinates q and joint values theta of a coupled robot."""

from collections.abc import Mapping, Sequence

import sympy as sp

from ..model.robot import SerialRobot
from ..terms.role import Role
from ..terms.symbolic_function import Argument, Result, SymbolicFunction
from ..terms.terms import Terms
from .kinematics import common_unit, coordinates

COUPLING_MAPS = (
    "chain",
    "chain_D_q",
    "chain_rates",
    "chain_accelerations",
    "actuators",
    "actuators_D_chain",
    "actuator_rates",
    "actuator_accelerations",
)
"""Names of the functions that convert coordinates of a coupled robot, in output order."""
_ORDERS = ("", "d", "dd")
_UNITS = ("", "/s", "/s^2")
_NOUNS = ("", "rates", "accelerations")


def coupling_maps(
    robot: SerialRobot, terms: Terms, arguments: Mapping[str, Argument]
) -> dict[str, SymbolicFunction]:
    """Return the functions that convert coordinates to joint values and back, keyed by name.

    The dictionary of functions is empty for a robot without couplings.

    Args:
        robot: The description.
        terms: Table of named terms, to which this function adds terms.
        arguments: The arguments ``q``, ``qd`` and ``qdd``.
    """
    if not robot.couplings:
        return {}
    own = robot.linear_map
    L, pivots = own.inverse()
    C, c = sp.Matrix(own.C), sp.Matrix(own.c)
    back = sp.zeros(L.rows, C.rows)
    for k, joint in enumerate(pivots):
        back[:, joint] = L[:, k]
    unit, names = common_unit(j.unit for j in robot.moving), [j.name for j in robot.moving]
    theta = {
        f"theta{order}": Argument(
            f"theta{order}",
            # The underscore in the symbol names prevents a clash with a parameter named theta4.
            coordinates(f"_theta{order}", len(names)),
            (len(names),),
            f"{unit}{of_time}",
            f"joint {noun}".strip() if noun else "joints",
        )
        for order, of_time, noun in zip(_ORDERS, _UNITS, _NOUNS, strict=True)
    }
    forward = _Map(terms, arguments, theta, ("q", "theta"), C, c)
    backward = _Map(terms, theta, arguments, ("theta", "q"), back, -back * c)
    listed = f"theta = ({', '.join(names)}) = C q + c"
    found = (
        forward.values("chain", "Joints of the chain.", listed),
        forward.derivative("chain_D_q", "chain"),
        *(forward.rates("chain", order) for order in (1, 2)),
        backward.values("actuators", "Coordinates from the joints.", "actuators(chain(q)) = q"),
        backward.derivative("actuators_D_chain", "actuators"),
        *(backward.rates("actuators", order) for order in (1, 2)),
    )
    return dict(zip(COUPLING_MAPS, found, strict=True))


class _Map:
    def __init__(
        self,
        terms: Terms,
        inputs: Mapping[str, Argument],
        outputs: Mapping[str, Argument],
        names: tuple[str, str],
        C: sp.Matrix,
        c: sp.Matrix,
    ) -> None:
        self.terms, self.inputs, self.outputs = terms, inputs, outputs
        self.x, self.y = names
        self.C, self.c = C, c

    def values(self, name: str, summary: str, identity: str) -> SymbolicFunction:
        entries = self._times(self.inputs[self.x].symbols, self.c)
        return self._made(name, summary, identity, 0, entries, Role("map", codomain=name))

    def derivative(self, name: str, of: str) -> SymbolicFunction:
        entries = tuple(self.terms.let(entry) for entry in self.C)
        result = Result(f"{self.y}_D_{self.x}", entries, self.C.shape, "1, m, 1/m", "derivative")
        role = Role("map derivative", domain=self._domain, codomain=of)
        summary = f"Derivative of {of}, constant."
        identity = f"{name}[:, k] = d {of} / d {self.x}_k"
        inputs = (self.inputs[self.x],)
        return SymbolicFunction(name, summary, identity, inputs, (result,), self.terms, role=role)

    def rates(self, of: str, order: int) -> SymbolicFunction:
        noun, suffix = _NOUNS[order], _ORDERS[order]
        entries = self._times(self.inputs[f"{self.x}{suffix}"].symbols, sp.zeros(self.C.rows, 1))
        slope = f"{of}_D_{'chain' if self.x == 'theta' else self.x}"
        name = f"{of.removesuffix('s')}_{noun}"
        what = "joint" if of == "chain" else "coordinate"
        identity = f"{self.y}{suffix} = {slope}({self.x}) {self.x}{suffix}"
        role = Role(f"map {noun.removesuffix('s')}", codomain=of)
        summary = f"{what.capitalize()} {noun}."
        return self._made(name, summary, identity, order, entries, role)

    def _times(self, x: Sequence[sp.Symbol], c: sp.Matrix) -> tuple[sp.Expr, ...]:
        return tuple(
            self.terms.let(
                sp.Add(*(r * s for r, s in zip(self.C.row(j), x, strict=True) if r != 0), c[j])
            )
            for j in range(self.C.rows)
        )

    @property
    def _domain(self) -> str:
        return "actuators" if self.x == "q" else "chain"

    def _made(
        self,
        name: str,
        summary: str,
        identity: str,
        order: int,
        entries: tuple[sp.Expr, ...],
        role: Role,
    ) -> SymbolicFunction:
        inputs = tuple(self.inputs[f"{self.x}{suffix}"] for suffix in _ORDERS[: order + 1])
        like = self.outputs[f"{self.y}{_ORDERS[order]}"]
        result = Result(like.name, entries, like.shape, like.unit, like.meaning)
        own = Role(role.name, domain=self._domain, codomain=role.codomain)
        return SymbolicFunction(name, summary, identity, inputs, (result,), self.terms, role=own)
