"""The C of functions through loops without a closed form, solved by ``chasles_closure.h``."""

import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from ...derivation import Derivation
from ...loops.iterated.closure_equations import LoopClosure
from ...loops.iterated.iterated_functions import FROM_CHAIN, SOLVER
from ...model.mechanism import Described
from ...terms.symbolic_function import WrittenFunction
from .expressions import WIDTH, number
from .header import notice, signature, support
from .written import written_file

SUPPORTS = (
    "chasles_closure.h",
    "chasles_closure_newton.h",
    "chasles_closure_rates.h",
    "chasles_closure_tolerances.h",
)
MODES = "chasles_closure_modes.h"
"""The file of robots whose inverse by legs is compared with the forward kinematics."""


def closure_files(derivation: Derivation) -> dict[str, str]:
    """The file of these functions, with their solver, by name; none for another robot."""
    closure = derivation.closure
    if closure is None:
        return {}
    own, needed = {}, [*SUPPORTS]
    for solver in (SOLVER, FROM_CHAIN):
        written = [function for function in derivation.written if function.solver == solver]
        given = closure if solver == SOLVER else closure.of_chain
        if written and given is not None:
            own[written_file(derivation.robot, written[0])] = _source(derivation, given, written)
            needed += [MODES for function in written if function.role.is_inverse]
    return own | {name: support(name) for name in needed if own}


def _source(
    derivation: Derivation, closure: LoopClosure, written: Sequence[WrittenFunction]
) -> str:
    """The robot's numbers as macros and tables, and the functions, behind those that they call."""
    robot = derivation.robot
    own = f"{robot.name}_{'loops' if closure.of_actuators is None else 'chain_loops'}"
    body = _Bodies(robot.name, own, closure)
    functions = [
        "\n".join(
            [
                *textwrap.wrap(signature(robot.name, f), WIDTH, subsequent_indent="    "),
                "{",
                *(f"  {line}" for line in body.of(f)),
                "}\n",
            ]
        )
        for f in written
    ]
    return "\n".join(
        [
            notice(robot),
            *_macros(robot.name, own, closure),
            *_tables(own, closure),
            '\n#include "chasles_closure.h"\n',
            *(f'#include "{MODES}"\n' for f in written if f.role.is_inverse),
            *body.tool(written),
            *functions,
        ]
    )


def pose_from_seed(robot: Described, name: str) -> list[str]:
    """A function for pose and Jacobian from a configuration w nearby, behind the file of the loops.

    Args:
        robot: The robot, whose function ``fk_jacobian_mixed`` goes on from the reference.
        name: The function's name; its arguments are q, w, T and J.
    """
    own = f"{robot.name}_loops"
    return [
        "/* From w, or from the reference where w is NaN or too far away; w becomes that at q. */",
        f"static void {name}(const double *q, double *w, double *T, double *J)",
        "{",
        f"  {own}_closed s;",
        "  memcpy(s.w, w, sizeof s.w);",
        "  if (w[0] == w[0])",
        f"    {own}_near(q, &s);",
        "  if (s.w[0] != s.w[0])",
        f"    {own}_at(q, &s);",
        "  memcpy(w, s.w, sizeof s.w);",
        f"  {own}_tool(&s, T, J);",
        "}\n",
    ]


def _macros(robot: str, own: str, closure: LoopClosure) -> list[str]:
    determinant = closure.start.determinant
    is_square = len(closure.units) == len(closure.unknown)
    macros = {
        "NAME(name)": f"{own}_##name",
        "Q": len(closure.given),
        "W": len(closure.names),
        "U": len(closure.unknown),
        "M": len(closure.units),
        "AT(s)": f"{robot}_closure((s)->w, (s)->c, (s)->D)",
        "BEND(w, wd, D)": f"{robot}_closure_D_w_dot(w, wd, D)",
        "SWINGS": len(closure.hybrid.mechanism.swings),
        "SWING(w, s, D)": f"{robot}_swings(w, s, D)",
        "SENSE": number(float(np.sign(determinant) * is_square)),
        "DETERMINANT": number(abs(determinant)),
    }
    return [f"#define CLOSURE_{name} {value}" for name, value in macros.items()]


def _tables(own: str, closure: LoopClosure) -> list[str]:
    start = closure.start
    lengths = [closure.size if is_length else 1.0 for is_length in closure.is_length]
    numbers = {
        "ratio": closure.ratios,
        "size_u": [lengths[k] for k in closure.unknown],
        "size_c": [closure.size if unit == "m" else 1.0 for unit in closure.units],
        "start_q": start.q.tolist(),
        "start_w": start.w.tolist(),
        "tangent": start.tangent.ravel().tolist(),
    }
    h = closure.hybrid
    chain = [joint.name for joint in h.robot.moving]
    z = [variable.name for variable in h.variables]
    everything = [*closure.names, *h.mechanism.swings]
    indices = {
        "actuated": closure.given,
        "unknown": closure.unknown,
        "theta": [everything.index(name) for name in chain],
        "passive": [everything.index(v.name) for v in h.passive_in_loops] or [0],
        "z": [everything.index(name) for name in z],
        "of_z": [z.index(name) for name in closure.names],
    }
    if closure.of_actuators is not None:
        driven = h.mechanism.coordinates
        numbers["driven_ratio"] = [float(h.terms.value(c.ratio)) for c in driven]
        indices |= {"driven": [closure.names.index(c.moves) for c in driven]}
    return [
        *(table(f"double {own}_{key}", map(number, v)) for key, v in numbers.items()),
        *(table(f"int {own}_{key}", map(str, v)) for key, v in indices.items()),
    ]


def table(name: str, values: Iterable[str]) -> str:
    """The definition of an array of constants."""
    own = list(values)
    text = f"static const {name}[{len(own)}] = {{{', '.join(own)}}};"
    return textwrap.fill(text, WIDTH, subsequent_indent="    ")


class _Bodies:
    """The statements of each function."""

    def __init__(self, robot: str, own: str, closure: LoopClosure) -> None:
        h = closure.hybrid
        self.robot, self.own = robot, own
        self.n, self.q = len(h.robot.moving), len(closure.given)
        self.driven = len(h.q)
        self.w, self.all = len(closure.names), len(closure.names) + len(h.mechanism.swings)
        self.sizes = {
            "chain": ("theta", self.n),
            "passive": ("passive", len(h.passive_in_loops)),
            "configuration": ("z", len(h.variables)),
        }

    def of(self, function: WrittenFunction) -> list[str]:
        """The statements of a function, by its name."""
        name = function.name
        if name in self.sizes:
            return [*self.solved(), *self._every(name, function.outputs[0].name)]
        if name.removesuffix("_D_q") in self.sizes:
            return self._slope(name.removesuffix("_D_q"), function.outputs[0].name)
        return self._others(function)[name](function)

    def _others(
        self, function: WrittenFunction
    ) -> Mapping[str, Callable[[WrittenFunction], list[str]]]:
        kind = function.name.partition("_")[0]
        dot = function.name.endswith("_dot")
        of_kind = {
            "jacobian": self._jacobian_dot if dot else self._jacobian,
            "twist": self._along,
            "acceleration": self._along,
        }
        own = {
            "fk": self._posed,
            "link_poses": self._posed,
            "fk_jacobian_mixed": self._fk_jacobian,
            "hessian_mixed": self._hessian,
            "chain_rates": self._along,
            "chain_accelerations": self._along,
            "margin": self._margin,
            "actuators": self._actuators,
            "actuators_D_chain": self._actuators_slope,
            "actuator_rates": self._actuators_along,
            "actuator_accelerations": self._actuators_along,
            "actuator_margin": self._margin,
            "ik": self._inverse,
            "configuration_near": self._near,
            "fk_near": self._near,
        }
        return own if function.name in own else {function.name: of_kind[kind]}

    def tool(self, functions: Sequence[WrittenFunction]) -> list[str]:
        """The function that fk_jacobian_mixed and the inverse share; none where both are absent."""
        return [
            line
            for function in functions
            if function.name == "fk_jacobian_mixed"
            for line in (
                "/* Pose and Jacobian of the tool at a closed configuration. */",
                f"static void {self.own}_tool({self.own}_closed *s, double *T, double *J)",
                "{",
                *(f"  {line}" for line in self._tool(function.calls[0])),
                "}\n",
            )
        ]

    # --- parts ---

    def _tool(self, of_chain: str) -> list[str]:
        return [
            *self._theta("s->w"),
            *self._w_D_q("s"),
            f"double J_theta[{6 * self.n}];",
            self._called(of_chain, "theta", "T", "J_theta"),
            self._product("J_theta", "theta_q", 0, "J"),
        ]

    def solved(self, given: str = "q") -> list[str]:
        return [f"{self.own}_closed s;", f"{self.own}_at({given}, &s);"]

    def _every(self, kind: str, result: str) -> list[str]:
        table, size = self.sizes[kind]
        return [
            f"double all[{self.all}];",
            f"{self.own}_all(&s, all);",
            f"{self.own}_picked(all, 1, {size}, {self.own}_{table}, {result});",
        ]

    def _theta(self, w: str = "s.w") -> list[str]:
        return [f"double theta[{self.n}];", self._rows(w, 1, "theta")]

    def _rows(self, table: str, columns: int, to: str) -> str:
        return f"{self.own}_picked({table}, {columns}, {self.n}, {self.own}_theta, {to});"

    def _w_D_q(self, solved: str = "&s") -> list[str]:
        return [
            f"double w_q[{self.w * self.q}], theta_q[{self.n * self.q}];",
            f"{self.own}_factored({solved});",
            f"{self.own}_w_D_q({solved}, w_q);",
            self._rows("w_q", self.q, "theta_q"),
        ]

    def _called(self, name: str, *arguments: str) -> str:
        return f"{self.robot}_{name}({', '.join(arguments)});"

    def _product(self, J: str, by: str, is_sum: int, to: str) -> str:
        return f"{self.own}_product({J}, {by}, {self.n}, {is_sum}, {to});"

    # --- functions ---

    def _slope(self, kind: str, result: str) -> list[str]:
        table, size = self.sizes[kind]
        return [
            *self.solved(),
            f"double all[{self.all * self.q}];",
            f"{self.own}_factored(&s);",
            f"{self.own}_all_D_q(&s, all);",
            f"{self.own}_picked(all, {self.q}, {size}, {self.own}_{table}, {result});",
        ]

    def _posed(self, function: WrittenFunction) -> list[str]:
        (result,) = function.outputs
        call = self._called(function.calls[0], "theta", result.name)
        return [*self.solved(), *self._theta(), call]

    def _jacobian(self, function: WrittenFunction) -> list[str]:
        (result,) = function.outputs
        return [
            *self.solved(),
            *self._theta(),
            *self._w_D_q(),
            f"double J_theta[{6 * self.n}];",
            self._called(function.calls[0], "theta", "J_theta"),
            self._product("J_theta", "theta_q", 0, result.name),
        ]

    def _fk_jacobian(self, function: WrittenFunction) -> list[str]:
        T, J = (result.name for result in function.outputs)
        return [*self.solved(), f"{self.own}_tool(&s, {T}, {J});"]

    def _jacobian_dot(self, function: WrittenFunction) -> list[str]:
        (result,) = function.outputs
        rate, jacobian = function.calls[:2]
        return [
            *self.solved(),
            *self._theta(),
            *self._w_D_q(),
            *self._bent("qd"),
            f"double J_theta[{6 * self.n}];",
            self._called(rate, "theta", "thetad", "J_theta"),
            self._product("J_theta", "theta_q", 0, result.name),
            self._called(jacobian, "theta", "J_theta"),
            self._product("J_theta", "theta_q_dot", 1, result.name),
        ]

    def _bent(self, rates: str) -> list[str]:
        return [
            f"double w_q_dot[{self.w * self.q}], theta_q_dot[{self.n * self.q}];",
            f"double wd[{self.w}], thetad[{self.n}];",
            f"{self.own}_rates(&s, {rates}, wd);",
            self._rows("wd", 1, "thetad"),
            f"{self.own}_w_D_q_dot(&s, wd, w_q, w_q_dot);",
            self._rows("w_q_dot", self.q, "theta_q_dot"),
        ]

    def _hessian(self, function: WrittenFunction) -> list[str]:
        (result,) = function.outputs
        own, jacobian = function.calls[:2]
        n, q = self.n, self.q
        return [
            *self.solved(),
            *self._theta(),
            *self._w_D_q(),
            f"double theta_q_q[{n * q * q}], w_q_dot[{self.w * q}], wd[{self.w}];",
            f"double H_theta[{6 * n * n}], J_theta[{6 * n}];",
            f"for (int k = 0; k < {q}; k++) {{",
            f"  for (int i = 0; i < {self.w}; i++)",
            f"    wd[i] = w_q[i * {q} + k];",
            f"  {self.own}_w_D_q_dot(&s, wd, w_q, w_q_dot);",
            f"  {self._rows('w_q_dot', q, f'theta_q_q + k * {n * q}')}",
            "}",
            self._called(own, "theta", "H_theta"),
            self._called(jacobian, "theta", "J_theta"),
            f"{self.own}_hessian(H_theta, J_theta, theta_q, theta_q_q, {n}, {result.name});",
        ]

    def _along(self, function: WrittenFunction) -> list[str]:
        """Rates and accelerations of the chain or of the tool."""
        (result,) = function.outputs
        is_second = "qdd" in [argument.name for argument in function.inputs]
        lines = [
            *self.solved(),
            f"double wd[{self.w}];",
            f"{self.own}_factored(&s);",
            f"{self.own}_rates(&s, qd, wd);",
        ]
        if is_second:
            lines += [f"double wdd[{self.w}];", f"{self.own}_accelerations(&s, wd, qdd, wdd);"]
        if function.name.startswith("chain"):
            return [*lines, self._rows("wdd" if is_second else "wd", 1, result.name)]
        lines += [*self._theta(), f"double thetad[{self.n}];", self._rows("wd", 1, "thetad")]
        motion = ["theta", "thetad"]
        if is_second:
            lines += [f"double thetadd[{self.n}];", self._rows("wdd", 1, "thetadd")]
            motion.append("thetadd")
        return [*lines, self._called(function.calls[0], *motion, result.name)]

    def _margin(self, function: WrittenFunction) -> list[str]:
        (result,), (given,) = function.outputs, function.inputs
        return [*self.solved(given.name), f"{result.name}[0] = {self.own}_margin(&s);"]

    # --- the actuators from the main chain ---

    def _driven(self, table: str, columns: int, result: str) -> list[str]:
        """The rows of the actuated coordinates in a table of all variables."""
        size = self.driven * columns
        rows = f"{table}, {columns}, {self.driven}, {self.own}_driven, {result}"
        row = "k" if columns == 1 else f"k / {columns}"
        return [
            f"{self.own}_picked({rows});",
            f"for (int k = 0; k < {size}; k++)",
            f"  {result}[k] /= {self.own}_driven_ratio[{row}];",
        ]

    def _actuators(self, function: WrittenFunction) -> list[str]:
        return [*self.solved("theta"), *self._driven("s.w", 1, function.outputs[0].name)]

    def _actuators_slope(self, function: WrittenFunction) -> list[str]:
        return [
            *self.solved("theta"),
            f"double w_theta[{self.w * self.q}];",
            f"{self.own}_factored(&s);",
            f"{self.own}_w_D_q(&s, w_theta);",
            *self._driven("w_theta", self.q, function.outputs[0].name),
        ]

    def _actuators_along(self, function: WrittenFunction) -> list[str]:
        """Rates and accelerations of the actuators."""
        (result,) = function.outputs
        rates = [
            *self.solved("theta"),
            f"double wd[{self.w}];",
            f"{self.own}_factored(&s);",
            f"{self.own}_rates(&s, thetad, wd);",
        ]
        if "thetadd" not in [argument.name for argument in function.inputs]:
            return [*rates, *self._driven("wd", 1, result.name)]
        second = f"{self.own}_accelerations(&s, wd, thetadd, wdd);"
        return [*rates, f"double wdd[{self.w}];", second, *self._driven("wdd", 1, result.name)]

    def _inverse(self, function: WrittenFunction) -> list[str]:
        """The slots of the legs; the residual of each is by the forward kinematics."""
        (T,), (q, residual, margin) = function.inputs, function.outputs
        legs, fk = function.calls[:2]
        size = number(float(str(function.tables[0])))
        reached = f"{residual.name}[k] = chasles_mode_residual"
        return [
            "double own_T[16];",
            f"memcpy(own_T, {T.name}, sizeof own_T);",
            self._called(legs, "own_T", q.name, residual.name, margin.name),
            f"for (int k = 0; k < {function.branches}; k++) {{",
            f"  if ({residual.name}[k] != {residual.name}[k])",
            "    continue;",
            "  double reached[16];",
            *(f"  {line}" for line in self.solved(f"{q.name} + {self.q} * k")),
            *(f"  {line}" for line in self._theta()),
            f"  {self._called(fk, 'theta', 'reached')}",
            f"  {reached}(own_T, reached, {residual.name}[k], {size});",
            "}",
        ]

    def _near(self, function: WrittenFunction) -> list[str]:
        q, seed = function.inputs
        lines = [
            f"{self.own}_closed s;",
            f"{self.own}_picked({seed.name}, 1, {self.w}, {self.own}_of_z, s.w);",
            f"{self.own}_near({q.name}, &s);",
        ]
        if function.name == "fk_near":
            call = self._called(function.calls[0], "theta", function.outputs[0].name)
            lines += [*self._theta(), call]
        return [*lines, *self._every("configuration", function.outputs[-1].name)]
