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
"""Decimal digits of intermediate results in constant expressions. Chains of named constants lose a
few of these digits, but the 40 digits of the result are correct."""
RELIABLE_DIGITS = EVALUATION_DIGITS - 8
"""Number of correct decimal digits of a long constant. Many operations may change the last eight
of the 40 digits."""
ROUNDING = 10.0**-RELIABLE_DIGITS
"""Maximum difference between an integer and a constant near 1 that counts as this integer (no
unit)."""

MAX_WAVES = 0.05
"""Maximum ratio of the wave amplitude (radian) to the gain of a drive. For ratios up to 0.05, three
Newton steps invert the drive equation up to rounding errors. Real drives have ratios below
0.001."""
MAX_SAG = 0.05
"""Maximum derivative of a joint deflection with respect to the coordinates. Each fixed-point step
of the spring equation multiplies the error by at most 0.05. Twelve steps invert the spring equation
up to rounding errors."""

# --- description: rounding in files ---

NOISE = 1e-9
"""Maximum noise of a number in a file. The noise is the difference of the number from a short
decimal, relative to the longest length of the robot, or to the largest component of a direction.
For angles, the noise is in radians. Other programs round poses to nine or more places. An angle of
1e-9 rad moves a tool at 1 m by 1 nm."""
LARGE_CLEANING = 5e-4
"""Maximum tool displacement (meter) by noise removal without a warning. A displacement of 5e-4 m
exceeds the repeatability of an arm."""
NOISE_GAP = 1000
"""A number is read as a rounded decimal if the unit of the decimal's last place is at least this
many times the deviation. In the file, at least three zeros or nines then follow the digits of the
rounded decimal. One in 500 random numbers has three zeros or three nines after a chosen decimal
place."""
CONTINUOUS_MODEL = 0.02
"""Minimum displacement of an axis for a parameter change of norm 1 (radian, or relative to the arm
length). For a displacement below 0.02, the parameters change at least fifty times as much as the
axis. A parameter change of more than 50 mrad would describe an assembly error of only 1 mrad. For
axes 6 mrad from parallel, as in a factory calibration, parameters along the common normal displace
the axis by less than 1e-4."""
DOUBLE = 1e-15
"""Maximum relative difference (no unit) between a decimal and its double. A relative difference of
1e-15 corresponds to 15 digits. One random number in 10^7 differs by less than
1e-15 from a single-precision number."""
SINGLE = 2.0**-23
"""Maximum relative rounding error of a single-precision number (no unit). SINGLE is one unit in the
last place, because a computation may round twice."""
ANGLE_SNAP = NOISE
"""Maximum difference (radian) between an angle in a file and the multiple of pi/12 that replaces
it, for any number of digits."""
CHANCE = 0.01
"""Maximum probability that an angle matches a multiple of an angle step by chance. The probability
of a match is the last decimal place of the angle, divided by the angle step. For example, 1.57
counts as a right angle, but 0.79 does not count as 45 degrees."""
LONGEST_LENGTH = 20.0
"""Maximum plausible length (meter) in a file that states no unit. Links of arms are shorter than 10
m. In millimeters, some link length of an arm exceeds the number 20."""
SHORTEST_ARM = 1e-3
"""Minimum plausible size of an arm (meter). Desktop arms are about 0.1 m long."""
LARGEST_ANGLE = 6.5
"""Maximum plausible angle (radian) in a file that states no unit. A rounded full turn is 6.2832 or
6.3."""
MAX_TURNED = 45.0
"""Maximum plausible joint limit (radian), which is seven turns. A joint limit above 45 may be in
degrees."""
UNLIMITED = 10_000
"""Maximum width of a limited joint range (radian or meter). A joint with a wider range counts as
unlimited. Some programs write limits of 1e4 to 1e16 for unlimited joints, because the file format
requires limits. No axis rotates 1,600 turns."""
AXIS_DIGITS = 25
"""Decimal digits of axis angles without a short exact form. Rounding an angle to 25 decimal digits
changes the angle by far less than the rounding error of a double. Decimals avoid roots of long
fractions, which SymPy would factor."""
SHORT_PROPORTION = 1000
"""Largest integer in the ratios of a direction that has a short exact form."""
GIMBAL_LOCK = 1e-14
"""Components of a unit vector or quaternion up to this value do not determine an angle (no unit).
Rounding errors are 1e-16. At gimbal lock, roll and yaw share an axis."""
COMPILED_DECIMALS = 14
"""Number of kept decimal places (meter, radian) of numbers that a program computed. Rounding errors
of lengths up to 2 m are 1e-16 m, and no author writes more than 13 decimal places."""
SAME_EQUATION = 1e-9
"""Maximum difference between two equations that state the same relation between joints (relative,
or radian or meter for the constant). Compiled ratios have 14 decimal places, so that the inverse of
a ratio of 0.001 has a relative error of 1e-11."""
PARALLEL_GEARS = 1e-6
"""Maximum difference between 1 and the cosine of the angle between the axis of a gearbox and the
axis of a joint that it turns. Directions in files have at least four digits."""
COMPILED_ANGLE = 1e-13
"""Maximum difference (radian) between a computed angle and the angle in a file. Rounding errors of
angles near pi are a few times smaller than 1e-13 rad."""
CALIBRATED_TOOL = 0.05
"""Maximum displacement of the tool by a factory calibration, with all joints at zero.
CALIBRATED_TOOL limits the tool distance (meter) and the norm of the difference of the rotation
matrices. Calibrations move the tool by millimeters. A calibration for another type of robot moves
the tool by 80 mm or more."""
LENGTH_SCALING = 1e-10
"""Maximum deviation from a linear or constant function of the lengths in a file (m or rad, for
lengths near 1 m). For numbers with 15 digits, rounding errors are about 1e-14. The deviation of
a wrong expression is about as large as the expression itself."""

# --- numbers that count as integers ---

MEANT = 1e-100
"""Maximum nonzero constant (no unit) that cannot be a rounding error, so that it is not replaced by
0. Rounding errors of numbers near 1 are at least 1e-40. So a constant of 1e-150 comes from the
robot file, not from rounding."""
UNIT_VECTOR = 1e-12
"""Maximum difference between 1 and the squared length of a unit vector (no unit). Rounding
errors are about 1e-15. An exact vector must have exactly the length 1."""

# --- loops: closures, ranks, branches ---

BRANCHES_APART = 1e-6
"""Two branches are equally near the reference if their distances from the reference differ by at
most this value. A distance is the root of a sum of squares, in radian or relative to the size. Near
a dead point, rounding errors are about 1e-8. Reference configurations in files have three digits.
"""
OFF_BRANCH = 1e-6
"""Maximum closure error of a joint on an existing branch (radian, or relative to the size). Near a
dead point, rounding errors grow to about 1e-8. If a joint is not on an existing branch, its closure
error is about as large as the links."""
LOOPS_AGREE = 1e-6
"""Maximum loop residual (relative, or a cosine) for a set of fixed joint values. If the main chain
has redundant joints, consistent values give residuals of 1e-8 near a dead point. If values are
inconsistent because they were set by hand, residuals exceed this value by far."""
OFF_AXIS = 1e-12
"""Maximum squared distance at the reference of a point on an axis (square meter)."""
ZERO_COMPONENT = 1e-25
"""Maximum vector component that counts as zero (no unit, or meter between points). Components are
evaluated with 40 digits, so 15 digits remain for rounding errors."""
CLOSED_LOOP = 1e-12
"""Maximum residual of a closed loop in double precision (meter, or sine of an angle)."""
NEARLY_DEAD = 1e-3
"""Loops of pin joints are solved last if sin^2 of the transmission angle at the reference is below
this value. Such loops are near a dead point. Two degrees from a dead point, a length error of 0.1
mm moves joints by milliradians."""
CLEAR_LEG = 0.25
"""Minimum sin^2 of the transmission angle, at the reference, of the leg whose equation determines a
joint. If sin^2 is below this value, the equation of another leg determines the joint. The minimum
transmission angle is 30 degrees."""
VANISHED = 1e-12
"""Maximum length of a vector that may be exactly zero, relative to the longest vector. Rounding
errors are 1e-16. An exact test decides whether a vector below this length is zero."""
FOUND_LOOP = 1e-10
"""Maximum residual of an implicit function of CasADi that has converged (meter, or sine of an
angle). The last step of Newton's method is 1e-14. Redundant equations are solved in the
least-squares sense."""
ZERO_SINGULAR_VALUE = 1e-9
"""Singular values below this fraction of the largest one are zero (no unit). Rounding errors of a
Jacobian are about 1e-15. Away from singularities, the smallest singular value is about 1e-3 of the
largest."""
REPEATED_EQUATION = 1e-4
"""Bound for singular values of redundant equations in nearly closed loops, relative to the largest
one. At a residual of 1e-12, a configuration may be 1e-6 from closure. At a distance of 1e-6 from
closure, redundant equations seem to be independent."""
STILL_JOINT = 1e-6
"""A joint is immovable if its values at random closed configurations differ by less (radian, or
relative to the size)."""
REPEATED_AS_BUILT = 0.02
"""Bound for singular values of redundant equations in real robots. Slightly tilted axes make
redundant equations seem independent. If axes are 2 mrad out of parallel, the singular value of a
redundant equation is about 0.002."""
WORTHWHILE_STEP = 0.9
"""Maximum fraction of the residual that remains after a full Newton step. If the remaining fraction
exceeds this value, the Newton step is shortened."""
SAMPLED_RANGE = 0.3
"""Distance of random configurations from the reference (radian, or relative to the size).
Configurations at 0.3 rad are away from a singular reference, and Newton's method still closes the
loops."""
NEIGHBOURHOOD = 0.02
"""Maximum offset of joint values from the reference (radian, or relative to the size). From each
offset configuration, Newton's method closes the loops.

At larger offsets, Newton's method may find another assembly mode with other degrees of freedom. A
singular value may be 0 at the reference only. If this singular value grows with the square of the
offset, its value is 4e-4 at the offset 0.02, which counts as nonzero."""
NUMERICALLY_CLOSED = 1e-7
"""Maximum closure error (radian, or relative to the size) of a closed loop in a numerical search. A
search with finite differences ends about 1e-10 from closure. At a dead point, the closure error
grows quadratically with the motion, and angles are accurate to 3e-4 rad only."""
DIFFERENCE_STEP = 1e-6
"""Step of central differences in a numerical search (radian, or relative to the size). Two
errors are below 1e-9: the square of the step, and the rounding error of a double divided by the
step."""
WORTHWHILE_GAIN = 1e-5
"""Minimum relative decrease of the squared closure error (no unit) per step of a minimization."""
CLOSING_GAIN = 3e-3
"""Minimum relative decrease of the squared closure error (no unit) per step of a search for closed
loops. If the squared error decreases more slowly in each of eighty steps, three quarters of the
squared error remain. In a search that closes the loops, the squared error decreases by fourteen
orders of magnitude."""
SAME_POINT = 1e-9
"""Maximum distance between two points of a drawing that coincide (meter; no unit for directions).
Closed loops have errors of 1e-12. The eye resolves 1e-4 of the size of a robot."""
MOVED_REFERENCE = 0.3
"""Minimum reported difference (radian, or relative) between a description and its closed reference.
If an author estimates joint values, their errors are about 10 degrees. The joint values of another
assembly mode usually differ by more than 0.3."""
PIN_ACROSS = 0.1
"""Maximum cosine of the angle between a pin and its strut that count as perpendicular. In real
robots, the cosine of the angle between a pin and its strut is a few hundredths. If a strut frame
defines only a point, the orientation of the frame is arbitrary."""
SAME_VIEW = 1e-6
"""Maximum angle (radian) between parallel directions in a drawing. Closed overconstrained loops are
accurate to about 1e-7."""
LAYOUT_TIE = 1e-5
"""A value is rounded up if its fraction is a half, or less than a half by at most this tolerance
(in units of 0.1 mm). The last digits differ between machines, but a drawing must have the same
bytes."""
DRAWN_AS_ONE = 1e-6
"""Maximum distance between two points of a body that are drawn as one point (relative to the size).
The eye resolves 1e-4 of the size. Placements have rounding errors of 1e-15."""
DRAWN_DIGITS = 9
"""Decimal places of a drawn point (relative to the size) and of a direction (no unit). The eye
resolves four decimal places. With nine decimal places, drawings are the same on all machines and
still resolve micrometers."""

# --- loops: paths of complex unit poses in Study's coordinates ---

PATH_NEAR = 1e-4
"""Maximum size of the first Newton correction after each step along a path. If the correction
exceeds this value, the step may have reached another path."""
PATH_ON = 1e-7
"""Maximum size of the second Newton correction. The second correction is about the square of the
first correction."""
SHORTEST_PATH_STEP = 1e-9
"""Minimum step of the path parameter, which grows from 0 to 1 along a path. A path that requires a
shorter step leads to a singular pose or to infinity, so path tracking stops."""
POSES_ARE_ONE = 1e-8
"""Maximum 1 - |<x, y>| of equal poses x and y. Each pose is accurate to 1e-12. The expression 1 -
|<x, y>| is quadratic in the difference of x and y."""
SINGULAR_POSE = 1e11
"""Maximum condition number of a regular pose of generic rods. Regular poses have condition numbers
of about 1e4."""
POSE_AT_INFINITY = 1e-10
"""Maximum |e.e| of a pose at infinity. For a rotation, e.e is never 0."""
NO_FRAME = 1e-9
"""Maximum distance (meter) of a centroid that counts as the origin."""
RODS_SPAN = 1e-9
"""Minimum singular value of the variation of rod endpoints and rod lengths between configurations.
A smaller singular value, relative to the largest singular value, counts as zero."""

# --- inverse: structures, boundaries of subproblems, determinants ---

EXACT_STRUCTURE = 1e-9
"""Maximum deviation (radian, or relative to the arm length) of axes with an exact closed-form
structure. Decimals in a file are read exactly, so only rounding errors of the numerical test
remain."""
MEASURED_STRUCTURE = 5e-3
"""Maximum deviation (radian, or relative to the arm length) of axes with an intended closed-form
structure. A measured arm deviates from its design by a few millimeters per meter and a few
milliradians."""
NEARLY_STRUCTURE = 3e-2
"""Maximum deviation (radian, or relative to the arm length) of a nominal arm that is tried. The
nominal arm is used if Newton's method leads from its solutions to the solutions of the true arm.
If the axes deviate by more than 3e-2, Newton's method rarely converges."""
MIN_CONVERGED = 0.9
"""Fraction of random configurations that a nominal arm must recover. About one configuration in ten
is near a singularity. Near a singularity, a small difference between the nominal and the true arm
moves solutions by any amount."""
CONVERGENCE_UNLIKELY = 0.85
CONVERGENCE_CLEAR = 0.95
"""Limits for the fraction of configurations that Newton's method recovers from the nearest nominal
solution. For a recovered fraction between 0.85 and 0.95, Newton's method is also started from all
nominal solutions. In a test of 70 arms, the fraction for starts from all nominal solutions differed
by -0.03 to 0.05 from the fraction for starts from the nearest nominal solution."""
MIN_NEARBY = 0.5
"""Minimum fraction of random configurations near a nominal branch that Newton's method must
recover. The recovered fraction is nearly 1 for suitable nominal arms. The fraction is 0 if the
nominal inverse has other branches than the true inverse."""
RECOVERED = 1e-6
"""Maximum distance (radian, or relative to the arm length) of a recovered configuration. Away
from singularities, the error after eight steps is 1e-14."""
MAX_REFINING_STEP = 0.3
"""Maximum change of a coordinate per Newton step (meter or radian). If a step exceeds this value,
Newton's method may find a solution on another branch."""
LOST = 1e-5
"""Maximum error of a reached pose (radian, or meter for arms of at least a meter). Errors below
1e-5 may be rounding errors, and are refined at run time."""
JACOBIAN_RANK = 1e-9
"""Maximum singular value of the Jacobian that counts as zero. Lengths are relative to the arm."""
OBLIQUE_AXES = 1e-3
"""Minimum sine of the angle between directions that are not parallel. OBLIQUE_AXES is also the
minimum cosine of directions that are not perpendicular."""
TOOL_ON_AXIS = EXACT_STRUCTURE
"""Maximum distance (meter) and maximum sine of the angle between tool and joint axis, or tool and
base plane, that count as zero."""
INDEPENDENT_SLIDES = EXACT_STRUCTURE
"""Maximum smallest singular value of linearly dependent unit directions."""
UNDETERMINED_SUM = sp.Float("5e-10", 20)
"""Maximum sine of the angle between parallel directions. If parallel directions do not determine a
joint angle, the angle is set such that the other joints can reach the pose. For prismatic joints,
directions are perpendicular if the cosine of their angle is at most UNDETERMINED_SUM."""
UNDETERMINED_TURN = sp.Float("2e-10", 20)
"""Maximum distance (meter) between an axis and a point that a rotation about the axis does not
move. If the point does not determine the rotation angle, the angle is set such that the later
joints can be solved. The rotation moves the point by at most twice the distance between axis and
point."""
ALIGNED_AXES = sp.Float("1e-8", 20)
"""Maximum sine of the angle between aligned axes. The joint angles about two aligned axes have the
rounding error divided by the sine of the angle between the axes."""
DIRECTION_FLOOR = sp.Float("1e-150", 20)
"""Number that is added to the first component of a computed direction, and to divisors that may be
0. The addition does not change numbers above 1e-134, and the square of 1e-150 does not underflow.
The direction of (0, 0) becomes the angle 0 instead of 0/0."""
VECTOR_FLOOR = sp.Float("1e-140", 20)
"""Factor of a replacement vector. The product of factor and replacement vector is added to a
computed vector that may be 0. In double precision, the addition changes the direction of the
computed vector only if the computed vector is almost 0."""
GREATEST_NUMBER = 1e300
"""Maximum sum of the magnitudes of a finite input (meter or no unit)."""
DIVISOR_FLOOR = sp.Float("1e-300", 20)
"""Positive number that is added to a divisor that may be 0. The divisor is a sum of squares."""
ARTICLE_ZERO = 1e-100
"""Minimum magnitude of a number in the article. The article omits constants below 1e-100, which
only prevent errors such as a division by zero."""
MEETING_SOLUTIONS = sp.Float("4e-15", 20)
"""Maximum sin^2 of half the angle between solutions that coincide. Rounding errors change sin^2 by
about 1e-16, relative to the terms in its formula. If a solution were moved by 1e-8 from its
singular position, later steps would not detect the singularity. If sin^2 is moved by 4e-15 to merge
two solutions, the equation of the solution step has an error of only 4e-15."""
MIN_CONIC = sp.Rational(1, 10**20)
"""Lower bound of the amplitude g of the second harmonic. The coefficients are near 1, with
errors of 1e-16."""
NEARLY_LINEAR = sp.Integer(10) ** 10
"""Maximum sum P + Q of two coefficients for the closed form of the resolvent cubic of a quartic. If
P + Q exceeds this value, the resolvent is linear up to 1e-5, and the closed form loses digits."""
OUTERMOST_ROOT = 1 + sp.Rational(1, 10**9)
"""Maximum accepted root tau. Rounding may move a root slightly out of [-1, 1]."""
MEETING_ROOTS = sp.Rational(1, 10**14)
"""Maximum sin^2 of half the angle between roots that coincide. Rounding separates a double root."""
EVEN_CONIC = sp.Rational(4, 10**15)
"""Maximum coefficient p that is a rounding error. If p is a rounding error, the conic of the
quartic is even in x, and t = 0."""
REAL_LINES = sp.Rational(1, 10**13)
"""Maximum magnitude of a negative slope of the resolvent cubic at t = 0 that counts as a rounding
error. If the slope is not negative, the conic at t = 0 consists of two real lines."""
MIN_SLOPE = sp.Rational(1, 10**10)
"""Maximum slope of the cubic at a triple root that rounding errors have split."""
GREATEST_T = sp.Rational(3, 2)
"""The root t of the resolvent cubic is at most 1. Near a triple root, Newton's method may give
larger values, which are replaced by this value."""
MIN_T = sp.Rational(1, 10**8)
"""Minimum t for which alpha is large enough to divide p by alpha."""
DEPENDENT_ROWS = sp.Rational(1, 10**13)
"""Maximum sine of the angle between linearly dependent rows."""
FARTHEST_POINT = sp.Integer(10) ** 6
"""Upper bound of the magnitude of the vector X in subproblem 6. If subproblem 6 has a solution, the
magnitude of X is at most sqrt(2)."""
ELLIPSES_DAMPING = sp.Rational(1, 10**14)
"""A Newton step on two angles is damped if the squared ratio of the singular values is below this
value."""
LOOP_DAMPING = sp.Rational(1, 10**10)
"""A Newton step on three angles is damped if the squared ratio of the singular values is below this
value. If the Jacobian has rank 1, a squared ratio below 1e-10 can consist of rounding errors
alone."""
NEARLY_REAL = sp.Rational(1, 10**7)
"""Most negative margin at which solutions are refined. For margins below -1e-7, Newton's method
finds other solutions."""
SOLUTION_SEPARATION = sp.Rational(1, 10**7)
"""Distance (radian) of start values from the point at which two solutions meet. An angle from
squared lengths has an error of 1e-8."""
PARABOLA_STEP = sp.Rational(1, 10**5)
"""Maximum step (radian) on the second-order parabola. The maximum step is a hundred times
SOLUTION_SEPARATION, the distance of the start values."""
NEARLY_SOLVED = sp.Rational(1, 10**5)
"""Maximum error (radian, or relative to the arm length) for solving all conditions together. A step
loses at most half of the digits, so a solution is accurate to about 1e-8."""
POSE_DAMPING = sp.Rational(1, 10**12)
"""Minimum squared ratio of singular values for undamped pose steps. Rounding errors are 1e-16."""
DETERMINANT_TAIL = 1e-9
"""Coefficients of a determinant above degree 8 count as zero up to this fraction of the largest
coefficient. Rounding errors are 1e-15."""
SINGLE_SOLUTION = 1e-12
"""Maximum ratio of the second smallest to the largest singular value for which the second smallest
one counts as zero. With two small singular values, the six equations have no unique solution."""
POOR_SEPARATION = 1e-5
"""Minimum separation of the solutions (:attr:`.Choice.separation`). If the separation is below this
value, the solver fixes other joints of the arm. The solutions of arms with six regular joints and a
prismatic joint have separations of at least 1e-4. If the prismatic joint is parallel to two of the
axes, the separation of the solutions is 7e-7."""
ASKED_SEPARATION = 5e-3
"""Minimum separation of the solutions (:attr:`.Choice.separation`) for which the general solver is
practical. If the separation exceeds this value, the general solver may run at every pose of an arm
that nearly has a closed-form structure. A calibrated Panda with a fixed joint has a solution
separation of 2e-2. An iiwa has a solution separation of at most 2e-3, and the general solver takes
five times as long."""
ASKED_MOVE = 0.05
"""Maximum median joint change (radian) between nominal and true solutions for which the general
solver is not needed. If the median joint change exceeds 0.05 rad and the solutions are well
separated, the general solver runs at every pose. Above 0.05 rad, some solutions near a wrist
singularity belong to no nominal branch. For an arm with a wrist offset of 13 mm, the median joint
change is 0.06 rad. Without the general solver, the inverse of this arm missed one of nine tested
configurations. For an IRB 120 with errors of 3.6 mm and 3.6 mrad, the median joint change is 0.02
rad. For all tested arms with errors of up to 3 mm and 3 mrad, the median joint change is below 0.02
rad."""
SEPARATE = 1e-2
"""Minimum joint difference (radian) of two solutions that the roots of the determinant distinguish.
If two roots of the determinant differ by less than 1e-3 rad, their null vectors may be
exchanged."""
NOMINAL_GUARD_DIGITS = 8
"""Number of decimal digits that the exact evaluation of an angle may lose. The test for right
angles ignores the last eight digits."""

# --- latex: printed digits ---

PRINTED_DIGITS = 10
"""Digits of a number without a short exact form in an article. Dots mark omitted digits."""
GIVEN_DIGITS = 17
"""Maximum digits of a number in a file that an article prints completely. A double-precision number
has 17 digits."""
FEW_PRINTED_DIGITS = 6
"""Digits of a printed number if a line has no room for ``PRINTED_DIGITS``."""

# --- emit: tolerances that the runtime reads from the manifest ---

DEAD_POINT = 1e-12
"""Maximum margin of a loop at a dead point (no unit). 1e-12 is sin^2 of a microradian."""

# --- emit: single precision ---

MAX_THRESHOLD = 1e-8
"""Maximum magnitude of a rounding threshold (any unit). Rounding thresholds are compared with
numbers, and never used as numbers. The largest threshold is 4e-15 times the fourth power of twice
the arm length in meters.
"""
FLOOR_EXPONENT = 0.12
"""Exponent that maps the lower bounds 1e-150 and 1e-300 to 1e-18 and 1e-36 for single precision.
The square of 1e-18, and 1e-36 itself, are normal numbers in single precision."""
LARGEST_SINGLE = 1e38
"""In single precision, 1e38 replaces every constant above 1e38. Constants above 1e38 only detect
infinite inputs."""
SOLVED_SINGLE = 2e-5
"""Largest residual (meter or radian) of a solution in single precision. SOLVED_SINGLE is the limit
1e-9 for double precision, multiplied by the square root of 2^29. The number 2^29 is the ratio of
the rounding errors in single and double precision."""
REGULAR = 1e-3
"""Errors in single precision are measured away from singularities. Away from singularities, the
singular values of a Jacobian (no unit, or meter) and the margins of the loops exceed REGULAR. Near
a singularity, the errors have no bound."""

# --- chain: numerical singular configurations ---

FACTORS_VANISH = 1e-9
"""Maximum factor of minors that counts as zero (no unit, or meter for lengths near one meter). The
rounding error of the sums in the factors is 1e-13."""
NO_WORK = 1e-12
"""A configuration is singular if J^T y or J x is at most this long for a unit vector y or x.
Lengths are relative to the arm length. Rounding is 1e-15."""
LAST_STEP = 1e-9
"""Length of the last Newton step to a singular configuration (radian, or relative to the arm
length). After a last step of 1e-9, the printed digits (1e-5) of the configuration are correct. If
two singularities intersect, J^T y becomes small long before q is accurate."""
OTHER_CONFIGURATION = 0.02
"""Minimum distance between different configurations (radian, or relative to the arm length).
Readers notice a difference of about one degree."""
RANK_LOST = 1e-6
"""Maximum smallest singular value of a rank-deficient Jacobian, for an arm with unit length. At
random configurations, the smallest singular value of a regular arm exceeds 1e-3."""

# --- inverse: numerical solutions of a general arm ---

ALMOST_REAL = 1e-3
"""Maximum imaginary part of a half-angle tangent t that is tried as a real root, relative to 1 +
|t|^2. Rounding errors split a double root by 1e-8 times its condition number. Newton's method on
the pose rejects false roots."""
SOLVED_POSE = 1e-13
"""Maximum pose error of a solution (no unit, or relative to the arm length). The rounding error of
six matrix products is a hundred times smaller (1e-15)."""
DISTINCT_SOLUTION = 1e-5
"""Minimum joint difference between two different solutions (radian, or relative to the arm
length)."""
