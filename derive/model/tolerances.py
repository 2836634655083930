"""Every tolerance of the compiler: name, value, unit and reason, by the room that uses it.

Lengths are parts of the robot's characteristic length unless another unit is given. A number
that a formula needs for other reasons (a count of steps, a size of a page) is no tolerance and
stays where it is used.
"""

import sympy as sp

# --- every room: numbers to many digits ---

EVALUATION_DIGITS = 40
"""Decimal digits to which constants are evaluated: more than twice the 16 digits of a double, so
that rounding does not decide comparisons with integers and multiples of pi."""
WORKING_DIGITS = EVALUATION_DIGITS + 20
"""Decimal digits with which constants are computed: chains of named constants lose a few, so that
the 40 digits of each are right."""
RELIABLE_DIGITS = EVALUATION_DIGITS - 8
"""Decimal digits of such a constant that are correct: rounding of the operations in it and
cancellation between them may spoil the last eight."""
ROUNDING = 10.0**-RELIABLE_DIGITS
"""Difference (no unit) below which a constant of order 1 equals an integer: 1e-32, the last of the
reliable digits."""

MOST_WAVES = 0.05
"""Amplitude of a drive's waves (radian) in parts of its gain up to which three steps of Newton's
iteration invert its law to rounding: each squares the error, which a quarter of this bounds first.
Real ones stay below 0.001."""
MOST_SAG = 0.05
"""Change of a joint's sag by the coordinates, in parts of their own change, up to which twelve
rounds invert the law of springs to rounding: each reduces the error by this part."""

# --- description: rounding in files ---

NOISE = 1e-9
"""Difference between a number of a file and a short decimal that is noise: part of the robot's
longest length, radian, or part of a direction's largest component. Exporters compose poses in
floats and round to nine places or more, and 1e-9 rad moves a tool at 1 m by 1 nm."""
LARGE_CLEANING = 5e-4
"""Change of the tool's position (metre) by noise removal from which a warning names it: more than
an arm repeats its poses by."""
NOISE_GAP = 1000
"""Ratio of a decimal's last place to a difference that is noise (no unit): three zeros or nines
follow the decimal, as they do in one of 500 numbers that are meant."""
CONTINUOUS_MODEL = 0.02
"""Least displacement of an axis, in parts of the arm's length and radian, that numbers of norm 1 in
the same units must give: where it is less, a number of the convention moves fifty times as far as
the axis, so that an error of assembly of 1 mrad takes 50 mrad of it. A common normal of axes 6 mrad
from parallel, as a factory calibration leaves them, gives less than 1e-4."""
DOUBLE = 1e-15
"""Relative difference of a decimal from a double that it is written for (no unit): 15 digits. One
number of 10^7 is as close to a number of single precision by chance."""
SINGLE = 2.0**-23
"""Relative difference of a number of single precision from the number that it is rounded from (no
unit): one unit in its last place, for a computation that rounds twice."""
ANGLE_SNAP = NOISE
"""Difference (radian) within which an angle of a file becomes a multiple of pi/12, however many
digits are written."""
CHANCE = 0.01
"""Part of all angles that may be taken for a multiple of a step by their few digits: the ratio of
the last place to the step. 1.57 is a right angle; 0.79 is not 45 degrees, and 0.785 is."""
LONGEST_LENGTH = 20.0
"""Length (metre) above which the unit must be stated: links of arms are shorter than 10 m, and
an arm in millimetres has a link above 20."""
SHORTEST_ARM = 1e-3
"""Length (metre) below which a whole arm is questioned: arms of a desk are some 0.1 m long."""
LARGEST_ANGLE = 6.5
"""Angle (radian) above which the unit must be stated: a turn and its rounding, 6.2832 or 6.3."""
MOST_TURNED = 45.0
"""Limit of a joint (radian) from which it may be meant in degrees: seven turns, which joints that
turn on and on seldom have."""
UNLIMITED = 10_000
"""Width of a joint's range (radian or metre) from which the file means a joint without limits:
exporters write 1e4 to 1e16 where a field must not be empty, and no axis turns 1,600 times."""
AXIS_DIGITS = 25
"""Digits of the angles of an axis without a short exact form: 1e-25 rad is far below the rounding
of doubles, and roots of long fractions, which SymPy would factorize, are avoided."""
SHORT_PROPORTION = 1000
"""Greatest whole number in the proportions of a direction with a short exact form."""
GIMBAL_LOCK = 1e-14
"""Part of a quaternion (no unit) below which roll and yaw turn about one axis: rounding of doubles
leaves 1e-16 there, and the direction of so small a part would be mostly rounding."""
COMPILED_DECIMALS = 14
"""Decimals (metre, radian) of numbers that another program computed from a file's: rounding leaves
1e-16 of a metre or two, and nobody writes more than 13 decimals."""
COMPILED_ANGLE = 1e-13
"""Difference (radian) of such an angle from the file's: a few roundings of an angle of some pi."""
CALIBRATED_TOOL = 0.05
"""Metre, and norm of a difference of rotations: the farthest that a factory calibration moves the
tool of an arm at zero. Calibrations move it by millimetres, another type by 80 mm or more."""
LENGTH_SCALING = 1e-10
"""Deviation (m or rad, at lengths of about 1 m) from a linear or a constant function above which an
expression does not scale with the file's lengths: at 15 digits, rounding gives about 1e-14, and
a wrong expression by about its own value."""

# --- terms, chain: numbers that are integers ---

MEANT = 1e-100
"""Magnitude (no unit) below which a constant other than 0 keeps its value: rounding of numbers of
order 1 leaves no less than about 1e-40, so that a constant of 1e-150 comes from the file itself."""
UNIT_VECTOR = 1e-12
"""Difference of a unit vector's squared length from 1 (no unit): rounding of its components leaves
about 1e-15. A vector of exact numbers must be of length 1 exactly."""

# --- loops: closures, ranks, branches ---

BRANCHES_APART = 1e-6
"""Two branches whose distances from the reference differ by less are not told apart.

Root of a sum of squared radians and parts of the mechanism's size. The distances come from doubles
through a few roots, which leaves about 1e-8 near a dead point; a reference is given by hand, to
three digits.
"""
OFF_BRANCH = 1e-6
"""Gap of a joint (parts of the mechanism's size, radian) above which a branch does not exist.

Doubles through a few roots leave about 1e-8 near a dead point; a joint that does not fit is off by
about its own length.
"""
LOOPS_AGREE = 1e-6
"""What loops may leave (parts of the mechanism's size, entries of axes) of joints given together.

More joints of the main chain than freedoms are known to 1e-8 near a dead point; joints that do not
belong together are off by more than a person can set.
"""
OFF_AXIS = 1e-12
"""Square metre, from which on a point at the reference is not on an axis."""
ZERO_COMPONENT = 1e-25
"""Components of vectors below this are zero (pure number, or metre where points are compared).

They are computed to 40 digits: 15 of them remain for rounding, and nothing that a description means
to be different from zero is as small.
"""
CLOSED_LOOP = 1e-12
"""Residual below which a loop is closed in double precision (metre, or sine of an angle)."""
NEARLY_DEAD = 1e-3
"""sin^2 of a transmission angle at the reference up to which another ring of pins is solved first:
two degrees from a dead point, a tenth of a millimetre moves joints by milliradians."""
CLEAR_LEG = 0.25
"""sin^2 of a transmission angle at the reference below which a leg waits for one that gives the
same joint and is farther from its dead point: 30 degrees, by which joints turn in use."""
VANISHED = 1e-12
"""Part of the longest of some vectors up to which a vector may be the zero that exact arithmetic
finds: rounding leaves 1e-16 of it, and more only makes the exact test run."""
FOUND_LOOP = 1e-10
"""Residual (metre, or sine of an angle) above which an implicit function of CasADi found no closed
loop: its last step is 1e-14, and where equations repeat each other it iterates on their squares."""
ZERO_SINGULAR_VALUE = 1e-9
"""Singular values below this part of the largest are zero (pure number).

Far above the rounding of a Jacobian at a closed configuration (1e-15), far below the smallest
singular value away from singularities (1e-3).
"""
REPEATED_EQUATION = 1e-4
"""Singular values of equations that repeat others near closure, as parts of the largest.

A residual of 1e-12 may be 1e-6 away from closure there, and such equations still look independent.
"""
REPEATED_AS_BUILT = 0.02
"""The same of a robot as built, whose equations that repeat others look independent by the tilt of
its axes: ten times what axes 2 mrad out of parallel were seen to leave."""
WORTHWHILE_STEP = 0.9
"""A step of Newton's method that leaves more than this part of the residual is shortened."""
SAMPLED_RANGE = 0.3
"""Distance of random configurations from the reference: radian, and part of the mechanism's size.

Large enough to leave a singular reference, small enough for Newton's method to close the loops.
"""
NEIGHBOURHOOD = 0.02
"""Distance within which closed configurations are the reference's: radian, or part of the size.

Farther off, Newton's method may end in another assembly, which has other freedoms. Large enough for
singular values that vanish at the reference to show (4e-4 where they grow as the square).
"""
GAP = 1e-7
"""Gap up to which a loop counts as closed in a search in numbers: part of the mechanism's size, or
radian. A search by differences ends some 1e-10 from closure, and at a dead point, where the gap
grows by the square of the motion, an angle is then right to 3e-4 rad."""
DIFFERENCE_STEP = 1e-6
"""Step of central differences in such a search: radian, or part of the mechanism's size. Its square
and the rounding of a double over it are both below 1e-9."""
WORTHWHILE_GAIN = 1e-5
"""Part of the squared gap (no unit) by which iterations must lower it that seek the smallest."""
CLOSING_GAIN = 3e-3
"""The same in a search for closed loops (no unit): with less, eighty iterations would leave three
quarters of the squared gap, where closing takes fourteen orders of magnitude."""
SAME_POINT = 1e-9
"""Points of a drawing closer than this are one (metre), and so are directions (pure number).

Closed loops in doubles leave 1e-12; the eye sees no less than 1e-4 of a robot's size.
"""
MOVED_REFERENCE = 0.3
"""A described value this far from the closed reference is told: radian, or part of the size.

Values written by eye are some 10 degrees off; another assembly is mostly farther away.
"""
PIN_ACROSS = 0.1
"""Cosine of the angle between a pin and its strut up to which the pin is across it (no unit).

Pins as built tilt by hundredths; a frame that gives the point of an end alone may lie anyhow.
"""
SAME_VIEW = 1e-6
"""Directions of a solved configuration are parallel to this angle in a drawing (radian).

A configuration that closes overconstrained loops is known to about 1e-7.
"""
LAYOUT_TIE = 1e-5
"""Numbers this close to the middle between two tenths of a millimetre are rounded up (0.1 mm).

Machines differ in the last digits of these numbers; the bytes of a drawing must not.
"""
DRAWN_AS_ONE = 1e-6
"""Points of a body nearer than this part of the robot's size are drawn as one.

The eye sees a hundred times as much, and exact placements in doubles leave 1e-15.
"""
DRAWN_DIGITS = 9
"""Decimal digits of a drawn point in parts of the robot's size, and of a drawn direction (no unit).

The eye sees four; five more leave out what machines differ in, and hold whole micrometres.
"""

# --- loops: paths of complex poses, of length 1 in Study's coordinates ---

PATH_NEAR = 1e-4
"""First Newton correction behind a step along a path; above it another path may be as near."""
PATH_ON = 1e-7
"""Second correction: of the order of the square of the first."""
SHORTEST_PATH_STEP = 1e-9
"""Part of a path below which a step is given up: its end is singular, or at infinity."""
POSES_ARE_ONE = 1e-8
"""1 - |<x, y>| of two poses that are one: each is known to 1e-12, its square is what counts."""
SINGULAR_POSE = 1e11
"""Condition number at which a pose counts as singular for generic rods; those that are not have
some 1e4."""
POSE_AT_INFINITY = 1e-10
"""|e.e| of a pose at infinity: no rotation has e.e = 0."""
NO_FRAME = 1e-9
"""Metres below which a middle of points counts as the origin."""
RODS_SPAN = 1e-9
"""Singular value, in parts of the greatest, below which rods do not move in a direction."""

# --- inverse: structures, boundaries of subproblems, determinants ---

EXACT_STRUCTURE = 1e-9
"""Radian, or parts of the arm's length: axes that miss a structure by no more have it.

A file's decimals are read exactly, so that only rounding of the judgement in floats is bridged.
"""
MEASURED_STRUCTURE = 5e-3
"""Radian, or parts of the arm's length: axes that miss a structure by no more are meant to have it.

It bounds the errors of a measured arm: some millimetres a metre, some milliradians.
"""
NEARLY_STRUCTURE = 3e-2
"""Radian, or parts of the arm's length: deviations up to which a structure is tried on an arm that
misses it. Newton's iteration leads from the nominal arm to the true one or does not, and that
decides; from farther away it rarely does."""
LED = 0.9
"""Share of random configurations, to which a nominal arm has to lead: about one in ten is near a
singularity, where the displacement between two arms moves solutions anywhere."""
LED_UNLIKELY = 0.85
LED_CLEARLY = 0.95
"""Shares to which the nominal configurations beside them lead, between which that of all nominal
solutions is asked for: on 70 arms it was less than 0.03 smaller and at most 0.05 larger."""
LED_BESIDE = 0.5
"""Share of random configurations beside which a nominal arm has a branch: of arms that lead, nearly
all; of an arm whose nominal inverse takes other postures, none."""
LED_BACK = 1e-6
"""Radian, or parts of the arm's length, up to which the iteration is back at a configuration: eight
steps leave 1e-14 off singularities."""
LED_STEP = 0.3
"""Metres or radians that a coordinate may move in such a step: further away lies another branch."""
LOST = 1e-5
"""Radian, or metre for arms of a metre and more, from which a reachable pose is lost: the runtime's
refinement begins up to there, where rounding may have spoilt a solution."""
JACOBIAN_RANK = 1e-9
"""A singular value of the Jacobian, lengths in parts of the arm's, that is 0 but for rounding."""
OBLIQUE_AXES = 1e-3
"""Sine of an angle between axes below which a slide does not determine the point it moves."""
TOOL_ON_AXIS = EXACT_STRUCTURE
"""Metre and sine up to which the tool lies on the axis of its joint, or in the base's plane."""
INDEPENDENT_SLIDES = EXACT_STRUCTURE
"""A singular value of unit directions up to which they are linearly dependent."""
UNDETERMINED_SUM = sp.Float("5e-10", 20)
"""Sine of the angle between axis 6 and axes 2 to 4 up to which they are taken for parallel.

The sum of the angles 2 to 4 is then chosen to bring the elbow within reach, at the cost of an
orientation error of no more than this.
"""
UNDETERMINED_TURN = sp.Float("2e-10", 20)
"""Metre: distance of a point from an axis up to which a turn about it counts as not moving it.

The turn is then chosen for the joints behind it, which moves the point by twice this at most.
"""
DIRECTION_FLOOR = sp.Float("1e-150", 20)
"""Added to the first of two numbers whose direction is computed, and to divisors that may be 0.

It changes no number above 1e-134, its square does not underflow, and the direction of (0, 0) is the
angle 0 instead of 0/0.
"""
VECTOR_FLOOR = sp.Float("1e-140", 20)
"""Part of a second vector that is added to one that may be 0; it changes no other vector."""
GREATEST_NUMBER = 1e300
"""Sums of magnitudes of inputs (metre or pure number) above it count as infinite."""
DIVISOR_FLOOR = sp.Float("1e-300", 20)
"""Added to a divisor that is a sum of squares and may be 0."""
ARTICLE_ZERO = 1e-100
"""Numbers below it are such floors, which the article leaves out."""
MEETING_SOLUTIONS = sp.Float("4e-15", 20)
"""sin^2 of half the angle between two solutions that are one.

Rounding moves it by some 1e-16 of its terms. A solution moved off its singular place by 1e-8 would
leave nothing of the singularity to the steps behind it, and to meet the equation to 4e-15 costs
nothing.
"""
LEAST_CONIC = sp.Rational(1, 10**20)
"""The least g of a trigonometric polynomial whose coefficients are about 1, rounded to 1e-16."""
NEARLY_LINEAR = sp.Integer(10) ** 10
"""P + Q above which the resolvent is linear to 1e-5, and its closed form loses digits."""
OUTERMOST_ROOT = 1 + sp.Rational(1, 10**9)
"""A root tau up to here has been moved out of [-1, 1] by rounding."""
MEETING_ROOTS = sp.Rational(1, 10**14)
"""sin^2 of half the angle between two roots that are one: rounding separates a double root so."""
EVEN_CONIC = sp.Rational(4, 10**15)
"""A coefficient p up to here is rounding, and the conic is even in x: t = 0."""
REAL_LINES = sp.Rational(1, 10**13)
"""Negative slope of the cubic at 0 down to which the lines of t = 0 are real but for rounding."""
LEAST_SLOPE = sp.Rational(1, 10**10)
"""Slopes of the cubic below it belong to a triple root that rounding has separated."""
GREATEST_T = sp.Rational(3, 2)
"""Bound of t, which is at most 1, after a step from a triple root."""
LEAST_T = sp.Rational(1, 10**8)
"""Below this t, alpha is too small a divisor of p."""
DEPENDENT_ROWS = sp.Rational(1, 10**13)
"""Sine of the angle between rows that are linearly dependent but for rounding."""
FARTHEST_POINT = sp.Integer(10) ** 6
"""Bound of the point X of subproblem 6; beyond sqrt(2) there is no solution."""
ELLIPSES_DAMPING = sp.Rational(1, 10**14)
"""Least square of the singular values' ratio at which Newton steps on two angles are not damped."""
LOOP_DAMPING = sp.Rational(1, 10**10)
"""The same of three angles; less would drown in rounding where the Jacobian has rank 1."""
NEARLY_REAL = sp.Rational(1, 10**7)
"""A negative margin down to which solutions are refined; Newton would find others beyond."""
SOLUTION_SEPARATION = sp.Rational(1, 10**7)
"""Radian from their common point at which solutions start that squares of lengths do not separate.

Squares give an angle to 1e-8.
"""
PARABOLA_STEP = sp.Rational(1, 10**5)
"""Radian: bound of a step on the parabola of second order, a hundred times that separation."""
NEARLY_SOLVED = sp.Rational(1, 10**5)
"""Radian and part of the arm's length: an error from which all conditions are met at once.

A step loses at most half of the digits, so that a solution is off by some 1e-8.
"""
POSE_DAMPING = sp.Rational(1, 10**12)
"""Least square of the singular values' ratio at which steps on a pose are not damped; the normal
equations are rounded to 1e-16."""
DETERMINANT_TAIL = 1e-9
"""Relative size up to which degrees above 8 of a determinant are 0: rounding leaves 1e-15."""
SINGLE_SOLUTION = 1e-12
"""Ratio of the second smallest singular value to the greatest, below which it is 0.

The six equations do not single out a solution then.
"""
POOR_SEPARATION = 1e-5
"""Separation of a choice of splits (:attr:`.Choice.separation`) below which other joints are rather
given: arms whose slide leaves six others regular have 1e-4 and more, one with a slide along two of
the axes 7e-7."""
ASKED_SEPARATION = 5e-3
"""Separation of a choice of splits (:attr:`.Choice.separation`) above which its solver is quick and
sure enough to be asked at every pose of an arm that nearly has a structure.

A calibrated Panda with a given joint has 2e-2. An iiwa has 2e-3 and less, where the solver takes
five times as long.
"""
ASKED_MOVE = 0.05
"""Radian: median move of the joints from a nominal solution to its true one, above which the
general solver is asked at every pose, if its separation allows.

Near a wrist's singularity such an arm has solutions that no branch of the nominal arm shows: of a
wrist that is 13 mm off (0.06), 1 of 9 configurations at right angles was missed. An IRB 120 with
errors of 3.6 mm and mrad has 0.02, other arms with up to 3 mm and mrad less.
"""
SEPARATE = 1e-2
"""Radian: solutions that are further apart in a joint are told apart by its roots.

Ten times as far as two roots that may have the vectors of each other.
"""
NOMINAL_GUARD_DIGITS = 8
"""Decimal digits of an exact evaluation that an angle may lose before it is no right angle."""

# --- latex: digits that are printed ---

PRINTED_DIGITS = 10
"""Digits of a number without a short exact form in an article; dots follow where digits are cut."""
GIVEN_DIGITS = 17
"""Most digits of a number that a file gives, which an article prints in full: a double has 17."""
FEW_PRINTED_DIGITS = 6
"""Digits of such a number where a line has no room for ``PRINTED_DIGITS``."""

# --- emit: tolerances that the runtime reads from the manifest ---

DEAD_POINT = 1e-12
"""Margin, a pure number, up to which a loop counts as at its dead point: sin^2 of a millionth of a
radian."""

# --- chain: singular configurations in numbers ---

FACTORS_VANISH = 1e-9
"""Value of factors of minors up to which they are 0 (no unit, or metre beside lengths of about a
metre): ten thousand times the rounding of their sums."""
NO_WORK = 1e-12
"""Length of J^T y or J x, with y or x of length 1 and lengths in parts of the arm's, up to which a
posture is singular: a thousand times the rounding of a Jacobian's entries."""
LAST_STEP = 1e-9
"""Length of the last of Newton's steps (radian, parts of the arm's length) to a singular posture:
its printed digits, 1e-5, are then sure. Where two singularities cross, J^T y is short long before q
is known."""
OTHER_POSTURE = 0.02
"""Distance (radian, parts of the arm's length) between postures that count as different: about a
degree, which a reader sees."""
RANK_LOST = 1e-6
"""Singular value of a Jacobian, lengths in parts of the arm's, below which it has lost rank: at
drawn postures an arm of full rank has more than 1e-3, one without it rounding."""

# --- inverse: solutions of a general arm in numbers ---

ALMOST_REAL = 1e-3
"""Imaginary part of the tangent of half an angle, in parts of 1 + |t|^2, up to which a root is
tried as a real one: double roots split by the root of rounding, 1e-8, times their condition.
Newton's iteration on the pose rejects the others."""
SOLVED_POSE = 1e-13
"""Difference of a pose from the target (no unit, parts of the arm's length) of a solution: a
hundred times the rounding of six products of matrices."""
DISTINCT_SOLUTION = 1e-5
"""Difference of a joint (radian, parts of the arm's length) from which two solutions are different
ones: their printed decimals differ from 1e-4 rad on."""
