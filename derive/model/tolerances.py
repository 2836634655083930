"""The tolerances of the compiler, with units and reasons, grouped by folder.

Lengths without a stated unit are relative to the characteristic length of the robot. Other
constants, such as numbers of steps, are defined in the modules that use them.
"""

import sympy as sp

# --- all folders: high-precision numbers ---

EVALUATION_DIGITS = 40
"""Decimal digits of evaluated constants. A double has 16 digits. With 40 digits, rounding does not
affect comparisons with integers and multiples of pi."""
WORKING_DIGITS = EVALUATION_DIGITS + 20
"""Decimal digits of intermediate results in constant expressions. A few of these digits are lost if
constants are computed from other constants, but the 40 digits of the result are correct."""
RELIABLE_DIGITS = EVALUATION_DIGITS - 8
"""Number of correct decimal digits of a long constant."""
ROUNDING = 10.0**-RELIABLE_DIGITS
"""A constant counts as an integer if their difference is at most this value (no unit)."""

MAX_WAVES = 0.05
"""Maximum amplitude of a periodic drive error (radian), relative to the drive gain. For ratios up
to 0.05, three Newton steps invert the drive equation up to rounding errors. Real drives have ratios
below 0.001."""
MAX_SAG = 0.05
"""Maximum derivative of a joint deflection with respect to the coordinates. Each fixed-point step
of the spring equation multiplies the error by at most 0.05. Twelve steps invert the spring equation
up to rounding errors."""

# --- description: rounding in files ---

NOISE = 1e-9
"""Maximum noise of a number in a file. For lengths and directions, the noise is relative to the
longest length or to the largest component. For angles, the noise is in radians. An angle of 1e-9
rad moves a tool at 1 m by 1 nm."""
LARGE_CLEANING = 5e-4
"""Noise removal that moves the tool by more than this distance (meter) causes a warning."""
NOISE_GAP = 1000
"""A number counts as a rounded decimal only if its deviation from the decimal is at most 1 /
NOISE_GAP units of the last decimal place."""
CONTINUOUS_MODEL = 0.02
"""A parametrization counts as continuous if every parameter change of norm 1 displaces the axis by
more than this value. The displacement is in radians, or relative to the arm length."""
DOUBLE = 1e-15
"""Maximum relative difference (no unit) between a decimal and its double. A relative difference of
1e-15 corresponds to 15 digits."""
SINGLE = 2.0**-23
"""Maximum relative rounding error of a single-precision number (no unit). SINGLE is one unit in the
last place, because a computation may round twice."""
ANGLE_SNAP = NOISE
"""Maximum difference (radian) between an angle in a file and the multiple of pi/12 that replaces
it, for any number of digits."""
CHANCE = 0.01
"""Maximum probability that an angle matches a multiple of an angle step by chance. For example,
1.57 counts as a right angle, but 0.79 does not count as 45 degrees."""
LONGEST_LENGTH = 20.0
"""Maximum plausible length (meter) in a file that states no unit. Links of arms are shorter than 10
m."""
SHORTEST_ARM = 1e-3
"""Minimum plausible size of an arm (meter). Desktop arms are about 0.1 m long."""
LARGEST_ANGLE = 6.5
"""Maximum plausible angle (radian) in a file that states no unit."""
MAX_TURNED = 45.0
"""Maximum plausible joint limit (radian), which is seven turns. A joint limit above 45 may be in
degrees."""
UNLIMITED = 10_000
"""Joint ranges of at least this width, or limits of at least this magnitude, count as unlimited
(radian or meter). Some programs write limits of 1e4 to 1e16 for unlimited joints, because the file
format requires limits."""
AXIS_DIGITS = 25
"""Decimal digits of axis angles without a short exact form. Rounding an angle to 25 decimal digits
changes the angle by far less than the rounding error of a double."""
SHORT_PROPORTION = 1000
"""If the components of a direction are proportional to integers up to this value, the axis angles
are exact expressions."""
GIMBAL_LOCK = 1e-14
"""At gimbal lock, two components of a unit vector or quaternion are at most this value (no unit).
Rounding errors are 1e-16."""
COMPILED_DECIMALS = 14
"""Numbers that a program computed are rounded to this number of decimal places (meter, radian)."""
SAME_EQUATION = 1e-9
"""Maximum difference between two equations that state the same relation between joints. The
difference of the constants is in radians or meters. Other differences are relative. Compiled ratios
have 14 decimal places, so the reciprocal of a ratio of 0.001 has a relative error of 1e-11."""
PARALLEL_GEARS = 1e-6
"""A gearbox axis and a joint axis are parallel if the magnitude of the cosine of their angle
differs from 1 by at most this value. Directions in files have at least four digits."""
COMPILED_ANGLE = 1e-13
"""Maximum difference (radian) between a computed angle and the angle in a file. Rounding errors of
angles near pi are a few times smaller than 1e-13 rad."""
CALIBRATED_TOOL = 0.05
"""Maximum displacement of the tool by a factory calibration, with all joints at zero.
CALIBRATED_TOOL limits the tool distance (meter) and the norm of the difference of the rotation
matrices. A calibration for another type of robot moves the tool by 80 mm or more."""
LENGTH_SCALING = 1e-10
"""Maximum deviation (m or rad) of a length from a linear function of the named lengths, and of an
angle from a constant."""

# --- numbers that count as integers ---

MEANT = 1e-100
"""A nonzero constant below this magnitude (no unit) is not a rounding error, so it is not replaced
by 0. Rounding errors of numbers near 1 are at least 1e-40. So a constant of 1e-150 comes from the
robot file, not from rounding."""
UNIT_VECTOR = 1e-12
"""Maximum difference between 1 and the squared length of a unit vector (no unit). Rounding
errors are about 1e-15. An exact vector must have exactly the length 1."""

# --- loops: closures, ranks, branches ---

BRANCHES_APART = 1e-6
"""Two branches are equally near the reference if their distances from the reference differ by at
most this value. Near a dead point, rounding errors are about 1e-8. Reference configurations in
files have three digits."""
OFF_BRANCH = 1e-6
"""Maximum closure error on an existing branch (radian, or relative to the mechanism size). Near a
dead point, rounding errors grow to about 1e-8. If a joint is not on an existing branch, its closure
error is about as large as the links."""
LOOPS_AGREE = 1e-6
"""Maximum loop residual for which a set of given joint values counts as consistent with the loops.
The residual is a length relative to the robot size, or a cosine. If values are inconsistent because
they were set by hand, residuals exceed this value by far. If the main chain has redundant joints,
even consistent values have residuals of about 1e-8 near a dead point."""
OFF_AXIS = 1e-12
"""Maximum squared distance from an axis for a point that counts as on the axis (m^2)."""
ZERO_COMPONENT = 1e-25
"""Maximum vector component that counts as zero (no unit, or meter between points). Components are
evaluated with 40 digits, so 15 digits remain for rounding errors."""
CLOSED_LOOP = 1e-12
"""Maximum residual of a closed loop in double precision (meter, or sine of an angle)."""
NEARLY_DEAD = 1e-3
"""Loops of pin joints are solved last if sin^2 of the transmission angle at the reference is below
this value. Such loops are near a dead point."""
CLEAR_LEG = 0.25
"""Minimum sin^2 of the transmission angle for a leg whose equation determines a joint. If sin^2 is
below this value, the equation of another leg determines the joint. The value 0.25 corresponds to a
transmission angle of 30 degrees."""
VANISHED = 1e-12
"""Relative to the longest vector, a computed vector below this length may be exactly zero. An exact
test then decides whether the vector is zero. Rounding errors are 1e-16."""
FOUND_LOOP = 1e-10
"""Maximum residual (meter, or sine of an angle) at which an implicit CasADi function counts as
converged. The last step of Newton's method is 1e-14."""
ZERO_SINGULAR_VALUE = 1e-9
"""Singular values below this fraction of the largest singular value count as zero (no unit).
Rounding errors of a Jacobian are about 1e-15. Away from singularities, the smallest singular value
is about 1e-3 of the largest."""
REPEATED_EQUATION = 1e-4
"""Bound for singular values of redundant equations in nearly closed loops, relative to the largest
singular value. At a residual of 1e-12, a configuration may be 1e-6 from closure. At a distance of
1e-6 from closure, redundant equations seem to be independent."""
STILL_JOINT = 1e-6
"""Maximum change of the value of a joint that counts as immovable. The change is in radians, or
relative to the robot size."""
REPEATED_AS_BUILT = 0.02
"""Bound for singular values of redundant equations in real robots. Slightly tilted axes make
redundant equations seem independent. If axes are 2 mrad out of parallel, the singular value of a
redundant equation is about 0.002."""
WORTHWHILE_STEP = 0.9
"""Maximum fraction of the residual that remains after a full Newton step. If the remaining fraction
exceeds this value, the Newton step is shortened."""
SAMPLED_RANGE = 0.3
"""Maximum offset from the reference configuration (radian, or relative to robot size)."""
NEIGHBOURHOOD = 0.02
"""Maximum offset of joint values from the reference (radian, or relative to the size). From each
offset configuration, Newton's method closes the loops.

At larger offsets, Newton's method may find another assembly mode with other degrees of freedom. A
singular value may be 0 at the reference only. If this singular value grows with the square of the
offset, it is 4e-4 at the offset 0.02 and counts as nonzero."""
NUMERICALLY_CLOSED = 1e-7
"""Maximum closure error (radian, or relative to the size) of a closed loop in a numerical search.
At a dead point, the closure error grows quadratically with the motion, and angles are accurate to
3e-4 rad only."""
DIFFERENCE_STEP = 1e-6
"""Step of central differences in a numerical search (radian, or relative to the robot size). The
truncation error is about the square of the step. The rounding error of the difference quotient is
the rounding error of a double, divided by the step. Both errors are below 1e-9."""
WORTHWHILE_GAIN = 1e-5
"""Minimum relative decrease of the squared closure error (no unit) per step of a minimization."""
CLOSING_GAIN = 3e-3
"""Minimum relative decrease of the squared closure error (no unit) per step of a search for closed
loops. If each of eighty steps decreases the squared error by less than this fraction, at least
three quarters of the squared error remain."""
SAME_POINT = 1e-9
"""Points of a drawing are equal if their distance is at most this value (meter; no unit for
directions). Closed loops have errors of 1e-12. In a drawing, the eye resolves 1e-4 of the size of a
robot."""
MOVED_REFERENCE = 0.3
"""A joint value in a file is reported if it differs from the closed reference by more than this
value (radian, or relative to the robot size). Joint values that an author estimates have errors of
about 10 degrees."""
PIN_ACROSS = 0.1
"""A pin and its strut count as perpendicular if the cosine of the angle between them is at most
this value. If a strut frame defines only a point, the orientation of the frame is arbitrary."""
SAME_VIEW = 1e-6
"""Maximum angle (radian) between parallel directions in a drawing."""
LAYOUT_TIE = 1e-5
"""A value is rounded up if its fractional part is at least 0.5 minus this tolerance (in units of
0.1 mm). The last digits of computed values differ between machines, but the drawing file must be
identical on all machines."""
DRAWN_AS_ONE = 1e-6
"""Maximum distance between two points of a body that are drawn as one point (relative to the size).
Placements have rounding errors of 1e-15."""
DRAWN_DIGITS = 9
"""Decimal places of a drawn point (relative to the size) and of a direction (no unit)."""

# --- loops: homotopy paths of complex poses in Study coordinates ---

PATH_NEAR = 1e-4
PATH_ON = 1e-7
"""Maximum sizes of the first and second Newton corrections after each step along a path."""
SHORTEST_PATH_STEP = 1e-9
"""Minimum step of the path parameter, which grows from 0 to 1 along a path. A path that requires a
shorter step leads to a singular pose or to infinity, so path tracking stops."""
POSES_ARE_ONE = 1e-8
"""Two poses x and y count as equal if 1 - |<x, y>| is at most this value."""
SINGULAR_POSE = 1e11
"""Maximum condition number of a regular pose of generic rods."""
POSE_AT_INFINITY = 1e-10
"""If |e.e| of the quaternion e is at most this value, the Study coordinates are a pose at infinity.
"""
NO_FRAME = 1e-9
"""Maximum distance (meter) from the origin at which a centroid counts as the origin."""
RODS_SPAN = 1e-9
"""Threshold for the singular values of sampled rod endpoints and rod lengths. A smaller singular
value, relative to the largest singular value, counts as zero."""

# --- inverse: structures, boundaries of subproblems, determinants ---

EXACT_STRUCTURE = 1e-9
"""Maximum deviation (radian, or relative to the arm length) of axes with an exact closed-form
structure. Decimals in a file are read exactly, so only rounding errors of the numerical test
remain."""
MEASURED_STRUCTURE = 5e-3
"""Maximum deviation (radian, or relative to the arm length) of measured axes from the closed-form
structure of the design. A measured arm deviates from its design by a few millimeters per meter and
a few milliradians."""
NEARLY_STRUCTURE = 3e-2
"""Maximum deviation (radian, or relative to the arm length) between an arm and its nominal arm. The
nominal arm is used if Newton's method leads from the solutions of the nominal arm to the solutions
of the true arm. If the axes deviate by more than 3e-2, Newton's method rarely converges."""
MIN_CONVERGED = 0.9
"""Minimum fraction of random configurations that Newton's method must recover from the solutions of
a nominal arm. About one configuration in ten is near a singularity."""
CONVERGENCE_UNLIKELY = 0.85
CONVERGENCE_CLEAR = 0.95
"""Limits for the fraction of configurations that Newton's method recovers from the nearest nominal
solution. Below the first limit, the nominal arm is not used. The limit MIN_CONVERGED is not checked
if the recovered fraction reaches CONVERGENCE_CLEAR and the fraction of nearby configurations
reaches MIN_NEARBY."""
MIN_NEARBY = 0.5
"""Minimum fraction of random configurations of the true arm that are near a solution of the nominal
arm. The fraction is 0 if the nominal inverse and the true inverse have different branches."""
RECOVERED = 1e-6
"""Maximum distance (radian, or relative to the arm length) of a recovered configuration. Away
from singularities, the error after eight steps is 1e-14."""
MAX_REFINING_STEP = 0.3
"""Maximum change of a coordinate per Newton step (meter or radian). If a step exceeds this value,
Newton's method may find a solution on another branch."""
LOST = 1e-5
"""Maximum error (radian or meter) of a pose that counts as reached. For an arm shorter than 1 m,
the maximum is multiplied by the arm length in meters. Errors below 1e-5 may be rounding errors, and
are refined at run time."""
JACOBIAN_RANK = 1e-9
"""Maximum singular value of the Jacobian that counts as zero. Lengths are relative to the arm."""
OBLIQUE_AXES = 1e-3
"""Minimum sine of the angle between directions that are not parallel."""
TOOL_ON_AXIS = EXACT_STRUCTURE
"""Maximum distance (meter) between tool and joint axis, or tool and base plane, that counts as
zero. The same limit applies to the sine of the angle between the tool axis and a joint axis, the
arm plane or the base plane."""
INDEPENDENT_SLIDES = EXACT_STRUCTURE
"""Unit vectors count as linearly dependent if the smallest singular value of their matrix is at
most this value."""
UNDETERMINED_SUM = sp.Float("5e-10", 20)
"""Maximum sine of the angle between parallel directions. If parallel directions do not determine a
joint angle, the angle is set such that the other joints can reach the pose. For prismatic joints,
directions are perpendicular if the cosine of their angle is at most UNDETERMINED_SUM."""
UNDETERMINED_TURN = sp.Float("2e-10", 20)
"""Maximum distance (meter) from an axis at which a point is treated as a point of the axis."""
ALIGNED_AXES = sp.Float("1e-8", 20)
"""Maximum sine of the angle between aligned axes."""
DIRECTION_FLOOR = sp.Float("1e-150", 20)
"""Number that is added to the first component of a computed direction, and to divisors that may be
0. In double precision, the addition does not change numbers above 1e-134. The square of this
number, 1e-300, does not underflow. The direction of (0, 0) becomes the angle 0 instead of 0/0."""
VECTOR_FLOOR = sp.Float("1e-140", 20)
"""Factor of a replacement vector. If a computed vector may be 0, this factor times the replacement
vector is added before the computed vector is divided by its length. In double precision, the
addition changes the direction only if the computed vector is almost 0."""
GREATEST_NUMBER = 1e300
"""Inputs count as finite if the sum of their magnitudes is at most this value (meter or no unit).
"""
DIVISOR_FLOOR = sp.Float("1e-300", 20)
"""Positive number that is added to a divisor that may be 0. The divisor is a sum of squares."""
ARTICLE_ZERO = 1e-100
"""Minimum magnitude of a nonzero number that the LaTeX article prints. The LaTeX article omits
constants below 1e-100, which only prevent errors such as a division by zero."""
MEETING_SOLUTIONS = sp.Float("4e-15", 20)
"""Maximum sin^2 of half the angle between solutions that coincide. Rounding errors change sin^2 by
about 1e-16, relative to the terms in its formula. If a solution were moved by 1e-8 from its
singular position, later steps would not detect the singularity. If sin^2 is changed by 4e-15 so
that two solutions coincide, the equation of the solution step has an error of only 4e-15."""
MIN_CONIC = sp.Rational(1, 10**20)
"""Lower bound of the amplitude g of the second harmonic. The coefficients are near 1, with
errors of 1e-16."""
NEARLY_LINEAR = sp.Integer(10) ** 10
"""Maximum sum P + Q of two coefficients for the closed form of the resolvent cubic of a quartic. If
P + Q exceeds this value, the resolvent is linear up to 1e-5, and the closed form loses digits."""
OUTERMOST_ROOT = 1 + sp.Rational(1, 10**9)
"""Maximum accepted root tau. Rounding may move a root slightly out of [-1, 1]."""
MEETING_ROOTS = sp.Rational(1, 10**14)
"""Maximum sin^2 of half the angle between roots that coincide."""
EVEN_CONIC = sp.Rational(4, 10**15)
"""Maximum magnitude of the coefficient p that counts as a rounding error. If p counts as a rounding
error and the conic at t = 0 consists of two real lines, p and t are set to 0. The conic of the
quartic is then even in x."""
REAL_LINES = sp.Rational(1, 10**13)
"""Maximum magnitude of a negative slope of the resolvent cubic at t = 0 that counts as a rounding
error. If the slope is not negative, the conic at t = 0 consists of two real lines."""
MIN_SLOPE = sp.Rational(1, 10**10)
"""If the cubic has a triple root, rounding errors split the root. At these split roots, the slope
of the cubic is at most this value."""
GREATEST_T = sp.Rational(3, 2)
"""The root t of the resolvent cubic is at most 1. Near a triple root, Newton's method may exceed
this limit. In that case, t is set to this limit."""
MIN_T = sp.Rational(1, 10**8)
"""Minimum value of t for which the quartic solver may divide p by alpha."""
DEPENDENT_ROWS = sp.Rational(1, 10**13)
"""Maximum sine of the angle between linearly dependent rows."""
FARTHEST_POINT = sp.Integer(10) ** 6
"""Upper bound of the magnitude of the vector X in subproblem 6. If subproblem 6 has a solution, the
magnitude of X is at most sqrt(2)."""
ELLIPSES_DAMPING = sp.Rational(1, 10**14)
"""A Newton step on two angles is damped if the squared ratio of the singular values of its Jacobian
is below this value."""
LOOP_DAMPING = sp.Rational(1, 10**10)
"""A Newton step on three angles is damped if the squared ratio of the singular values is below this
value. If the Jacobian has rank 1, rounding errors alone can produce a squared ratio of up to 1e-10.
"""
NEARLY_REAL = sp.Rational(1, 10**7)
"""A solution with a negative margin is refined if the magnitude of the margin is at most this
value."""
SOLUTION_SEPARATION = sp.Rational(1, 10**7)
"""Distance (radian) of the start values from the angle at which two solutions coincide."""
PARABOLA_STEP = sp.Rational(1, 10**5)
"""Maximum joint step (radian) along the parabola on which the second-order expansion of an equation
is zero."""
NEARLY_SOLVED = sp.Rational(1, 10**5)
"""A solution is refined by one more step if its pose error (radian, or relative to the arm length)
is at most this value. The step solves all equations of the pose together. A solution step loses at
most half of the digits, so an unrefined solution is accurate to about 1e-8."""
POSE_DAMPING = sp.Rational(1, 10**12)
"""Minimum squared ratio of singular values for undamped pose steps. Rounding errors are 1e-16."""
DETERMINANT_TAIL = 1e-9
"""The coefficients of degree 9 and higher of a determinant count as zero if their ratio to the
largest coefficient is below this value. Rounding errors are 1e-15."""
SINGLE_SOLUTION = 1e-12
"""The second smallest singular value counts as zero if its ratio to the largest singular value is
at most this value. With two small singular values, the six equations have no unique solution."""
POOR_SEPARATION = 1e-5
"""Minimum separation of the solutions (``Choice.separation``). If the separation is below this
value, the solver fixes other joints of the arm. If the prismatic joint is parallel to two of the
axes, the separation of the solutions is 7e-7."""
ASKED_SEPARATION = 5e-3
"""Minimum separation of the solutions (``Choice.separation``) for which the general solver is
practical. If the separation exceeds this value, the general solver may run at every pose of an arm
that nearly has a closed-form structure."""
ASKED_MOVE = 0.05
"""Limit of the median joint change (radian) from nominal to true solutions. Above this limit, the
general solver may run at every pose. For an arm with a wrist offset of 13 mm, the median joint
change is 0.06 rad. Without the general solver, the inverse of this arm missed one of nine tested
configurations. For an IRB 120 with errors of 3.6 mm and 3.6 mrad, the median joint change is 0.02
rad."""
SEPARATE = 1e-2
"""Minimum difference (radian) between the suppressed joint angles of two solutions. The elimination
leaves the suppressed angle as the only unknown of a determinant. At smaller differences, the roots
of the determinant do not distinguish the two solutions. If the difference is below 1e-3 rad, the
solver may exchange the null vectors of the two roots."""
NOMINAL_GUARD_DIGITS = 8
"""Number of decimal digits that the exact evaluation of an angle may lose. The test for right
angles ignores the last eight digits."""

# --- latex: printed digits ---

PRINTED_DIGITS = 10
"""Number of digits that a LaTeX article prints for a number without a short exact form. Dots mark
omitted digits."""
GIVEN_DIGITS = 17
"""If a number in a file has at most this many digits, the LaTeX article prints all digits."""
FEW_PRINTED_DIGITS = 6
"""Number of digits of a printed number if the line is too short for ``PRINTED_DIGITS`` digits."""

# --- emit: tolerances that the runtime reads from the manifest ---

DEAD_POINT = 1e-12
"""Maximum margin of a loop at a dead point (no unit)."""

# --- emit: single precision ---

MAX_THRESHOLD = 1e-8
"""Maximum magnitude of a rounding threshold (any unit). The largest threshold is 4e-15 times the
fourth power of twice the arm length in meters."""
FLOOR_EXPONENT = 0.12
"""Exponent that converts a lower bound for double precision into a lower bound for single precision
(single = double^exponent)."""
LARGEST_SINGLE = 1e38
"""In single precision, constants above 1e38 are replaced by 1e38. Constants above 1e38 occur only
in code that tests whether an input is infinite."""
SOLVED_SINGLE = 2e-5
"""Largest residual (meter or radian) of a solution in single precision. SOLVED_SINGLE is the limit
1e-9 for double precision, multiplied by the square root of 2^29. The number 2^29 is the ratio of
the rounding errors in single and double precision."""
REGULAR = 1e-3
"""Errors in single precision are measured away from singularities. Near a singularity, the errors
have no bound."""

# --- chain: numerical singular configurations ---

FACTORS_VANISH = 1e-9
"""A factor of the Jacobian's minors counts as zero if its magnitude is at most this value. This
value is dimensionless, or in meters for arms with lengths near one meter. The factors contain sums
with rounding errors of about 1e-13."""
NO_WORK = 1e-12
"""If J^T y or J x has at most this norm for a unit vector y or x, the configuration is singular.
Rounding is 1e-15."""
LAST_STEP = 1e-9
"""Length of the last Newton step to a singular configuration (radian, or relative to the arm
length). If two singularities intersect, J^T y becomes small long before q is accurate."""
OTHER_CONFIGURATION = 0.02
"""Minimum distance between different configurations (radian, or relative to the arm length)."""
RANK_LOST = 1e-6
"""A Jacobian counts as rank-deficient if its smallest singular value is below this limit. The arm
is scaled to unit length. At random configurations, the smallest singular value of a regular arm
exceeds 1e-3."""

# --- inverse: numerical solutions of a general arm ---

ALMOST_REAL = 1e-3
"""Maximum imaginary part of a half-angle tangent t that counts as real, relative to 1 + |t|^2.
Rounding errors split a double root by 1e-8 times its condition number. Newton's method on the pose
rejects false roots."""
SOLVED_POSE = 1e-13
"""Maximum pose error of a solution (no unit, or relative to the arm length). The rounding error of
six matrix products is a hundred times smaller (1e-15)."""
DISTINCT_SOLUTION = 1e-5
"""Minimum joint difference between two different solutions (radian, or relative to the arm
length)."""
