"""Text report on a robot with loops: freedoms, loops, and the solution steps of each loop."""

from collections.abc import Iterator

from ..hybrid import Hybrid
from ..solution import Solution
from .closable import doubts_of, limits_of


def in_words(h: Hybrid) -> str:
    """Reports three counts of the mechanism's freedoms, its loops, and the solution of each loop.

    Raises:
        DescriptionError: The loops do not close at the reference, or the actuators do not match the
            freedoms.
    """
    h.check()
    paragraphs = [_freedoms(h)]
    if h.mechanism.closers:
        paragraphs += [_loops(h), _ways(h)]
    paragraphs += [[f"{line[0].upper()}{line[1:]}." for line in (*limits_of(h), *doubts_of(h))]]
    return "\n\n".join("\n".join(lines) for lines in paragraphs if lines)


def _freedoms(h: Hybrid) -> list[str]:
    found = h.mobility
    actuated = ", ".join(h.mechanism.actuated)
    return [
        f"Freedoms: {found.true}, actuated by {actuated}. "
        f"n = {found.bodies} bodies, j = {found.joints} joints, sum f = {found.freedoms}, "
        f"lambda = {found.order}.",
        *(f"  {line}" for line in found.report),
    ]


def _loops(h: Hybrid) -> list[str]:
    lines = ["Loops, each with the joints around it:"]
    for equations in h.equations:
        around = ", ".join(dict.fromkeys(factor.name for factor in equations.factors))
        count = len(equations.residual)
        lines.append(f"  {equations.name} ({equations.kind}, {count} equations): {around}")
    return lines


def _ways(h: Hybrid) -> list[str]:
    lines = ["From the actuators:", *_steps(h, h.forward)]
    if h.forward.open:
        lines.append(f"  {', '.join(h.forward.open)}: by Newton's iteration at run time")
    lines += ["From the main chain:", *_steps(h, h.backward)]
    if h.backward.open:
        lines.append(f"  {', '.join(h.backward.open)}: no closed form")
    return lines


def _steps(h: Hybrid, solution: Solution) -> Iterator[str]:
    for number, step in enumerate(solution.steps, 1):
        side = f", the branch {step.branch}" if step.branch else ""
        loop = step.name(h.mechanism)
        of_loop = f"{loop}: " if loop else ""
        yield f"  {number}. {of_loop}{step.title}, for {', '.join(step.joints)}{side}"
