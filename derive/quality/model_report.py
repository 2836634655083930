"""Quality of a robot's model for calibration: complete, continuous, minimal.

A model is complete if the parameters can displace every axis in every direction. A model is
continuous if small axis displacements need only small parameter changes. A model is minimal if no
parameter is redundant.

Source:
    K. Schroeer, S. Albright, M. Grethlein, Complete, minimal and model-continuous kinematic models
    for robot calibration, Robotics and Computer-Integrated Manufacturing 13 (1997); Closed chain
    cascade manipulator with an improved kinematic model, Mathematical Problems in Engineering, 3.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ..description.conventions import CONVENTIONS
from ..description.conventions.axis_maps import Motions, axis_map, field_values, free_of
from ..description.conventions.neighbours import Neighbours, least_singular_value, neighbours
from ..description.conventions.suited import suitable_conventions, with_suitable_conventions
from ..loops.freedoms import virtual_joints
from ..model.convention import Convention
from ..model.errors import DescriptionError
from ..model.geometry import geometry
from ..model.mechanism import Described, Mechanism
from ..model.robot import SerialRobot
from ..model.tolerances import ZERO_SINGULAR_VALUE
from ..terms.terms import Terms
from .determinants import completed_determinant, determinant
from .missed import missed
from .own_numbers import own_displacements
from .quality_report import ConventionQuality, JointQuality, ModelReport

POSES = 60
"""Number of random configurations for the rank."""


def model_report(
    description: Described,
    *,
    conventions: Sequence[Convention] = CONVENTIONS,
    rng: int | np.random.Generator | None = 0,
) -> ModelReport:
    """Reports which conventions describe each joint completely, continuously and minimally.

    Args:
        description: A serial robot, or a robot with loops, whose main chain is evaluated.
        conventions: The conventions to compare; conventions that cannot place an axis are omitted.
        rng: Random numbers for the configurations at which the rank is computed: a seed, a
            generator, or None for fresh entropy.

    Raises:
        DescriptionError: Legs support the tool, so that no chain of joints can be evaluated.
    """
    chain = _chain(description)
    fitting = [convention for convention in conventions if convention.fit]
    kinds = [joint.kind for joint in chain.moving]
    suits = suitable_conventions(chain)
    return ModelReport(
        description.title or description.name,
        tuple(
            _joint(pair, own_displacements(chain, pair), placed, suit.name, fitting)
            for pair, (placed, suit) in zip(neighbours(chain)[1:], suits[1:], strict=True)
        ),
        sum(kind != "prismatic" for kind in kinds),
        kinds.count("prismatic"),
        kinds.count("helical"),
        *_rank(chain, rng),
        *_rank(with_suitable_conventions(chain), rng),
    )


def _chain(robot: Described) -> SerialRobot:
    if not isinstance(robot, Mechanism):
        return replace(robot, load=None)
    terms = Terms({parameter.symbol: parameter.value for parameter in robot.parameters})
    free = {joint.name for run in virtual_joints(robot, terms) for joint in run}
    if any(joint.name in free for joint in robot.main_chain.joints):
        raise DescriptionError(f"{robot.name}: legs carry its tool; expected a chain of joints")
    return robot.main_chain


def _joint(
    pair: Neighbours,
    own: NDArray[np.float64],
    placed: Neighbours,
    suits: str,
    conventions: Sequence[Convention],
) -> JointQuality:
    return JointQuality(
        pair.joint.name,
        pair.joint.kind,
        pair.before.name if pair.before else "",
        pair.angle,
        pair.distance if pair.is_of_lines else 0.0,
        tuple(
            dict.fromkeys(
                joint.convention.name
                for joint in (pair.before, pair.joint)
                if joint and joint.convention
            )
        ),
        missed(own, pair.words),
        tuple(_quality(placed, convention) for convention in conventions),
        suits,
    )


def _quality(pair: Neighbours, convention: Convention) -> ConventionQuality:
    kind = pair.joint.kind
    link = axis_map(convention, kind)
    fit, rows = pair.fit(convention), pair.displacements(convention)
    completed = completed_determinant(convention, kind)
    value = None
    if fit is not None:
        known = field_values(fit)
        value = float(completed.xreplace({s: known.get(s.name, sp.S.Zero) for s in link.symbols}))
    return ConventionQuality(
        convention.name,
        tuple(symbol.name for symbol in link.own),
        len(free_of(kind)),
        determinant(convention, kind),
        completed,
        value,
        least_singular_value(rows),
        () if rows is None else missed(rows, pair.words),
    )


def _rank(robot: SerialRobot, rng: int | np.random.Generator | None) -> tuple[int, int]:
    """Returns the number of parameters in the robot's own model, and the rank."""
    q = sp.symbols(f"q1:{len(robot.coordinates) + 1}", real=True)
    found = geometry(robot, q)
    own = [
        k for k, item in enumerate(found.parameters) if item.part not in ("axis", "transmission")
    ]
    symbols = [item.symbol for item in found.parameters]
    nominal = [float(item.value) for item in found.parameters]
    motions = Motions(found.motions, [*q, *symbols])
    random = np.random.default_rng(rng)
    J = np.concatenate(
        [motions([*at, *nominal])[0][:, len(q) :] for at in random.uniform(-2, 2, (POSES, len(q)))]
    )[:, own]
    return len(own), _rank_of(J)


def _rank_of(J: NDArray[np.float64]) -> int:
    size = np.linalg.norm(J, axis=0)
    # The column of a parameter without effect may be nonzero because of rounding errors.
    moving = size > ZERO_SINGULAR_VALUE * size.max()
    values = np.linalg.svd(J[:, moving] / size[moving], compute_uv=False)
    return int(np.sum(values > ZERO_SINGULAR_VALUE * values[0]))
