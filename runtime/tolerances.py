"""Every tolerance of the Python runtime: name, value, unit and reason, by the package that uses it.

A length without a unit is in parts of the robot's unit of length (`size.py`). Tolerances of the
generated code stand in the manifest.
"""

# --- size ---

LEAST_SIZE = 1e-5
"""Least size of a robot as a part of its distance from the base's origin: SOLVED times it is still
a hundred times the rounding of such positions."""

# --- closed_form: solutions in slots ---

SOLVED = 1e-9
"""Residual (length, radian) up to which a slot holds a solution: far above the rounding that a
solution is left with, far below the error of a least-squares answer unless its pose is at the
border of reach."""
REFINED = 1e-4
"""Residual (length, radian) up to which a slot may be a solution spoilt by rounding: four solutions
of a quartic that are nearly one are known to the fourth root of rounding."""
TILTED = 1e-5
"""Residual (length, radian) up to which rounding may have tilted a pose out of those that an arm of
fewer than six joints reaches: poses with five printed digits."""
GIVEN_ASIDE = 1e-4
"""Radians or lengths by which a given joint is moved aside from a value at which the structure of
the others degenerates: their formulas have 1e-12 there, and Newton's iteration comes back."""
GIVEN_NEAR = 1e-2
"""Residual (length, radian) up to which an answer for that value leads to a solution: the step
aside, times the growth of a residual near a singularity."""
AT_REST = 1e-7
"""Residual (length, radian) up to which a motion of the joints may leave the tool at rest all the
way: where it moves the tool by less, the damping keeps the steps of the iteration too short."""
AT_REST_RATE = 1e-3
"""Singular value (length or radian per unit of a coordinate) below which a direction of the joints
may belong to a motion at rest, whose rate is some 1e-7. Iteration ends 1e-5 from the border of
reach, where the rate is as small."""
AT_REST_BEND = 1e-3
"""Second derivative (length or radian per squared unit of a coordinate) of the tool's pose along
such a direction from which no motion is at rest: the tool is off by 1e-4 where a joint is held at
the nearest value, a thousand times AT_REST."""
BEND_STEP = 1e-3
"""Radians or lengths of the differences that give it: rounding leaves 1e-9 of it, and the fourth
derivative 1e-6."""
SADDLE = 1e-3
"""Part of the error by which a coordinate may change it where iteration stands still: damped steps
come near to a saddle, but not onto it."""
SADDLE_BEND = 1e-3
"""Second derivative of the tool's pose towards its target (length or radian per squared unit of a
coordinate) with which the squared error falls on both sides of a saddle."""
SADDLE_STEP = 1e-5
"""Radians or lengths of the differences that give it: rounding leaves 1e-11 of the second
derivatives of the squared error, and its fourth derivatives as much."""
SAME_SOLUTION = 1e-6
"""Lengths or radians up to which two slots hold the same solution: at a singularity two branches
meet, and each is known to 1e-8 there."""
AT_LIMIT = 1e-12
"""Lengths or radians by which rounding may put a joint outside a limit that it is at."""
FAR = 50.0
"""Residual (length) from which a message asks for the unit of a translation: millimetres for metres
are a thousand times too far."""
JUMP = 0.5
"""Lengths or radians that a joint may move from a pose of a path to the next. Branches are a radian
apart and more, except near the singularities where they meet; a path on which a joint needs more
than this is too coarse to tell a fast joint from a change of branch."""

SELF_MOTION_STEP = 1e-9
"""Radians or metres between samples of a redundancy parameter at which a search along the
self-motion ends, as exact as a solution: distances have a kink at their minimum."""

# --- closed_form: loops ---

SAME_JOINTS = 1e-6
"""Metres or radians below which joints of the main chain are the same: near a dead point, at a
margin of 1e-10, the rounding of the lengths makes half of the digits uncertain."""
# --- closed_form: Newton's iteration on forward kinematics ---

POLISHED = 1e-14
"""Residual (metre, radian) at which an iteration has nothing left to gain."""
SETTLED = 1e-12
"""Residual (metre, radian) at which a step without gain is the last."""
MOST_DAMPING = 1e6
"""Factor between lambda^2 and the squared error above which even the smallest steps lead nowhere:
the least residual nearby is reached."""
LEAST_DAMPING = 1e-14
"""Least lambda^2: J J^T is known to 1e-16, and may be singular."""
POLISH_STEP = 0.3
"""Metres or radians that a coordinate may move in a step: further away lies another branch."""

# --- iterative: continuation of loops ---

CLOSED = 1e-12
"""Residual of the constraint (metre, radian) up to which a configuration is valid."""

# --- iterative: inverse of a pose ---


# --- velocity ---

TURNS = 1e-6
"""Radians per metre at the tip below which a coordinate does not turn the tool."""
RANK = 1e-9
"""Ratio to the largest singular value below which a singular value is zero."""
SINGULAR = 1e-6
"""Singular value of the pure velocity relation up to which a parallel robot is singular: rounding
of a pose at a singularity of type 1 leaves the root of 1e-13."""
INFINITE_CONDITION = RANK**2
"""Ratio of the smallest to the largest singular value below which the condition number is
infinite."""
TRACK_GAIN = 0.5
"""Share of the error that a step of `track` corrects by default. At 1 a step would go all the way
to the linear answer, beyond 2 the error would grow."""

# --- poses and screws ---

NO_ROTATION = 0.3
"""Deviation (radian) of a matrix from a rotation from which projecting it is no advice: the nearest
rotation would be a guess."""

SERIES = 0.25
"""Radians below which quotients with a vanishing denominator are summed as series; the first term
left out is below rounding there."""
