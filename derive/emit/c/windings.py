"""Generates the C that shifts inverse solutions of a coupled robot by full turns to be near a seed.

A full turn of a joint does not change the pose, but may move several coordinates by fractions of a
turn; for example, both motors of a differential move by half a turn. If a full turn of a joint is a
full turn of a single coordinate, no shift is needed.
"""

import textwrap

import sympy as sp

from ...derivation import Derivation
from ...inverse.coupled_chain import CoupledChain
from .expressions import WIDTH, number


def unwinding(derivation: Derivation, wraps: list[bool]) -> list[str]:
    """Returns the function that shifts solutions, and its macros; empty if no shift is needed.

    Args:
        derivation: The derivation of the robot.
        wraps: Whether a full turn of each coordinate leaves the pose unchanged.
    """
    rows = _rows(derivation.inverse.chain, wraps) if derivation.inverse else []
    if not rows:
        return []
    name, n = derivation.robot.name, len(wraps)
    turned, shift = (_table(kind, n, rows, k) for k, kind in enumerate(("turns", "shift")))
    return [
        "/* Shifts the slots by full turns of the joints to the windings nearest to the seed. */",
        f"static inline void {name}_unwind(int slots, const double *q_seed, double *q)",
        "{",
        *turned,
        *shift,
        f"  for (int slot = 0; slot < slots; slot++, q += {n}) {{",
        f"    for (int j = 0; j < {len(rows)}; j++) {{",
        "      double apart = 0;",
        f"      for (int k = 0; k < {n}; k++) {{",
        "        apart += turns[j][k] * (q_seed[k] - q[k]);",
        "      }",
        "      apart = rint(apart);",
        f"      for (int k = 0; k < {n}; k++) {{",
        "        q[k] += shift[j][k] * apart;",
        "      }",
        "    }",
        "  }",
        "}\n",
        "/* chasles_nearest_slots with the windings nearest to each seed. */",
        f"static inline void {name}_nearest_slots(size_t rows, int n, int k,",
        "    const double *const *slots, double tolerance, const double *const *moves,",
        "    const double *q_seed, ptrdiff_t seed_step, double *const *outputs, signed char *slot)",
        "{",
        f"  double q[{n} * CHASLES_MAX_SLOTS];",
        "  for (size_t row = 0; row < rows; row++, q_seed += seed_step) {",
        "    const size_t from = row * (size_t)k, at = row * (size_t)n;",
        "    const double *own[] = {q, slots[1] + from, slots[2] + from};",
        "    double *out[] = {outputs[0] + at, outputs[1] + row, outputs[2] + row};",
        "    memcpy(q, slots[0] + from * (size_t)n, (size_t)(n * k) * sizeof *q);",
        f"    {name}_unwind(k, q_seed, q);",
        "    chasles_nearest_slots(1, n, k, own, tolerance, moves, q_seed, 0, out, slot + row);",
        "  }",
        "}",
        f"#define chasles_nearest_slots {name}_nearest_slots\n",
    ]


def _rows(chain: CoupledChain | None, wraps: list[bool]) -> list[tuple[list[float], list[float]]]:
    """Returns the turns per coordinate, and coordinates per turn, of each joint to be shifted."""
    if chain is None:
        return []
    L, joints = chain.inverse()
    found = []
    for k, joint in enumerate(joints):
        moved = list(L.col(k))
        alone = all(x == 0 or (x.is_Integer and wraps[i]) for i, x in enumerate(moved))
        if chain.robot.moving[joint].kind == "revolute" and not alone:
            turns = [float(ratio / (2 * sp.pi)) for ratio in chain.C.row(joint)]
            found.append((turns, [float(x * 2 * sp.pi) for x in moved]))
    return found


def _table(kind: str, n: int, rows: list[tuple[list[float], list[float]]], part: int) -> list[str]:
    braces = ", ".join(f"{{{', '.join(map(number, row[part]))}}}" for row in rows)
    line = f"static const double {kind}[{len(rows)}][{n}] = {{{braces}}};"
    return textwrap.wrap(line, WIDTH, initial_indent="  ", subsequent_indent="      ")
