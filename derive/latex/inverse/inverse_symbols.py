"""Defines the LaTeX symbols of an inverse kinematics task."""

from collections.abc import Collection, Mapping, Sequence

import sympy as sp

from ...inverse.structure.lines import Axis, Lines
from ...inverse.tasks.slots import POSE_SYMBOLS
from ...inverse.tasks.task import InputLetter, Solved
from ...model.robot import SerialRobot
from ..setting import names
from ..setting.notation import ENTRY, LENGTH, OTHER, Notation

KINDS = {
    "A": ("A", r"\mathcal{A}", r"\mathrm{A}"),
    "B": ("B", r"\mathcal{B}", r"\mathrm{B}"),
    "C": ("C", r"\mathcal{C}", r"\mathrm{C}"),
    "sigma": (r"\sigma", r"\varsigma", r"\epsilon"),
    "sum": (r"\theta", r"\chi", r"\vartheta"),
    "side": (r"\varepsilon", r"\eta", r"\iota"),
    "slide": (r"\xi", r"\zeta", r"\Xi"),
}
"""LaTeX letters for each kind of symbol, such as coefficients, signs and prismatic joints, in order
of preference."""


class InverseLetters:
    """Selects LaTeX letters that the symbols of a robot do not use yet."""

    def __init__(self, robot: SerialRobot, notation: Notation) -> None:
        parameters = names.distinct(parameter.name for parameter in robot.parameters)
        heads = map(names.head, (*parameters.values(), *notation.called))
        self.taken: Collection[str] = {*heads, *notation.letters.values()}

    def of(self, kind: str) -> str:
        """Return an unused letter for a kind of symbol, such as a sign or coefficient."""
        return self.free(KINDS[kind])

    def free(self, options: Sequence[str]) -> str:
        """Return the first unused letter of ``options``, or the last letter if all are used."""
        free = [letter for letter in options if letter not in self.taken]
        if free:
            return free[0]
        return options[-1] if options[-1].startswith("\\") else rf"\mathrm{{{options[-1]}}}"


BEHIND_VECTORS = 100
"""Sort key that places the coefficients A, B and C of a solution step after the vectors in a
printed product."""


class InverseSymbols:
    """LaTeX symbols of an inverse kinematics task.

    Attributes:
        notation: Notation with the robot's short symbols, to which ``InverseSymbols`` adds the
            symbols of the task.
        letters: The letters that the LaTeX article does not use yet.
        inputs: Printed symbols of the task's inputs, keyed by the original symbols.
        signs: Printed symbols of the branch signs (1 or -1) that select a solution.
        actuators: Printed symbols of the actuated coordinates that solution steps may determine,
            keyed by coordinate name.
    """

    def __init__(
        self,
        robot: SerialRobot,
        notation: Notation,
        lines: Lines,
        solved: Solved,
        actuators: Mapping[str, sp.Symbol],
    ) -> None:
        self.notation, self.actuators = notation, actuators
        self.letters = InverseLetters(robot, notation)
        self._robot, self._axes = robot, lines.axes
        self.inputs = self._named_inputs(solved)
        self.signs = tuple(
            notation.symbol(f"{self.letters.of('sigma')}_{{{k}}}", (LENGTH, (-2, k)))
            for k in range(1, len(solved.work.signs) + 1)
        )

    def _named_inputs(self, solved: Solved) -> dict[sp.Symbol, sp.Symbol]:
        entries = zip(POSE_SYMBOLS, self.notation.entries(), strict=True)
        named = {symbol: entry for symbol, entry in entries if entry is not None}
        for asked in solved.inputs:
            for symbol, shown in zip(asked.argument.symbols, asked.printed, strict=True):
                is_letter = isinstance(shown, InputLetter)
                named[symbol] = self._lettered(symbol, shown) if is_letter else named[shown]
        arguments = {argument.name: argument for argument in solved.function.inputs}
        symbols = {s for argument in arguments.values() for s in argument.symbols}
        for joint, q in zip(self._robot.moving, self.notation.q, strict=True):
            # In robots with loops, a fixed joint has two symbols: one for the input value, and one
            # for the joint coordinate in the main chain.
            if joint.name in solved.given and joint.name in arguments:
                named |= dict.fromkeys(arguments[joint.name].symbols, q)
        known = {symbol: shown for symbol, shown in named.items() if symbol in symbols}
        return known | {q: q for q in self.notation.q if q in symbols}

    def _lettered(self, symbol: sp.Symbol, letter: InputLetter) -> sp.Symbol:
        tex = self.letters.free(letter.letters)
        if letter.component is None:
            return self.notation.symbol(tex, (OTHER, (symbol.name,)))
        tex = f"{tex}_{{{'xyz'[letter.component]}}}"
        return self.notation.symbol(tex, (ENTRY, (letter.letters[0], letter.component)))

    def component(self, letter: str, axis: str) -> sp.Symbol:
        """Return the printed symbol of the x, y or z component of a vector."""
        return self.notation.symbol(f"{letter}_{{{axis}}}", (LENGTH, (-1, letter, axis)))

    def coefficient(self, letter: str, number: int) -> sp.Symbol:
        """Return the printed symbol of the coefficient A, B or C of a solution step."""
        tex = f"{self.letters.of(letter)}_{{{number}}}"
        return self.notation.symbol(tex, (LENGTH, (95, number, BEHIND_VECTORS, letter)))

    def sum(self, number: int) -> sp.Symbol:
        """Return the printed symbol of an angle sum that a solution step determines."""
        tex = f"{self.letters.of('sum')}_{{{number}}}"
        return self.notation.symbol(tex, (LENGTH, (94, number)))

    def side(self) -> sp.Symbol:
        """Return the printed symbol of a number that is 1 or -1."""
        return self.notation.symbol(self.letters.of("side"), (LENGTH, (-2, 0)))

    def value_of(self, joint: int) -> sp.Expr:
        """Return the printed expression for the value of a joint."""
        slides = [axis.joint for axis in self._axes if not axis.turns]
        if not self.actuators and joint == len(self._robot.moving):
            # An index one higher than that of the last moving joint denotes the revolute joint that
            # the inverse kinematics adds at the tool.
            return self.notation.symbol(f"q_{{{joint + 1}}}", (LENGTH, (92, joint)))
        if not self.actuators or joint not in slides:
            return self._robot.moving[joint].direction * self.notation.q[joint]
        number = 1 + slides.index(joint)
        tex = f"{self.letters.of('slide')}_{{{number}}}"
        return self.notation.symbol(tex, (LENGTH, (93, number)))

    def angle(self, joints: Sequence[str], done: frozenset[int] = frozenset()) -> sp.Expr:
        """Return the signed angle sum of parallel joints.

        If a joint axis is opposite to the axis of the first joint, the joint angle has a minus sign
        in the sum.

        Args:
            joints: Names of the joints.
            done: Indices of the prismatic joints that are already solved, whose axes are skipped.
        """
        if joints[0] in self.actuators:
            return self.actuators[joints[0]]
        axes = [self.axis(name, done) for name in joints]
        total = sp.Integer(0)
        for axis in axes:
            sense = 1 if float(axes[0].direction @ axis.direction) > 0 else -1
            total += sense * self.value_of(axis.joint)
        return total

    def sense(self, joints: Sequence[str], done: frozenset[int] = frozenset()) -> int:
        """Return -1 if the angle of the first joint has a minus sign, otherwise 1."""
        return -1 if self.angle(joints[:1], done).could_extract_minus_sign() else 1

    def axis(self, name: str, done: frozenset[int] = frozenset()) -> Axis:
        """Return the first axis called ``name`` whose joint is not in ``done``."""
        named = [axis for axis in self._axes if axis.name == name]
        return next((axis for axis in named if axis.joint not in done), named[0])
