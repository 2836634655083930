/* All tolerances and gains of the C runtime with value, unit and reason, by solver.
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

/* A pose counts as rounded up to this deviation [rad] from a rigid pose. The deviation is the
 * distance |R_1 - R_2| / 2^0.5 from a rotation, or the error of an entry of the last row. Single
 * precision causes deviations of 1e-7; six printed digits, or products of many rounded poses, cause
 * 1e-6. */
#define NEARLY_RIGID 1e-5

/* Maximum deviation [rad] of a rigid pose. A product of 100 poses in doubles deviates by 1e-14. */
#define RIGID_TO_ROUNDING 1e-13

/* Maximum least-squares residual of a solution for a rounded pose, relative to the rounding. For
 * arms with fewer than six joints, 1 of 1000 residuals is more than four times the rounding. */
#define ROUNDED 10.0

/* Maximum deviation of a rounded rotation, relative to half a unit of the last digit: nine rounded
 * entries cause up to 2.1. */
#define ROUNDED_OFF 4.0

/* Number of last-decimal units per meter: 1e5 for five decimals. Handwritten lengths have at most
 * five decimals. A translation with six to eight decimals counts as rounded. With nine decimals,
 * the rounding error is below SOLVED. */
#define WRITTEN_DECIMALS 1e5
#define FEWEST_DECIMALS 1e6
#define MAX_DECIMALS 1e8

/* Maximum deviation of a number with up to nine decimals from a multiple of the last decimal, in
 * units of the last decimal. Double precision causes deviations of up to 1e-7 units. */
#define ROUNDED_NUMBER 1e-6

/* Deviation at which the polar iteration ends, above the rounding error 2e-16 of R^T R. */
#define POLAR_CONVERGED 4e-16

/* ------------------------------------------------------ singular values, linear solves */

/* Maximum cosine between orthogonal rows; rounding adds 1e-16 per product. Entries also have
 * rounding errors of 1e-15, relative to the norm of the matrix. */
#define SVD_ORTHOGONAL 1e-15

/* Minimum singular value relative to the largest singular value. Singular vectors of singular
 * values below the minimum are replaced by unit vectors orthogonal to the other vectors. */
#define SVD_NULL 1e-13

/* Minimum squared length of an axis component outside the span of the vectors found so far; if all
 * components are smaller, the span is complete. */
#define SVD_NOTHING_LEFT 1e-6

/* Minimum pivot of a symmetric matrix, dimensionless. MIN_PIVOT replaces pivots that rounding
 * errors make negative. */
#define MIN_PIVOT 1e-300

/* ------------------------------------------- inverse kinematics by Levenberg-Marquardt */

/* Initial mu of an attempt, with lambda = mu |W e|^2 / 2 [1 / radian^2 or 1 / meter^2]. */
#define LM_FIRST_MU 0.1

/* Factors on mu after an accepted and after a rejected step. A rejected step costs an evaluation,
 * excessive damping only some progress. */
#define LM_MU_DECREASE 0.3
#define LM_MU_INCREASE 8.0

/* Range of lambda, in the unit of J^T J. J^T J may be singular, with a rounding error of 1e-16.
 * If lambda is above the maximum, steps are too short to reduce the error. */
#define LM_MIN_LAMBDA 1e-14
#define LM_GREATEST_LAMBDA 1e8

/* Maximum and minimum step [radian or meter]. The Jacobian is valid up to the maximum step. The
 * minimum step is the resolution of doubles near 1. */
#define LM_LONGEST_STEP 1.0
#define LM_SHORTEST_STEP 1e-15

/* Minimum relative reduction of the squared error per step; reductions below this value end the
 * attempt. With HASTY, an attempt ends after a few steps. With PATIENT, an attempt continues to the
 * minimum error. */
#define LM_HASTY_GAIN 0.2
#define LM_PATIENT_GAIN 1e-12

/* Below this residual [meter or radian], every attempt continues to the minimum error, because
 * convergence is slow near a singular solution. */
#define LM_NEAR_SOLUTION 1e-5

/* Halley's step is tried below the residual HALLEY_RESIDUAL [meter or radian], if the LM step
 * leaves more than the fraction HALLEY_REMAINDER of the squared error. */
#define HALLEY_RESIDUAL 0.03
#define HALLEY_REMAINDER 0.2

/* ------------------------------------------------------- joint rates and path tracking.
 *
 * Below the threshold e, the damped inverse of a singular value s is
 *
 *     s / (s^2 + lambda^2),   lambda^2 = (1 - (s / e)^2) d^2,   where d is the damping of s = 0.
 *
 * In the function joint_rates, d equals e. Then the damped inverse is s / e^2, at most 1 / e, so
 * that rates are bounded. */

/* The function joint_rates uses this value for e and d by default, dimensionless. Joint rates are
 * then at most 25 times the twist. The value is 1/4 of the median smallest singular value at random
 * configurations of six-axis arms.
 */
#define RATES_DAMPING_THRESHOLD 0.04

/* Minimum threshold e and minimum damping d of path tracking, dimensionless; e is not less than d.
 * TRACK_BORDER and TRACK_DAMPING are smaller than RATES_DAMPING_THRESHOLD, because track also
 * limits the rates, and damping causes tool errors. */
#define TRACK_BORDER 0.02
#define TRACK_DAMPING 0.02

/* Maximum damping d of tracking (dimensionless). The entries of a Jacobian far from singularities
 * are about 1. */
#define TRACK_GREATEST_DAMPING 1.0

/* Ratio of actual to predicted reduction of the squared error. Below POOR the damping is multiplied
 * by RAISE, above GOOD it is divided by LOWER (Marquardt). Slow reduction of the damping avoids
 * oscillation when the path crosses a singularity. */
#define TRACK_POOR_STEP 0.25
#define TRACK_GOOD_STEP 0.75
#define TRACK_RAISE_DAMPING 2
#define TRACK_LOWER_DAMPING 1.05

/* Minimum predicted reduction relative to the squared error; reductions below this value are
 * rounding errors. */
#define TRACK_NO_DECREASE 1e-12

/* Maximum scalar product of two orthogonal rows, divided by the square of the longer row. A product
 * below this value is negligible compared with the damping. */
#define BOX_ORTHOGONAL 1e-13

/* Null-space damping relative to the threshold e, which keeps the bounded problem positive
 * definite. */
#define BOX_NULL_SPACE_DAMPING 1e-4

/* Minimum multiplier that releases a variable from its bound, relative to the largest gradient
 * component. Multipliers below the minimum are rounding and could make the active set cycle. */
#define BOX_RELEASE 1e-10

/* Minimum null-space projection of the secondary rates, relative to these rates. */
#define NULL_MOTION 1e-12

/* Below this difference, components of a unit vector count as equal, so that rounding does not
 * select the sign of the singular direction. */
#define DIRECTION_TIE 1e-9

/* Maximum difference [rad or length] between solutions that count as equal, modulo 2 pi. The search
 * for equal solutions divides the coordinates into cells with at least this width. */
#define SAME_TURNS 1e-9

/* Rounding error of the distance to a limit, relative to |q| / dt and to the previous rate. The
 * acceleration of a braking joint may exceed its limit by the rounding error of the distance. */
#define BRAKING_ROUNDING (8 * DBL_EPSILON)
