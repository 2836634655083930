/* All tolerances and gains of the C runtime by solver, with value, unit and reason.
 *
 * Values that are "dimensionless" belong to scaled Jacobians: lengths are divided by the
 * characteristic length of the robot. */
#pragma once

#include <float.h>

/* -------------------------------------------- tolerances: logarithm of a displacement */

/* Below this angle a [rad], (1 - (a/2) cot(a/2)) / a^2 is replaced by its limiting value 1/12, to
 * avoid cancellation. The error of the value 1/12 is a^2 / 720 < 2e-11. */
#define LOGARITHM_SMALL_ANGLE 1e-4

/* ------------------------------------------------------------------ rigid poses */

/* Maximum deviation [rad] of a rounded pose from a rigid pose. The deviation is the distance |R_1 -
 * R_2| / 2^0.5 from a rotation, or the error of an entry of the last row. Single precision causes
 * deviations of 1e-7; six printed digits, or products of many rounded poses, cause 1e-6. */
#define NEARLY_RIGID 1e-5

/* Maximum deviation [rad] at which a pose counts as exactly rigid. A product of 100 poses in
 * doubles deviates by 1e-14. */
#define RIGID_TO_ROUNDING 1e-13

/* Maximum least-squares residual of a solution for a rounded pose, relative to the rounding error.
 */
#define ROUNDED 10.0

/* Maximum deviation of a rounded rotation, in half units of the last digit. */
#define ROUNDED_OFF 4.0

/* Decimal steps per meter: 1e5 for lengths with five decimals. Handwritten lengths have at most
 * five decimals. A translation with six to eight decimals counts as rounded. With nine decimals,
 * the rounding error is below SOLVED. */
#define WRITTEN_DECIMALS 1e5
#define FEWEST_DECIMALS 1e6
#define MAX_DECIMALS 1e8

/* A number counts as rounded to k decimals (k at most nine) if its distance from the nearest
 * multiple of 10^-k is at most this fraction of 10^-k. */
#define ROUNDED_NUMBER 1e-6

/* Deviation at which the polar iteration ends, above the rounding error 2e-16 of R^T R. */
#define POLAR_CONVERGED 4e-16

/* ------------------------------------------------------ singular values, linear solves */

/* Maximum cosine between orthogonal rows; rounding adds 1e-16 per product. Entries also have
 * rounding errors of 1e-15, relative to the norm of the matrix. */
#define SVD_ORTHOGONAL 1e-15

/* Minimum singular value relative to the largest singular value. If a singular value is below the
 * minimum, its singular vector is replaced by a unit vector orthogonal to the other singular
 * vectors. */
#define SVD_NULL 1e-13

/* Minimum squared length of an axis component normal to the span of the vectors. */
#define SVD_NOTHING_LEFT 1e-6

/* Minimum pivot of a symmetric matrix, dimensionless. MIN_PIVOT replaces pivots that rounding
 * errors make negative. */
#define MIN_PIVOT 1e-300

/* ------------------------------------------- inverse kinematics by Levenberg-Marquardt */

/* Initial mu of an attempt, with lambda = mu |W e|^2 / 2 [1 / radian^2 or 1 / meter^2]. */
#define LM_FIRST_MU 0.1

/* Factors of the damping mu: LM_MU_DECREASE after accepted, LM_MU_INCREASE after rejected steps. */
#define LM_MU_DECREASE 0.3
#define LM_MU_INCREASE 8.0

/* Range of lambda, in the unit of J^T J. If lambda is above the maximum, steps are too short to
 * reduce the error. */
#define LM_MIN_LAMBDA 1e-14
#define LM_GREATEST_LAMBDA 1e8

/* Maximum and minimum step [radian or meter]. A step shorter than the maximum step keeps the
 * Jacobian accurate. */
#define LM_LONGEST_STEP 1.0
#define LM_SHORTEST_STEP 1e-15

/* Minimum relative reduction of the squared error per step. An attempt ends after two consecutive
 * steps with smaller reductions. With LM_HASTY_GAIN, an attempt ends early. With LM_PATIENT_GAIN,
 * an attempt ends at the minimum error. */
#define LM_HASTY_GAIN 0.2
#define LM_PATIENT_GAIN 1e-12

/* Below this residual [meter or radian], every attempt continues to the minimum error. */
#define LM_NEAR_SOLUTION 1e-5

/* Halley's step is tried under two conditions: the residual is below HALLEY_RESIDUAL [meter or
 * radian], and more than the fraction HALLEY_REMAINDER of the squared error remains after the LM
 * step. */
#define HALLEY_RESIDUAL 0.03
#define HALLEY_REMAINDER 0.2

/* ------------------------------------------------------- joint rates and path tracking.
 *
 * Below the threshold e, the damped inverse of a singular value s is
 *
 * s / (s^2 + lambda^2), lambda^2 = (1 - (s / e)^2) d^2, where d is the damping of s = 0.
 *
 * The function joint_rates uses the damping d = e. Then the damped inverse is s / e^2, at most 1 /
 * e, so that rates are bounded. */

/* Default threshold e and damping d of the function joint_rates (dimensionless). */
#define RATES_DAMPING_THRESHOLD 0.04

/* Minimum threshold and minimum damping of path tracking (dimensionless). The threshold is at least
 * as large as the damping. */
#define TRACK_BORDER 0.02
#define TRACK_DAMPING 0.02

/* Maximum damping d of tracking (dimensionless). */
#define TRACK_GREATEST_DAMPING 1.0

/* Ratio of the actual reduction of the squared error to the predicted reduction. Below POOR the
 * damping is multiplied by RAISE, above GOOD it is divided by LOWER (Marquardt). Slow reduction of
 * the damping avoids oscillation when the path crosses a singularity. */
#define TRACK_POOR_STEP 0.25
#define TRACK_GOOD_STEP 0.75
#define TRACK_RAISE_DAMPING 2
#define TRACK_LOWER_DAMPING 1.05

/* Minimum predicted reduction relative to the squared error; smaller reductions are rounding
 * errors. */
#define TRACK_NO_DECREASE 1e-12

/* Rows count as orthogonal if their scalar product, divided by the longer row's squared norm, is at
 * most this value. */
#define BOX_ORTHOGONAL 1e-13

/* Damping in the null space, relative to the threshold e. */
#define BOX_NULL_SPACE_DAMPING 1e-4

/* If the multiplier of a variable exceeds this fraction of the largest gradient component, the
 * variable is released from its bound. Smaller multipliers are rounding errors and could cause
 * endless changes of the active set. */
#define BOX_RELEASE 1e-10

/* Minimum size of the secondary rates after the null-space projection, relative to their size
 * before the projection. */
#define NULL_MOTION 1e-12

/* Below this difference, components of a unit vector count as equal, so that rounding does not
 * select the sign of the singular direction. */
#define DIRECTION_TIE 1e-9

/* Maximum difference [rad or length] between solutions that count as equal, modulo 2 pi. The search
 * for equal solutions divides the coordinate space into cells. No side of a cell is shorter than
 * this value. */
#define SAME_TURNS 1e-9

/* Rounding error of the rate bounds, relative to |q| / dt + |previous rate|. The acceleration of a
 * braking joint may exceed its limit by the rounding error of the distance. */
#define BRAKING_ROUNDING (8 * DBL_EPSILON)
