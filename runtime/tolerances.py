"""All tolerances of the Python runtime with value, unit and reason, by package.

Lengths without a unit are relative to the unit length of the robot (`size.py`). The manifest has
the tolerances of the generated code.
"""

# --- size ---

MIN_SIZE = 1e-5
"""Minimum ratio of the robot size to its distance from the base origin."""

# --- closed form: solutions in slots ---

SOLVED = 1e-9
"""Maximum residual (length, radian) of a solution: far above rounding errors, far below
least-squares residuals of unreachable poses."""
REFINED = 1e-3
"""Newton's method refines solutions with a residual of at most this length or angle. Rounding can
change four nearly equal roots of a quartic by several times 1.2e-4, the fourth root of the rounding
error."""
TILTED = 1e-5
"""Maximum residual (length, radian) that rounding the pose to five digits can explain, for arms
with fewer than six joints."""
GIVEN_ASIDE = 1e-4
"""Offset [rad or length] of a fixed joint from a value at which the structure of the other joints
degenerates."""
GIVEN_NEAR = 1e-2
"""Maximum residual (length, radian) of the solution slots from which Newton's method starts."""
AT_REST = 1e-7
"""Maximum tool error (length, radian) of a configuration on a self-motion. Damping shortens the
Newton steps, so that Newton's method does not reach smaller errors."""
AT_REST_RATE = 1e-3
"""Maximum singular value (length or radian per coordinate unit) of a direction that may be a
self-motion. At a self-motion, the singular value is about 1e-7."""
AT_REST_BEND = 1e-3
"""Minimum second derivative of the pose along a null direction that is not a self-motion."""
BEND_STEP = 1e-3
"""Finite-difference step [rad or length] for the second derivative of the tool pose. The relative
errors of the second derivative are 1e-9 from rounding and 1e-6 from truncation."""
SADDLE = 1e-3
"""Maximum gradient of f = |e|^2 / 2 at a stationary point, relative to the error |e|."""
SADDLE_BEND = 1e-3
"""Minimum second derivative of the pose at a saddle (length or radian per squared coordinate unit).
"""
SADDLE_STEP = 1e-5
"""Finite-difference step [rad or length] for the Hessian of the squared error. The relative errors
from rounding and from truncation are both 1e-11."""
SAME_SOLUTION = 1e-6
"""Maximum difference (length, radian) between equal solutions."""
AT_LIMIT = 1e-12
"""Maximum limit violation (length, radian) that counts as rounding."""
FAR = 50.0
"""Residual (length) above which a message suggests that a unit is wrong, such as mm instead of m.
"""
JUMP = 0.5
"""Maximum joint motion (length, radian) between poses of a path. A larger motion may be a change of
branch."""
SELF_MOTION_STEP = 1e-9
"""Final sampling step [rad or m] of a search along the self-motion. The distance from a seed is not
differentiable at its minimum, so the search result is only as accurate as this step."""
SELF_MOTION_GAP = 1e-7
"""Minimum distance [rad or m] between adjacent samples of a self-motion."""
SELF_MOTION_MOVE = 0.25
"""Maximum joint motion (length, radian) between samples of a self-motion: near a singularity, a
small change of the swivel angle rotates joints by up to pi."""

# --- closed form: closure of loops ---

SAME_JOINTS = 1e-6
"""Maximum difference (meter, radian) at which main-chain joint values count as equal. At a dead
point, rounding affects half of the digits."""

# --- closed_form: Newton's iteration on forward kinematics ---

POLISHED = 1e-14
"""Residual (meter, radian) at which the iteration ends."""
SETTLED = 1e-12
"""Below this residual (meter, radian), a step without improvement ends the iteration."""
MAX_DAMPING = 1e6
"""Maximum ratio of the damping lambda^2 to the squared error. If the ratio is larger, the steps are
too short to reduce the error, and the iteration ends."""
MIN_DAMPING = 1e-14
"""Minimum lambda^2. This value exceeds the rounding error 1e-16 of J J^T, because J J^T may be
singular."""
POLISH_STEP = 0.3
"""Maximum step of a coordinate [m or rad]; a longer step could reach a different branch."""

# --- iterative ---

CLOSED = 1e-12
"""Maximum constraint residual (meter, radian) of a valid loop configuration."""

# --- velocity ---

TURNS = 1e-6
"""A coordinate rotates the tool if the ratio of the tip's angular rate to its linear rate [rad/m]
exceeds this value."""
RANK = 1e-9
"""Singular values below this fraction of the largest singular value count as zero."""
SINGULAR = 1e-6
"""Maximum singular value of J_x or J_q at a parallel singularity. At a type-1 singularity, the
singular value of a rounded pose is about the square root of 1e-13."""
INFINITE_CONDITION = RANK**2
"""Below this ratio of smallest to largest singular value, the condition number is infinite."""
TRACK_GAIN = 0.5
"""Default fraction of the linearized tool error that a step of `track` corrects."""

# --- poses, twists and screws ---

NO_ROTATION = 0.3
"""A matrix is not projected to a pose if its deviation from a rotation [rad] exceeds this value."""
SERIES = 0.25
"""Angle [rad] below which quotients such as sin x / x are computed from their power series."""
