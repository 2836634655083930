"""Detects loops that narrowly miss the conditions of a closed-form solution, as on a real robot.

The module checks the conditions of two closed-form solutions. The first solution applies to a
platform that only translates, because pairs of equal, parallel rods guide it. The second solution
applies to a planar loop, whose joint axes are parallel. If a loop meets neither condition exactly,
Newton's method must close the loop. If the geometry of a loop almost fulfills the conditions of a
closed-form solution, the report states the remaining difference.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...model.mechanism import Closure, Strut
from ...model.tolerances import MEASURED_STRUCTURE, NOISE, SAMPLED_RANGE
from ..closing.tilted_pins import tilt_of
from ..planar.reference import AtReference
from ..solve.solved_loops import SolvedLoops
from ..spatial.struts import Known, Legs
from ..spatial.three_spheres import SPHERES, spheres_of

Floats = NDArray[np.float64]
TWO = 2
"""Minimum number of revolute joints in a loop for the test of parallel axes, not counting the joint
that closes the loop."""


def nearly_met(h: SolvedLoops) -> Iterator[str]:
    """Yield a sentence for each closed-form solution whose conditions the loops almost fulfill."""
    if h.forward.open:
        yield from _parallel_rods(h)
        yield from _planes(h)


def _parallel_rods(h: SolvedLoops) -> Iterator[str]:
    """Yield a sentence about a platform whose rods are nearly parallel in pairs."""
    struts = [
        loop.loop_joint
        for loop in h.loops.spatial
        if isinstance(loop.loop_joint, Strut) and loop.loop_joint.ends == "ball"
    ]
    known = Known(dict(h.forward.values), {}, [])
    legs = Legs(h.terms, h.mechanism, known, h.forward.reference, None)
    spheres = spheres_of(legs, struts)
    entries = [(*sphere.center, sphere.square) for sphere in spheres]
    size = h.forward.reference.size
    numbers = np.array([[[at.of(e) for e in of] for of in entries] for at in _around(h)])
    if len(spheres) <= SPHERES or not np.isfinite(numbers).all():
        return
    numbers[..., 3] = np.sqrt(numbers[..., 3])
    groups = _groups(numbers, MEASURED_STRUCTURE * size)
    if len(groups) != SPHERES:
        return
    off = {
        " and ".join(repr(struts[k].name) for k in group): max(
            (_apart(numbers, a, b) for a, b in combinations(group, 2)), default=0.0
        )
        for group in groups
    }
    missing = [f"{names} by {1000 * by:.3g} mm" for names, by in off.items() if by > NOISE * size]
    # No sentence is yielded if the rods of each group are already equal and parallel, because other
    # loops then prevent the closed-form solution.
    if missing:
        yield (
            "the loops would have a closed form (three spheres) if these rods were equal and "
            f"parallel; they differ: {', '.join(missing)}"
        )


def _around(h: SolvedLoops) -> Iterator[AtReference]:
    """Yield the reference configuration and two configurations near it.

    In one nearby configuration, all actuated coordinates are larger than at the reference. In the
    other nearby configuration, all actuated coordinates are smaller than at the reference.
    """
    own, terms = h.forward.reference, h.terms
    for part in (0.0, SAMPLED_RANGE, -SAMPLED_RANGE):
        steps = [own.size if c.unit == "m" else 1.0 for c in h.mechanism.coordinates]
        values = {s: own.of(s) + part * step for s, step in zip(h.q, steps, strict=True)}
        yield AtReference(terms, values, {}, size=own.size)


def _groups(numbers: Floats, most: float) -> list[list[int]]:
    """Group the indices of rods whose fitted spheres are nearly equal."""
    groups: list[list[int]] = []
    for k in range(numbers.shape[1]):
        near = [group for group in groups if _apart(numbers, group[0], k) <= most]
        if near:
            near[0].append(k)
        else:
            groups.append([k])
    return groups


def _apart(numbers: Floats, a: int, b: int) -> float:
    """Return the largest center distance or radius difference of two spheres (meter)."""
    off = numbers[:, a] - numbers[:, b]
    return float(max(np.linalg.norm(off[:, :3], axis=-1).max(), np.abs(off[:, 3]).max()))


def _planes(h: SolvedLoops) -> Iterator[str]:
    """Yield messages about nearly planar loops."""
    for loop in h.loops.spatial:
        turning = [joint for joint in loop.joints if joint.kind == "revolute"]
        is_pin = isinstance(loop.loop_joint, Closure) and loop.loop_joint.kind == "pin"
        if len(turning) < TWO or not is_pin:
            continue
        tilt = tilt_of(h.mechanism, h.terms, loop)
        if tilt.is_small:
            yield (
                f"the loop of {tilt.loop_joint!r} would be planar and have a closed form if"
                f" its axes were parallel and its ends in one plane: {tilt}"
            )
