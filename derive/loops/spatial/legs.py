"""Loops of space that have a closed form: legs on balls, and platforms that only translate.

A strut on balls keeps two points at a distance. Where both are known it gives a cylinder's length;
where one is known and a single joint moves the other, that joint (a circle or a line meets a
sphere); where three of them hold a platform that keeps its orientation, its position (three spheres
meet). Pairs of equal, parallel rods are such a hold.

Source: Merlet, Parallel Robots, ch. 2 and 4; Clavel 1988 for the parallelograms of balls.
"""

import cmath
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import sympy as sp

from ...model.errors import RobotError
from ...model.mechanism import Frame, Mechanism, Strut
from ...model.robot import Joint
from ...terms.tangents import LoopRate, Tangent
from ...terms.terms import Terms
from ...terms.vectors import Vector, cross, named, subtracted
from ..planar.assembly import SIDES, TRAVELS, Step, meeting
from ..planar.dyads import Arm, rate_of_first, turn_of, two_circles
from ..planar.phasors import PhasorSum
from ..planar.planes import Loop
from ..planar.reference import AtReference, wrapped
from .body_frames import pose_of

ONE, ZERO = sp.Integer(1), sp.Integer(0)
HALF = sp.Rational(1, 2)
SPHERES = 3
GENERIC = (0.5772, 0.2618, 1.2020, 0.9159, 0.6434, 0.3028, 0.7390, 0.1234)
"""Values without meaning, at which terms are equal only if they are everywhere."""
SAME = 1e-12
"""Terms that differ by less at generic values are equal (metre)."""
BRANCHES = {1: "above", -1: "below"}


@dataclass(frozen=True)
class Known:
    """What the solution of spatial loops begins with and adds to.

    Attributes:
        values: Of joints, swings and cylinders by name.
        loops: Rates of the solved angles.
        steps: How the loops were solved.
    """

    values: dict[str, sp.Expr]
    loops: dict[sp.Symbol, LoopRate]
    steps: list[Step]


def assemble_in_space(
    terms: Terms,
    mechanism: Mechanism,
    loops: Sequence[Loop],
    known: Known,
    reference: AtReference,
    signs: Iterator[int] | None = None,
) -> None:
    """Adds what the spatial loops determine to what is known.

    Args:
        terms: Names of all terms.
        mechanism: The description.
        loops: The loops that are not planar; those of struts on balls are solved.
        known: Receives values, rates and steps.
        reference: The configuration whose branch is meant.
        signs: Signs of the branches, step by step, instead of those at the reference.

    Raises:
        RobotError: A loop does not close at the reference, or its branch there is not clear.
    """
    struts = [loop.closer for loop in loops if isinstance(loop.closer, Strut)]
    solver = _Solver(terms, mechanism, known, reference, signs)
    solver.run([strut for strut in struts if strut.ends == "ball"])


class _Solver:
    """The struts of one mechanism that are still to be used."""

    def __init__(
        self,
        terms: Terms,
        mechanism: Mechanism,
        known: Known,
        reference: AtReference,
        signs: Iterator[int] | None,
    ) -> None:
        self.terms, self.mechanism, self.known = terms, mechanism, known
        self.reference, self.signs = reference, signs

    def run(self, struts: list[Strut]) -> None:
        while struts:
            used = [strut for strut in struts if self._use(strut)]
            if not used and not self._hold(struts):
                return
            struts = [strut for strut in struts if strut not in used] if used else []

    # --- one strut ---

    def _use(self, strut: Strut) -> bool:
        """Takes from a strut what it determines alone; False where that is nothing yet."""
        moving = [*self._unknown(strut.a), *self._unknown(strut.b)]
        length = self._length(strut)
        if length is None:
            if not moving:
                self._measure(strut)
            return not moving
        if len(moving) == 1:
            self._leg(strut, moving[0], length)
        # With both ends known a rod tells nothing that others did not.
        return len(moving) <= 1

    def _measure(self, strut: Strut) -> None:
        """A cylinder between two known points."""
        d = subtracted(self.terms, self._point(strut.b), self._point(strut.a))
        distance = self.terms.let(sp.sqrt(_square(self.terms, d)))
        self.known.values[strut.name] = self.terms.let(distance - strut.length)
        step = self._step("distance", (strut.a.body, strut.b.body), (strut.name,), {"d": d})
        self._note(replace(step, travels=(distance,)))

    def _leg(self, strut: Strut, joint: Joint, length: sp.Expr) -> None:
        """A rod from a known point to a body that one joint moves."""
        on_joint = joint in self.mechanism.way(strut.a.body)
        near, far = (strut.a, strut.b) if on_joint else (strut.b, strut.a)
        frame = Frame(joint.parent, joint.before)
        axes, origin = pose_of(self.mechanism, self.terms, frame, self.known.values)
        still = self.known.values | {joint.name: ZERO}
        _, at_zero = pose_of(self.mechanism, self.terms, near, still)
        tip, target = (
            self._seen(axes, subtracted(self.terms, point, origin))
            for point in (at_zero, self._point(far))
        )
        solve = self._slide if joint.kind == "prismatic" else self._turn
        solve(strut, joint, tip, target, self.terms.let(length**2))

    def _turn(
        self, strut: Strut, joint: Joint, tip: Vector, target: Vector, square: sp.Expr
    ) -> None:
        """A circle about the joint's axis meets a sphere: two circles in the joint's plane."""
        let = self.terms.let
        height = let(target[2] - tip[2])
        flat = let(square - height**2)
        D = Arm((target[0], target[1]), ZERO, let(target[0] ** 2 + target[1] ** 2))
        v = Arm((tip[0], tip[1]), ZERO, let(tip[0] ** 2 + tip[1] ** 2))
        w = Arm((let(sp.sqrt(flat)), ZERO), ZERO, flat)
        sign = self._chosen(strut, lambda s: self._angle_at_reference(v, w, D, s), joint)
        found = two_circles(self.terms, v, w, D, sign)
        c, s = turn_of(self.terms, found.C, v)
        angle = self.terms.solved_angle(c, s)
        self.known.loops.setdefault(angle, rate_of_first(found, c, s))
        self.known.values[joint.name] = joint.direction * angle
        # Of the whole rod, not of its part in the plane, whose square is below 0 out of its reach.
        margin = let(found.margin * let(flat / square))
        vectors = {"D": D.vector, "v": v.vector, "w": w.vector, "l^2": (square,)}
        step = self._leg_step(strut, joint, vectors, margin, SIDES[sign], sign)
        self._note(replace(step, solved=(angle,)))

    def _slide(
        self, strut: Strut, joint: Joint, tip: Vector, target: Vector, square: sp.Expr
    ) -> None:
        """A line along the joint's axis meets a sphere."""
        let = self.terms.let
        x, y, z = subtracted(self.terms, target, tip)
        inside = let(square - let(x**2 + y**2))
        along = let(sp.sqrt(inside))

        def travel(sign: int) -> float:
            return self.reference.of(joint.direction * (z + sign * along))

        sign = self._chosen(strut, travel, joint)
        value = let(z + sign * along)
        self.known.values[joint.name] = joint.direction * value
        margin = let(inside / square)
        vectors = {"offset": (x, y, z), "l^2": (square,)}
        step = self._leg_step(strut, joint, vectors, margin, TRAVELS[sign], sign)
        self._note(replace(step, travels=(value,)))

    def _angle_at_reference(self, v: Arm, w: Arm, D: Arm, sign: int) -> float:
        """The angle of a leg's joint, in numbers; NaN where the leg does not reach."""
        d, u = self.reference.number(D.vector), self.reference.number(v.vector)
        square = self.reference.of(w.square)
        C = meeting(abs(u), math.sqrt(square), d, sign) if square >= 0 and u != 0 else None
        return math.nan if C is None else cmath.phase(C / u)

    # --- three spheres ---

    def _hold(self, struts: Sequence[Strut]) -> bool:
        """A platform that struts hold in its orientation; False where they do not."""
        ways = [self._unknown(strut.b) or self._unknown(strut.a) for strut in struts]
        way = ways[0]
        sliders = [joint for joint in way if joint.kind == "prismatic"]
        is_free = len(sliders) == SPHERES and way[:SPHERES] == sliders
        if not is_free or any(other != way for other in ways):
            return False
        if any(self._length(strut) is None for strut in struts):
            return False
        turned = {
            joint.name: self.mechanism.reference_of(joint.name)
            for joint in way
            if joint.kind != "prismatic"
        }
        still = self.known.values | turned | {joint.name: ZERO for joint in sliders}
        spheres = self._distinct([self._sphere(strut, way, still) for strut in struts])
        if len(spheres) != SPHERES:
            return False
        axes = [self._axis(joint, still) for joint in sliders]
        position, step = self._three_spheres(struts, spheres, axes, sliders)
        for joint, axis in zip(sliders, axes, strict=True):
            along = sum((a * p for a, p in zip(axis, position, strict=True)), ZERO)
            self.known.values[joint.name] = self.terms.let(joint.direction * along)
        self.known.values.update(turned)
        self._note(step)
        return True

    def _sphere(
        self, strut: Strut, way: Sequence[Joint], still: Mapping[str, sp.Expr]
    ) -> tuple[Vector, sp.Expr]:
        """Centre and squared radius of the sphere on which a strut holds the platform's origin."""
        on_a = way[0] in self.mechanism.way(strut.a.body)
        moved, fixed = (strut.a, strut.b) if on_a else (strut.b, strut.a)
        _, offset = pose_of(self.mechanism, self.terms, moved, still)
        _, point = pose_of(self.mechanism, self.terms, fixed, self.known.values)
        length = self._length(strut)
        assert length is not None
        return subtracted(self.terms, point, offset), self.terms.let(length**2)

    def _distinct(self, spheres: Sequence[tuple[Vector, sp.Expr]]) -> list[tuple[Vector, sp.Expr]]:
        """The spheres that differ: those of parallel rods are one."""
        inputs = sorted(self._inputs(spheres), key=str)
        values = {s: GENERIC[k % len(GENERIC)] + k // len(GENERIC) for k, s in enumerate(inputs)}
        generic = AtReference(self.terms, values, {})
        found: list[tuple[Vector, sp.Expr]] = []
        seen: list[list[float]] = []
        for centre, square in spheres:
            numbers = [generic.of(entry) for entry in (*centre, square)]
            if not any(math.dist(numbers, other) < SAME for other in seen):
                found.append((centre, square))
                seen.append(numbers)
        return found

    def _inputs(self, spheres: Sequence[tuple[Vector, sp.Expr]]) -> set[sp.Symbol]:
        """The coordinates that spheres depend on."""
        entries = [entry for centre, square in spheres for entry in (*centre, square)]
        terms = self.terms.needed(entries)
        used = {
            s for e in (*entries, *map(self.terms.definitions.get, terms)) for s in e.free_symbols
        }
        return {
            s for s in used if s not in self.terms.definitions and not self.terms.is_constant(s)
        }

    def _three_spheres(
        self,
        struts: Sequence[Strut],
        spheres: Sequence[tuple[Vector, sp.Expr]],
        axes: Sequence[Vector],
        sliders: Sequence[Joint],
    ) -> tuple[Vector, Step]:
        """Where three spheres meet.

        From the first centre, with u and v to the others and w = u x v:
        p . u = alpha and p . v = beta give n = alpha (v x w) + beta (w x u), and
        p = n / w^2 + sign w sqrt(h^2 / w^2), h^2 = l^2 - n^2 / w^4.
        """
        terms, let = self.terms, self.terms.let
        (c1, l1), (c2, l2), (c3, l3) = spheres
        u, v = subtracted(terms, c2, c1), subtracted(terms, c3, c1)
        w = cross(terms, u, v)
        alpha = let(HALF * (_square(terms, u) + l1 - l2))
        beta = let(HALF * (_square(terms, v) + l1 - l3))
        vw, wu = cross(terms, v, w), cross(terms, w, u)
        w2 = _square(terms, w)
        foot = named(terms, (let(alpha * a + beta * b) / w2 for a, b in zip(vw, wu, strict=True)))
        h2 = let(l1 - _square(terms, foot))
        rise = let(sp.sqrt(let(h2 / w2)))

        def position(sign: int) -> Vector:
            return named(
                terms,
                (c + f + sign * rise * e for c, f, e in zip(c1, foot, w, strict=True)),
            )

        def distance(sign: int) -> float:
            hints = self.reference.hints_of([joint.name for joint in sliders])
            p = [self.reference.of(entry) for entry in position(sign)]
            return math.sqrt(
                sum(
                    (
                        joint.direction
                        * sum(self.reference.of(a) * x for a, x in zip(axis, p, strict=True))
                        - hints.get(joint.name, 0.0)
                    )
                    ** 2
                    for joint, axis in zip(sliders, axes, strict=True)
                )
            )

        sign = self._sign({s: distance(s) for s in BRANCHES}, struts[0].name)
        found = position(sign)
        self._note_rates(found, [centre for centre, _ in spheres])
        bodies = tuple(dict.fromkeys(strut.a.body for strut in struts))
        names = tuple(strut.name for strut in struts)
        margin = let(h2 / l1)
        vectors = {
            **{f"c{k}": centre for k, (centre, _) in enumerate(spheres, 1)},
            "l^2": (l1, l2, l3),
            "p": found,
        }
        step = self._step("three spheres", bodies, names, vectors)
        return found, replace(step, margin=margin, branch=BRANCHES[sign], sign=sign)

    def _note_rates(self, position: Vector, centres: Sequence[Vector]) -> None:
        """The rates of the position, from (p - c_i) . (p' - c_i') = 0."""
        normals = [subtracted(self.terms, position, centre) for centre in centres]
        pairs = [(normals[k - 2], normals[k - 1]) for k in range(SPHERES)]
        crosses = [cross(self.terms, *pair) for pair in pairs]
        volume = self.terms.let(_dot(normals[0], crosses[0]))
        for k, component in enumerate(position):
            factors = [self.terms.let(product[k] / volume) for product in crosses]
            sign = -ONE if (-component).is_Symbol else ONE
            rate = partial(_rate_on_spheres, normals, centres, factors, sign)
            self.known.loops.setdefault(sign * component, rate)

    # --- branches ---

    def _chosen(self, strut: Strut, value: Callable[[int], float], joint: Joint) -> int:
        """The sign for which a joint is nearest to its reference."""
        hint = self.reference.hints_of([joint.name]).get(joint.name, 0.0)
        apart = wrapped if joint.kind != "prismatic" else float
        return self._sign({s: abs(apart(value(s) - hint)) for s in SIDES}, strut.name)

    def _sign(self, distances: Mapping[int, float], name: str) -> int:
        if self.signs is not None:
            return next(self.signs, 1)
        if any(math.isnan(distance) for distance in distances.values()):
            raise RobotError(f"the loop of {name} does not close at the reference")
        return min(distances, key=distances.__getitem__)

    # --- points ---

    def _unknown(self, frame: Frame) -> list[Joint]:
        """The joints before a frame whose values are not known."""
        way = self.mechanism.way(frame.body)
        return [j for j in way if j.kind != "fixed" and j.name not in self.known.values]

    def _length(self, strut: Strut) -> sp.Expr | None:
        """A strut's length as far as it is known."""
        if not strut.is_cylinder:
            return strut.length
        value = self.known.values.get(strut.name)
        return None if value is None else strut.length + value

    def _point(self, frame: Frame) -> Vector:
        return pose_of(self.mechanism, self.terms, frame, self.known.values)[1]

    def _axis(self, joint: Joint, values: Mapping[str, sp.Expr]) -> Vector:
        """Direction of a slider in the base frame."""
        axes, _ = pose_of(self.mechanism, self.terms, Frame(joint.parent, joint.before), values)
        return axes[2]

    def _seen(self, axes: Sequence[Vector], vector: Vector) -> Vector:
        """A vector of the base frame in other axes."""
        return named(
            self.terms,
            (sum((a * b for a, b in zip(axis, vector, strict=True)), ZERO) for axis in axes),
        )

    def _leg_step(
        self,
        strut: Strut,
        joint: Joint,
        vectors: Mapping[str, tuple[sp.Expr, ...]],
        margin: sp.Expr,
        branch: str,
        sign: int,
    ) -> Step:
        kind = "line and sphere" if joint.kind == "prismatic" else "circle and sphere"
        step = self._step(kind, (strut.a.body, strut.b.body), (joint.name, strut.name), vectors)
        return replace(step, axes=joint.parent, margin=margin, branch=branch, sign=sign)

    def _step(
        self,
        kind: str,
        bodies: tuple[str, ...],
        joints: tuple[str, ...],
        vectors: Mapping[str, tuple[sp.Expr, ...]],
    ) -> Step:
        axes = self.mechanism.base_frame
        return Step(kind, axes, bodies, joints, PhasorSum(), vectors=vectors)

    def _note(self, step: Step) -> None:
        self.known.steps.append(step)


def _rate_on_spheres(
    normals: Sequence[Vector],
    centres: Sequence[Vector],
    factors: Sequence[sp.Expr],
    sign: sp.Integer,
    tangent: Tangent,
) -> sp.Expr:
    """The rate of one component of a point that stays on moving spheres."""
    let = tangent.terms.let
    along = [let(_dot(n, tangent.of_each(c))) for n, c in zip(normals, centres, strict=True)]
    return let(sign * _dot(factors, along))


def _dot(a: Sequence[sp.Expr], b: Sequence[sp.Expr]) -> sp.Expr:
    return sum((u * v for u, v in zip(a, b, strict=True)), ZERO)


def _square(terms: Terms, vector: Vector) -> sp.Expr:
    return terms.let(sum((component**2 for component in vector), ZERO))
