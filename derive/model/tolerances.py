"""All tolerances of the compiler with name, value, unit and reason, grouped by folder.

Lengths are relative to the robot's characteristic length unless a unit is given. Constants with
different purposes (a step count, a page size) are defined in the modules that use them.
"""

import sympy as sp

# --- all folders: high-precision numbers ---

EVALUATION_DIGITS = 40
"""Decimal digits of evaluated constants: more than twice the 16 digits of a double, so that
rounding does not affect comparisons with integers and multiples of pi."""
WORKING_DIGITS = EVALUATION_DIGITS + 20
"""Decimal digits of intermediate results in constant expressions. Chains of named constants lose a
few digits. With the additional digits, all 40 digits of a constant are correct."""
RELIABLE_DIGITS = EVALUATION_DIGITS - 8
"""Number of correct decimal digits of a constant with many operations; rounding and cancellation
may change the last eight of the 40 digits."""
ROUNDING = 10.0**-RELIABLE_DIGITS
"""Up to this difference (no unit), a constant near 1 equals an integer."""

MAX_WAVES = 0.05
"""Maximum amplitude of a drive's waves (radian), relative to its gain. Up to this value, three
Newton steps invert the drive equation up to rounding error. Real drives stay below 0.001."""
MAX_SAG = 0.05
"""Maximum derivative of a joint's deflection with respect to the coordinates. Each fixed-point step
reduces the error by this factor, so twelve steps invert the spring equation up to rounding
error."""

# --- description: rounding in files ---

NOISE = 1e-9
"""Maximum difference between a file value and a short decimal that counts as noise. The difference
is relative to the longest length of the robot or the largest component of a direction; angles are
in radians. Exporters round poses to nine or more places; 1e-9 rad moves a tool at 1 m by 1 nm."""
LARGE_CLEANING = 5e-4
"""Above this tool position change (meter) caused by noise removal, a warning is printed; the value
exceeds the repeatability of an arm."""
NOISE_GAP = 1000
"""Minimum ratio (no unit) of a decimal's last place to a difference that counts as noise. The ratio
1000 means that three zeros or nines follow the last place, as in one of 500 random numbers."""
CONTINUOUS_MODEL = 0.02
"""Minimum displacement of an axis (relative to the arm's length, or radian) for a parameter change
of norm 1. Below this value, a parameter changes at least fifty times as much as the axis: an
assembly error of 1 mrad needs a parameter change of 50 mrad. If axes are 6 mrad from parallel, as
in a factory calibration, parameters along the common normal displace the axis by less than 1e-4."""
DOUBLE = 1e-15
"""Maximum relative difference (no unit) between a decimal number and its conversion to double
precision: 15 digits. One number in 10^7 is as close to a single-precision number by chance."""
SINGLE = 2.0**-23
"""Maximum relative rounding error of a single-precision number (no unit): one unit in the last
place, for a computation that rounds twice."""
ANGLE_SNAP = NOISE
"""Difference (radian) within which an angle in a file snaps to a multiple of pi/12, regardless of
the number of written digits."""
CHANCE = 0.01
"""Maximum probability that an angle matches a multiple of the snapping angle by chance: the ratio
of the last decimal place to the snapping angle. Thus 1.57 counts as a right angle, but 0.79 does
not count as 45 degrees."""
LONGEST_LENGTH = 20.0
"""Above this length (meter), the unit must be stated. Links of arms are shorter than 10 m, and an
arm in millimeters has a link longer than 20 units."""
SHORTEST_ARM = 1e-3
"""Below this size (meter), an arm is implausible; desktop arms are about 0.1 m long."""
LARGEST_ANGLE = 6.5
"""Above this angle (radian), the unit must be stated; a rounded full turn is 6.2832 or 6.3."""
MAX_TURNED = 45.0
"""Above this joint limit (radian; seven turns), the value may be in degrees."""
UNLIMITED = 10_000
"""Above this width of a joint range (radian or meter), a joint counts as unlimited. Exporters write
1e4 to 1e16 in required fields, and no axis rotates 1,600 turns."""
AXIS_DIGITS = 25
"""Number of decimal digits for axis angles without a short exact form. The error of 1e-25 rad is
far below the rounding of a double. Decimal numbers avoid roots of long fractions, which SymPy would
factorize."""
SHORT_PROPORTION = 1000
"""Largest integer ratio of the components of a direction with a short exact form."""
GIMBAL_LOCK = 1e-14
"""Components of a unit vector or quaternion below this value (no unit) have no usable direction,
because rounding in double precision gives 1e-16. At gimbal lock, roll and yaw share an axis."""
COMPILED_DECIMALS = 14
"""Decimal places (meter, radian) of values computed by a program. Rounding errors are 1e-16 for one
or two meters, and no file author writes more than 13 decimal places."""
COMPILED_ANGLE = 1e-13
"""Difference (radian) between an angle that a program computes and the angle in a file: a few
rounding errors of an angle near pi."""
CALIBRATED_TOOL = 0.05
"""Maximum tool displacement caused by a factory calibration at zero coordinates: meter, and norm of
the difference of rotation matrices. Calibrations move the tool by millimeters. A calibration for
the wrong robot type moves the tool by 80 mm or more."""
LENGTH_SCALING = 1e-10
"""Maximum deviation (m or rad, at lengths near 1 m) from a linear or constant function of the
file's lengths. With 15-digit numbers, rounding gives about 1e-14. The deviation of a wrong
expression is about as large as the expression."""

# --- numbers that count as integers ---

MEANT = 1e-100
"""Below this magnitude (no unit), a nonzero constant is not replaced by 0. Rounding of numbers near
1 gives at least 1e-40, so a constant of 1e-150 must come from the file itself."""
UNIT_VECTOR = 1e-12
"""Maximum difference between a unit vector's squared length and 1 (no unit): rounding gives about
1e-15. An exact vector must have length 1 exactly."""

# --- loops: closures, ranks, branches ---

BRANCHES_APART = 1e-6
"""Below this distance difference, two branches are equally near to the reference.

The distance is the root of a sum of squares, in radian or relative to the mechanism size. Rounding
in double precision gives about 1e-8 near a dead point; references are written with three digits.
"""
OFF_BRANCH = 1e-6
"""Above this closure error of a joint (relative to the size, or radian), a branch does not exist.

Near a dead point, rounding errors in double precision become about 1e-8. The closure error of an
incompatible joint is about as large as the links.
"""
LOOPS_AGREE = 1e-6
"""Maximum loop residual (relative, or direction cosine) for a set of fixed joint values.

If the main chain has more joints than degrees of freedom, consistent joint values give residuals of
1e-8 near a dead point. Inconsistent joint values, set by hand, give far larger residuals.
"""
OFF_AXIS = 1e-12
"""Above this squared distance (square meter), a point at the reference is not on an axis."""
ZERO_COMPONENT = 1e-25
"""Vector components below this value are zero (no unit, or meter between points).

Components are evaluated at 40-digit precision, so 15 digits remain for rounding errors. A component
below this value counts as a rounding error of 0.
"""
CLOSED_LOOP = 1e-12
"""Below this residual (meter, or sine of an angle), a loop is closed in double precision."""
NEARLY_DEAD = 1e-3
"""If sin^2 of a transmission angle at the reference is below this value, another ring of pins is
solved first. Two degrees from a dead point, a length error of a tenth of a millimeter moves joints
by milliradians."""
CLEAR_LEG = 0.25
"""If sin^2 of a leg's transmission angle at the reference is below this value, a leg farther from
its dead point solves the joint. The bound corresponds to an angle of 30 degrees."""
VANISHED = 1e-12
"""Below this length (relative to the longest vector), a vector may be exactly zero. Rounding gives
1e-16; a false positive only triggers the exact test."""
FOUND_LOOP = 1e-10
"""Above this residual (meter, or sine of an angle), a CasADi implicit function has failed. The last
step of the iteration is 1e-14. Redundant equations are solved in the least-squares sense."""
ZERO_SINGULAR_VALUE = 1e-9
"""Singular values below this fraction of the largest singular value are zero (no unit).

The value is far above the rounding error of a Jacobian at a closed configuration (1e-15), and far
below the smallest singular value away from singularities (1e-3).
"""
REPEATED_EQUATION = 1e-4
"""Bound for singular values of redundant equations near closure, relative to the largest.

At a residual of 1e-12, a configuration may be 1e-6 away from closure, and redundant equations still
seem to be independent.
"""
STILL_JOINT = 1e-6
"""Below this motion (radian, or relative to the size), a joint cannot move in its closed loops.

The values of a moving joint differ more between random closed configurations.
"""
REPEATED_AS_BUILT = 0.02
"""Bound for singular values in robots as built, whose tilted axes make redundant equations seem
independent. The bound is ten times the value observed for axes 2 mrad out of parallel."""
WORTHWHILE_STEP = 0.9
"""A Newton step is shortened if more than this fraction of the residual remains."""
SAMPLED_RANGE = 0.3
"""Distance of random configurations from the reference (radian, or relative to the size).

The distance is large enough to move away from a singular reference, and small enough that Newton's
method closes the loops.
"""
NEIGHBOURHOOD = 0.02
"""Distance of closed configurations near the reference (radian, or relative to the size).

At larger distances, Newton's method may find a different assembly mode with different degrees of
freedom. The distance is large enough to detect singular values that vanish at the reference (4e-4
if they grow quadratically).
"""
NUMERICALLY_CLOSED = 1e-7
"""Up to this closure error (relative to the size, or radian), a loop counts as closed in a
numerical search. A search with finite differences ends about 1e-10 from closure. At a dead point,
the closure error grows quadratically with the motion, so angles are then accurate to 3e-4 rad."""
DIFFERENCE_STEP = 1e-6
"""Step of central differences in a numerical search (radian, or relative to the size). The square
of the step, and the rounding error of a double relative to the step, are both below 1e-9."""
WORTHWHILE_GAIN = 1e-5
"""Minimum relative decrease of the squared closure error (no unit) per minimization step."""
CLOSING_GAIN = 3e-3
"""Minimum relative decrease of the squared closure error (no unit) per iteration of a search for
closed loops. With a smaller decrease, three quarters of the squared closure error would remain
after eighty iterations, but a closed loop needs a decrease by fourteen orders of magnitude."""
SAME_POINT = 1e-9
"""Below this distance (meter; no unit for directions), two points of a drawing coincide.

Loops closed in double precision have errors of 1e-12; the eye resolves 1e-4 of a robot's size.
"""
MOVED_REFERENCE = 0.3
"""Minimum reported difference (radian, or relative) between the description and the closed
reference.

Values estimated by eye are about 10 degrees off; a different assembly mode is usually farther away.
"""
PIN_ACROSS = 0.1
"""A pin counts as perpendicular to its strut up to this cosine of their angle.

In robots as built, this cosine is a few hundredths. A frame that only locates the point of an end
may have any orientation.
"""
SAME_VIEW = 1e-6
"""Up to this angle (radian), directions of a solved configuration count as parallel in a drawing.

A configuration that closes overconstrained loops is accurate to about 1e-7.
"""
LAYOUT_TIE = 1e-5
"""Values up to this distance below a half are rounded up (in units of 0.1 mm).

The last digits of these values differ between machines, but the bytes of a drawing must not differ.
"""
DRAWN_AS_ONE = 1e-6
"""Below this distance, two points of a body are drawn as one point, relative to the robot's size.

This is a hundredth of the smallest visible distance; placements have rounding errors of 1e-15.
"""
DRAWN_DIGITS = 9
"""Decimal places of a drawn point relative to the robot's size, and of a direction (no unit).

The eye resolves four decimal places. With five more decimal places, drawings are equal on all
machines and still resolve micrometers.
"""

# --- loops: paths of complex unit poses in Study's coordinates ---

PATH_NEAR = 1e-4
"""Maximum first Newton correction after a path step; for a larger correction, a different path may
be equally near."""
PATH_ON = 1e-7
"""Maximum second Newton correction, about the square of the first correction."""
SHORTEST_PATH_STEP = 1e-9
"""Below this step length, a path ends: its end point is singular, or at infinity."""
POSES_ARE_ONE = 1e-8
"""Maximum 1 - |<x, y>| of two poses x and y that count as equal. Each pose is accurate to 1e-12.
The measure
grows with the square of the difference."""
SINGULAR_POSE = 1e11
"""Above this condition number, a pose counts as singular for generic rods; regular poses have about
1e4."""
POSE_AT_INFINITY = 1e-10
"""Maximum |e.e| of a pose at infinity; for a rotation, e.e is never 0."""
NO_FRAME = 1e-9
"""Below this distance (meter), a centroid counts as the origin."""
RODS_SPAN = 1e-9
"""Below this relative singular value, the rods do not vary in the corresponding direction."""

# --- inverse: structures, boundaries of subproblems, determinants ---

EXACT_STRUCTURE = 1e-9
"""Up to this deviation (radian, or relative to the arm's length), a closed-form structure of the
axes counts as exact.

Decimal numbers in a file are read exactly, so only rounding errors of the numerical test remain.
"""
MEASURED_STRUCTURE = 5e-3
"""Up to this deviation (radian, or relative to the arm's length), a closed-form structure of the
axes counts as intended.

The value bounds the errors of a measured arm: a few millimeters per meter and a few milliradians.
"""
NEARLY_STRUCTURE = 3e-2
"""Up to this deviation (radian, or relative to the arm's length), a nominal arm with a closed-form
structure is tried. The nominal arm is used if Newton's iteration converges from its solutions to
the solutions of the true arm, which is rare for larger deviations."""
MIN_CONVERGED = 0.9
"""Fraction of random configurations that must be recovered from a nominal arm. About one
configuration in ten is near a singularity, where a small difference between the arms moves
solutions by arbitrary amounts."""
CONVERGENCE_UNLIKELY = 0.85
CONVERGENCE_CLEAR = 0.95
"""If the fraction recovered from the nearest nominal solution is between these two limits, the
fraction recovered from all nominal solutions is also computed. For 70 arms, the second fraction was
at most 0.03 smaller and 0.05 larger."""
MIN_NEARBY = 0.5
"""Required fraction of random configurations near a nominal branch. The fraction is nearly 1 for
suitable nominal arms, and 0 if the nominal inverse has different branches."""
RECOVERED = 1e-6
"""Below this distance (radian, or relative to the arm's length), the iteration has recovered a
configuration. Away from singularities, the error after eight steps is 1e-14."""
MAX_REFINING_STEP = 0.3
"""Maximum change of a coordinate per Newton step (meter or radian); a larger change may lead to a
different branch."""
LOST = 1e-5
"""Above this error (radian, or meter for arms of at least a meter), a reachable pose counts as
missed. Smaller errors, which may result from rounding, are refined at run time."""
JACOBIAN_RANK = 1e-9
"""Maximum singular value of the Jacobian that counts as 0, with lengths relative to the arm."""
OBLIQUE_AXES = 1e-3
"""Minimum sine of the angle by which directions must differ from parallel or perpendicular."""
TOOL_ON_AXIS = EXACT_STRUCTURE
"""Up to this distance (meter) and this sine of the angle, the tool counts as lying on its joint
axis or in the base plane."""
INDEPENDENT_SLIDES = EXACT_STRUCTURE
"""Up to this smallest singular value, unit directions are linearly dependent."""
UNDETERMINED_SUM = sp.Float("5e-10", 20)
"""Up to this sine of the angle between two directions, the directions count as parallel.

Parallel directions do not determine a joint angle, so an angle within reach of the other joints is
chosen. Prismatic joints count as perpendicular to an axis up to the same cosine.
"""
UNDETERMINED_TURN = sp.Float("2e-10", 20)
"""Up to this distance (meter) of a point from an axis, a rotation does not move the point.

The rotation angle is then chosen for the later joints; the choice moves the point by at most twice
this value.
"""
ALIGNED_AXES = sp.Float("1e-8", 20)
"""Two axes count as aligned if the sine of their angle is below this value.

The error of the two joint angles from the orientation is the rounding error divided by this sine.
"""
DIRECTION_FLOOR = sp.Float("1e-150", 20)
"""This value is added to the first component of a computed direction, and to divisors that may be
0.

The addition does not change numbers above 1e-134, the square of the value does not underflow, and
the direction of (0, 0) becomes the angle 0 instead of 0/0.
"""
VECTOR_FLOOR = sp.Float("1e-140", 20)
"""A vector that may be 0 is replaced by the sum of the vector and this multiple of a second vector.
The sum equals the vector in double precision, unless the vector is almost 0."""
GREATEST_NUMBER = 1e300
"""Above this sum of input magnitudes (meter or no unit), an input counts as infinite."""
DIVISOR_FLOOR = sp.Float("1e-300", 20)
"""This value is added to a divisor that is a sum of squares and may be 0."""
ARTICLE_ZERO = 1e-100
"""The article omits numbers below this magnitude, such as a term that only prevents a division by
zero."""
MEETING_SOLUTIONS = sp.Float("4e-15", 20)
"""Maximum sin^2 of half the angle between two solutions that coincide.

Rounding changes this value by about 1e-16, relative to its terms. If a solution moved by 1e-8 from
its
singular position, later steps would not detect the singularity. An error of 4e-15 in the equation
is harmless.
"""
MIN_CONIC = sp.Rational(1, 10**20)
"""Lower bound of the amplitude g of the second harmonic; the coefficients are near 1 and have
errors of 1e-16."""
NEARLY_LINEAR = sp.Integer(10) ** 10
"""Above this value of P + Q, the resolvent is linear up to 1e-5, and its closed form loses
digits."""
OUTERMOST_ROOT = 1 + sp.Rational(1, 10**9)
"""Maximum accepted root tau: rounding may move a root slightly out of [-1, 1]."""
MEETING_ROOTS = sp.Rational(1, 10**14)
"""Maximum sin^2 of half the angle between two coinciding roots: rounding separates a double
root."""
EVEN_CONIC = sp.Rational(4, 10**15)
"""Maximum coefficient p that counts as rounding; the conic is then even in x, and t = 0."""
REAL_LINES = sp.Rational(1, 10**13)
"""Most negative slope of the cubic at 0 for which the lines at t = 0 are real up to rounding."""
MIN_SLOPE = sp.Rational(1, 10**10)
"""Below this slope of the cubic, rounding errors have split a triple root."""
GREATEST_T = sp.Rational(3, 2)
"""Upper bound of t after a step from a triple root; an exact t is at most 1."""
MIN_T = sp.Rational(1, 10**8)
"""Below this value of t, alpha is too small to divide p by alpha."""
DEPENDENT_ROWS = sp.Rational(1, 10**13)
"""Up to this sine of their angle, two rows are linearly dependent, except for rounding."""
FARTHEST_POINT = sp.Integer(10) ** 6
"""Upper bound for the point X of subproblem 6; no solution exists beyond sqrt(2)."""
ELLIPSES_DAMPING = sp.Rational(1, 10**14)
"""Minimum squared ratio of singular values for undamped Newton steps on two angles."""
LOOP_DAMPING = sp.Rational(1, 10**10)
"""Minimum squared ratio of singular values for undamped Newton steps on three angles. If the
Jacobian has rank 1, rounding alone can produce smaller ratios."""
NEARLY_REAL = sp.Rational(1, 10**7)
"""Most negative margin at which solutions are refined; for smaller margins, Newton's method finds
different solutions."""
SOLUTION_SEPARATION = sp.Rational(1, 10**7)
"""Distance (radian) of start values from the common point of solutions with equal squared lengths.

From squared lengths, an angle can be computed with an error of 1e-8.
"""
PARABOLA_STEP = sp.Rational(1, 10**5)
"""Maximum step (radian) on the second-order parabola, a hundred times the start distance."""
NEARLY_SOLVED = sp.Rational(1, 10**5)
"""Below this error (radian, or relative to the arm's length), all conditions are solved together.

A solution step loses at most half of the digits, so a solution is accurate to about 1e-8.
"""
POSE_DAMPING = sp.Rational(1, 10**12)
"""Minimum squared ratio of singular values for undamped pose steps; rounding errors are 1e-16."""
DETERMINANT_TAIL = 1e-9
"""Up to this relative size, coefficients above degree 8 of a determinant count as 0; rounding gives
1e-15."""
SINGLE_SOLUTION = 1e-12
"""Below this ratio of the second smallest to the largest singular value, the second smallest counts
as 0.

With two small singular values, the six equations do not determine a unique solution.
"""
POOR_SEPARATION = 1e-5
"""Below this separation of the solutions (:attr:`.Choice.separation`), other joints are fixed
instead. Arms with six regular joints and a prismatic joint have at least 1e-4. An arm whose
prismatic joint is parallel to two axes has 7e-7."""
ASKED_SEPARATION = 5e-3
"""Above this separation of the solutions (:attr:`.Choice.separation`), the general solver is
practical.

The general solver may then run at every pose of an arm that nearly has a closed-form structure. The
separation is 2e-2 for a calibrated Panda with a fixed joint. For an iiwa, the separation is at most
2e-3, and the solver takes five times as long.
"""
ASKED_MOVE = 0.05
"""Above this median joint change (radian) between nominal and true solutions, the general solver is
needed.

Joint change above which the general solver runs at every pose, if it separates the solutions well.
Near a wrist singularity, an arm with a large joint change has solutions that belong to no nominal
branch. With a wrist offset of 13 mm (median joint change 0.06), one of nine tested configurations
was missed. The median is 0.02 for an IRB 120 with errors of 3.6 mm and 3.6 mrad, and smaller for
all tested arms with errors of up to 3 mm and 3 mrad.
"""
SEPARATE = 1e-2
"""Above this joint difference (radian), the roots of the determinant distinguish two solutions.

The value is ten times the difference of two roots whose vectors may be exchanged.
"""
NOMINAL_GUARD_DIGITS = 8
"""Number of decimal digits that the exact evaluation of an angle may lose, for the test of right
angles."""

# --- latex: printed digits ---

PRINTED_DIGITS = 10
"""Digits of a number without a short exact form in an article; dots mark omitted digits."""
GIVEN_DIGITS = 17
"""Maximum digits of a file value that an article prints in full; a double has 17."""
FEW_PRINTED_DIGITS = 6
"""Number of printed digits if a line has no room for ``PRINTED_DIGITS``."""

# --- emit: tolerances that the runtime reads from the manifest ---

DEAD_POINT = 1e-12
"""Up to this margin (no unit), a loop counts as being at a dead point: sin^2 of a microradian."""

# --- emit: single precision ---

MAX_THRESHOLD = 1e-8
"""Below this magnitude (any unit), a constant used only by conditions is a rounding threshold. The
largest threshold is 4e-15 times the fourth power of twice the length of an arm in meters."""
FLOOR_EXPONENT = 0.12
"""Exponent that converts the lower bounds 1e-150 and 1e-300 to 1e-18 and 1e-36 for single
precision. The square of 1e-18, and 1e-36 itself, are normal numbers in single precision."""
LARGEST_SINGLE = 1e38
"""Larger constants are replaced by this value in single precision; such constants only detect
infinite inputs."""
SOLVED_SINGLE = 2e-5
"""Largest residual (meter or radian) of a solution in single precision. The limit 1e-9 of double
precision is multiplied by the square root of the rounding-error ratio, 2^29."""
REGULAR = 1e-3
"""Errors in single precision are measured only if the smallest singular value of a Jacobian (no
unit, or meter) and the smallest margin of a loop exceed this value. Near a singularity, the errors
in
single precision grow without bound."""

# --- chain: numerical singular configurations ---

FACTORS_VANISH = 1e-9
"""Up to this value (no unit, or meter for lengths near one meter), factors of minors count as 0.
The value is ten thousand times the rounding error of the sums in these factors."""
NO_WORK = 1e-12
"""A configuration is singular if J^T y or J x is at most this long for a unit vector y or x.
Lengths are relative to the arm's length. Rounding is 1e-15."""
LAST_STEP = 1e-9
"""Length of the last Newton step (radian, or relative to the arm's length) to a singular
configuration, so that the printed digits (1e-5) are correct. If two singularities intersect, J^T y
is small long before q is accurate."""
OTHER_CONFIGURATION = 0.02
"""Above this distance (radian, or relative to the arm's length), configurations count as different.
Readers notice a difference of about one degree."""
RANK_LOST = 1e-6
"""Below this singular value, a Jacobian of an arm with unit length is rank deficient. At drawn
configurations, the value of a full-rank arm is above 1e-3."""

# --- inverse: numerical solutions of a general arm ---

ALMOST_REAL = 1e-3
"""Up to this imaginary part of a half-angle tangent t, relative to 1 + |t|^2, a root is tried as
real. Double roots are split by the square root of the rounding error, 1e-8, times their condition
number. Newton's iteration on the pose rejects false roots."""
SOLVED_POSE = 1e-13
"""Maximum pose error of a solution (no unit, or relative to the arm's length): a hundred times the
rounding error of six matrix products."""
DISTINCT_SOLUTION = 1e-5
"""Above this joint difference (radian, or relative to the arm's length), two solutions differ;
printed values differ if the difference is at least 1e-4 rad."""
