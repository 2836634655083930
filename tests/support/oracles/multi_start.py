"""Assembly modes of a mechanism by multi-start Newton iteration in NumPy.

The loop equations follow only from the frames, closures and lengths of the robot description. A pin
or ball closure makes two points coincide, and a rod keeps two points at a constant distance. A
cylinder of unknown length adds no loop equation. Loops that share no unknown joints are solved
separately.
"""

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
import sympy as sp

from chasles.derive.model.mechanism import Closure, Mechanism, Strut
from chasles.derive.model.placements import Placement, Translation
from chasles.derive.model.robot import Joint

STARTS = 48
"""Number of start configurations in one round of the search."""
ROUNDS = 12
ITERATIONS = 60
LONGEST_STEP = 0.8
"""Maximum Newton step (radian, or relative to the mechanism size)."""
CLOSED = 1e-11
"""Maximum residual of an assembly mode, relative to the mechanism size."""
SAME = 1e-6
"""Maximum difference at which two assembly modes count as equal (radian, or relative to the
mechanism size)."""
Way = list[tuple[Joint, np.ndarray, np.ndarray]]


class Loop:
    """A loop that is closed by a closure or strut, with numeric dimensions."""

    def __init__(self, numbers: "Multistart", loop_joint: Closure | Strut) -> None:
        """Find the joints of a loop.

        A joint belongs to the loop if only one of the two paths from the loop ends to the base
        contains this joint.
        """
        paths = [numbers.mechanism.path_to(frame.body) for frame in (loop_joint.a, loop_joint.b)]
        while paths[0] and paths[1] and paths[0][0] is paths[1][0]:
            paths = [path[1:] for path in paths]
        self.loop_joint = loop_joint
        self.length = 0.0 if isinstance(loop_joint, Closure) else numbers.number(loop_joint.length)
        self.paths = [[numbers.around(joint) for joint in path] for path in paths]
        self.ends = [numbers.pose(frame.placement) for frame in (loop_joint.a, loop_joint.b)]
        self.joints = {j.name for path in paths for j in path if j.kind != "fixed"}
        self.size = numbers.size

    def points(
        self, values: Mapping[str, np.ndarray], unknown: Sequence[str], count: int
    ) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Return both end points (n, 3) of the loop, and their derivatives (n, 3, unknown)."""
        points, slopes = [], []
        for path, end in zip(self.paths, self.ends, strict=True):
            T = np.broadcast_to(np.eye(4), (count, 4, 4))
            axes = {}
            for joint, before, after in path:
                T = T @ before
                if joint.kind != "fixed":
                    axes[joint.name] = joint, T
                    T = T @ _motion(joint, values[joint.name], count)
                T = T @ after
            p = (T @ end)[:, :3, 3]
            slope = np.zeros((count, 3, len(unknown)))
            for k, name in enumerate(unknown):
                if name in axes:
                    joint, at = axes[name]
                    z = joint.direction * at[:, :3, 2]
                    turns = joint.kind != "prismatic"
                    slope[:, :, k] = np.cross(z, p - at[:, :3, 3]) if turns else z * self.size
            points.append(p)
            slopes.append(slope)
        return points, slopes

    def residual(
        self, values: Mapping[str, np.ndarray], unknown: Sequence[str], count: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return (closure errors (n, m), derivatives (n, m, unknown)).

        The errors are relative to the mechanism size.
        """
        (a, b), (A, B) = self.points(values, unknown, count)
        d, D = (a - b) / self.size, (A - B) / self.size
        if isinstance(self.loop_joint, Closure):
            return d, D
        length = self.length + values.get(self.loop_joint.name, 0.0)
        far = np.linalg.norm(d, axis=-1)
        slope = np.einsum("ni,nik->nk", d, D) / np.where(far > 0, far, 1.0)[:, None]
        return (far - length / self.size)[:, None], slope[:, None]

    def distance(self, values: Mapping[str, np.ndarray], count: int) -> np.ndarray:
        """Return the distance (n,) between both end points of the loop."""
        (a, b), _ = self.points(values, (), count)
        return np.linalg.norm(a - b, axis=-1)


class Multistart:
    """A numeric mechanism.

    Attributes:
        mechanism: The description.
        given: The parameter values.
        size: Longest length of the mechanism (meter), which is the length unit of Newton's method.
        actuated: Names of the actuated joints and cylinders.
        chain: Names of the main-chain joints.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.given = {p.symbol: p.value for p in mechanism.parameters}
        placements = [p for j in mechanism.joints for p in (j.before, j.after)]
        placements += [f.placement for c in mechanism.loop_joints for f in (c.a, c.b)]
        lengths = [self.number(strut.length) for strut in mechanism.struts]
        lengths += [float(np.linalg.norm(self.pose(p)[:3, 3])) for p in placements]
        self.size = max(lengths)
        self.actuated = [c.moves for c in mechanism.coordinates]
        self.chain = [joint.name for joint in mechanism.main_chain.moving]
        self.joints = {j.name: j for j in mechanism.joints if j.kind != "fixed"}
        self.cylinders = {s.name: s for s in mechanism.struts if s.is_cylinder}
        self.loops = [Loop(self, loop_joint) for loop_joint in mechanism.loop_joints]

    def number(self, value: sp.Expr) -> float:
        return float(value.xreplace(self.given))

    def pose(self, placement: Placement) -> np.ndarray:
        """Return a placement as a matrix (4, 4)."""
        T = np.eye(4)
        for step in placement:
            M = np.eye(4)
            if isinstance(step, Translation):
                M[:3, 3] = [self.number(x) for x in step.vector]
            else:
                angle = self.number(step.angle)
                c, s = np.cos(angle), np.sin(angle)
                i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[step.axis]
                M[i, i], M[i, j], M[j, i], M[j, j] = c, -s, s, c
            T = T @ M
        return T

    def around(self, joint: Joint) -> tuple[Joint, np.ndarray, np.ndarray]:
        return joint, self.pose(joint.before), self.pose(joint.after)

    def units(self, names: Mapping[str, float]) -> dict[str, str]:
        """Return the unit (m or rad) of each joint or cylinder value, keyed by name."""
        slides = {j.name for j in self.joints.values() if j.kind == "prismatic"}
        return {n: "m" if n in slides or n in self.cylinders else "rad" for n in names}

    def scales(self, names: Sequence[str]) -> np.ndarray:
        """Return the scale of each variable: the mechanism size for lengths, and 1 for angles."""
        units = self.units(dict.fromkeys(names, 0.0))
        return np.array([self.size if units[name] == "m" else 1.0 for name in names])

    def wrapped(self, names: Sequence[str], difference: np.ndarray) -> np.ndarray:
        """Divide length differences (..., n) by the size, and wrap angle differences to
        -pi..pi."""
        scales = self.scales(names)
        turned = np.remainder(difference + np.pi, 2 * np.pi) - np.pi
        units = self.units(dict.fromkeys(names, 0.0))
        is_angle = np.array([units[name] == "rad" for name in names], dtype=bool)
        return np.where(is_angle, turned, difference / scales)

    def random_q(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Return random coordinates (count, n), with lengths scaled by the mechanism size."""
        columns = []
        for name in self.actuated:
            if name in self.cylinders:
                length = self.size * rng.uniform(0.1, 1.3, count)
                columns.append(length - self.number(self.cylinders[name].length))
            elif self.joints[name].kind == "prismatic":
                columns.append(self.size * rng.uniform(-1.2, 1.2, count))
            else:
                columns.append(rng.uniform(-np.pi, np.pi, count))
        return np.stack(columns, axis=-1)

    # --- modes ---

    def modes(self, known: np.ndarray, names: Sequence[str]) -> list[list[dict[str, float]]]:
        """Return all configurations of the mechanism for the known values of some joints.

        Args:
            known: (count, n) known values of joints and cylinders (radian or meter).
            names: Names of the joints and cylinders with known values.

        Returns:
            For each row of `known`, all assembly modes as joint and cylinder values keyed by name.
        """
        count = len(known)
        given = {name: known[:, k] for k, name in enumerate(names)}
        parts = [self._part(given, loops, count) for loops in self._parts(given)]
        found: list[list[dict[str, float]]] = []
        for row in range(count):
            fixed = {name: float(values[row]) for name, values in given.items()}
            short = any(
                fixed[n] + self.number(c.length) <= 0
                for n, c in self.cylinders.items()
                if n in fixed
            )
            if short or not self._holds(fixed):
                found.append([])
                continue
            combined = product(*(part[row] for part in parts))
            found.append([self._whole(fixed, choice) for choice in combined])
        return found

    def _whole(self, fixed: dict[str, float], choice: Sequence[Mapping[str, float]]) -> dict:
        values = dict(fixed)
        for part in choice:
            values |= part
        for loop in self.loops:
            name = loop.loop_joint.name
            if name in self.cylinders and name not in values:
                at = {n: np.array([v]) for n, v in values.items()}
                far = float(loop.distance(at, 1)[0])
                values[name] = far - self.number(self.cylinders[name].length)
        return values

    def _holding(self, given: Mapping[str, object]) -> list[Loop]:
        """Return the loops that have equations.

        A loop with a cylinder of unknown length has no equation.
        """
        return [
            loop
            for loop in self.loops
            if loop.loop_joint.name not in self.cylinders or loop.loop_joint.name in given
        ]

    def _holds(self, fixed: Mapping[str, float]) -> bool:
        """Test whether all loops without unknown joints are closed."""
        at = {name: np.array([value]) for name, value in fixed.items()}
        known = [loop for loop in self._holding(fixed) if loop.joints <= fixed.keys()]
        return all(np.abs(loop.residual(at, (), 1)[0]).max() < SAME for loop in known)

    def _parts(self, given: Mapping[str, object]) -> list[list[Loop]]:
        """Group the loops by shared unknown joints."""
        parts: list[tuple[set[str], list[Loop]]] = []
        for loop in self._holding(given):
            unknown = loop.joints - given.keys()
            if not unknown:
                continue
            met = [part for part in parts if part[0] & unknown]
            parts = [part for part in parts if part not in met]
            merged = unknown.union(*(part[0] for part in met))
            parts.append((merged, [*(one for part in met for one in part[1]), loop]))
        return [loops for _, loops in parts]

    def _part(
        self, given: Mapping[str, np.ndarray], loops: Sequence[Loop], count: int
    ) -> list[list[dict[str, float]]]:
        """Return all assembly modes of a group of loops for each row of known joint values."""
        unknown = sorted({name for loop in loops for name in loop.joints} - given.keys())
        rng = np.random.default_rng(0)
        found: list[np.ndarray] = [np.zeros((0, len(unknown))) for _ in range(count)]
        for round_ in range(ROUNDS):
            x = rng.uniform(-np.pi, np.pi, (count, STARTS, len(unknown)))
            rows = np.repeat(np.arange(count), STARTS)
            x, error = self._newton(given, loops, unknown, rows, x.reshape(len(rows), -1))
            new = False
            for row in range(count):
                for mode in x[(rows == row) & (error < CLOSED)]:
                    apart = np.abs(self._apart(unknown, found[row] - mode)).max(-1, initial=0)
                    if not (apart < SAME).any():
                        found[row], new = np.vstack([found[row], mode]), True
            if not new and round_:
                break
        scales = self.scales(unknown)
        return [
            [dict(zip(unknown, map(float, mode * scales), strict=True)) for mode in modes]
            for modes in found
        ]

    def _apart(self, names: Sequence[str], difference: np.ndarray) -> np.ndarray:
        return self.wrapped(names, difference * self.scales(names))

    def _newton(
        self,
        given: Mapping[str, np.ndarray],
        loops: Sequence[Loop],
        unknown: Sequence[str],
        rows: np.ndarray,
        x: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Run Newton's method from x (n, unknown), with lengths relative to the mechanism size."""
        error = np.full(len(x), np.inf)
        left = np.arange(len(x))
        eye = np.eye(len(unknown))
        polished = np.zeros(len(x), dtype=int)
        for _ in range(ITERATIONS):
            residual, J = self._equations(given, loops, unknown, rows[left], x[left])
            error[left] = np.abs(residual).max(-1)
            polished[left] += error[left] < CLOSED
            keep = polished[left] < 3
            left, residual, J = left[keep], residual[keep], J[keep]
            if not len(left):
                break
            square = np.einsum("nmi,nmj->nij", J, J)
            top = np.einsum("nmi,nm->ni", J, residual)
            damped = np.minimum(1e-3, (residual**2).sum(-1))[:, None, None] * eye + 1e-15 * eye
            step = np.linalg.solve(square + damped, -top[..., None])[..., 0]
            longest = np.abs(step).max(-1, keepdims=True)
            x[left] += step * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, 1e-300))
        angles = self.scales(unknown) == 1.0
        x[:, angles] = np.remainder(x[:, angles] + np.pi, 2 * np.pi) - np.pi
        return x, error

    def _equations(
        self,
        given: Mapping[str, np.ndarray],
        loops: Sequence[Loop],
        unknown: Sequence[str],
        rows: np.ndarray,
        x: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        values = {name: value[rows] for name, value in given.items()}
        scales = self.scales(unknown)
        values |= {name: x[:, k] * scales[k] for k, name in enumerate(unknown)}
        both = [loop.residual(values, unknown, len(x)) for loop in loops]
        return tuple(np.concatenate(part, axis=1) for part in zip(*both, strict=True))

    # --- tests of further configurations ---

    def gaps(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return each configuration's largest closure error (n,), relative to the mechanism size.

        `values` contains n values of every joint, keyed by name.
        """
        count = len(next(iter(values.values())))
        gaps = [np.abs(loop.residual(values, (), count)[0]).max(-1) for loop in self.loops]
        short = [
            np.where(values[name] + self.number(cylinder.length) > 0, 0.0, np.inf)
            for name, cylinder in self.cylinders.items()
        ]
        return np.max([*gaps, *short], axis=0)

    def residual(self, mode: Mapping[str, float], held: Sequence[str]) -> float:
        """Return the smallest closure error of Newton's method with some values fixed.

        Args:
            mode: A configuration (radian or meter) near a configuration with closed loops.
            held: Names of the joints and cylinders with fixed values.
        """
        given = {name: np.array([mode[name]]) for name in held}
        loops = self._holding(given)
        unknown = sorted({name for loop in loops for name in loop.joints} - given.keys())
        x = np.array([[mode[name] for name in unknown]]) / self.scales(unknown)
        best = np.inf
        for _ in range(6):
            rows = np.zeros(1, dtype=int)
            if not loops:
                return 0.0
            residual, J = self._equations(given, loops, unknown, rows, x)
            best = min(best, float(np.abs(residual).max()))
            if unknown:
                x = x - np.linalg.lstsq(J[0], residual[0], rcond=1e-12)[0]
        return best

    def strut_values(self, mode: Mapping[str, float]) -> dict[str, float]:
        """Return swing angles of struts with pin joints, in the frames of their start bodies."""
        found = {}
        for loop in self.loops:
            strut = loop.loop_joint
            if isinstance(strut, Closure) or strut.ends == "ball":
                continue
            T = [
                self.body(frame.body, mode) @ self.pose(frame.placement)
                for frame in (strut.a, strut.b)
            ]
            along = self.body(strut.a.body, mode)[:3, :3].T @ (T[1] - T[0])[:3, 3]
            found[strut.swing_name] = float(np.arctan2(along[1], along[0]))
        return found

    def body(self, name: str, mode: Mapping[str, float]) -> np.ndarray:
        """Return the pose (4, 4) of a body in the base frame."""
        T = np.eye(4)
        for joint in self.mechanism.path_to(name):
            _, before, after = self.around(joint)
            motion = _motion(joint, np.array([mode.get(joint.name, 0.0)]), 1)[0]
            T = T @ before @ motion @ after
        return T


def _motion(joint: Joint, value: np.ndarray, count: int) -> np.ndarray:
    M = np.zeros((count, 4, 4)) + np.eye(4)
    if joint.kind == "fixed":
        return M
    value = joint.direction * value
    if joint.kind == "prismatic":
        M[:, 2, 3] = value
    else:
        c, s = np.cos(value), np.sin(value)
        M[:, 0, 0], M[:, 0, 1], M[:, 1, 0], M[:, 1, 1] = c, -s, s, c
    return M
