/* Every tolerance and gain of the runtime in C: name, value, unit and reason, by the solver that
 * uses it. Counts of steps and sizes of tables are no tolerances: they stand where they are used.
 *
 * "Pure number" means that rows and columns of the Jacobian have been scaled to one unit: lengths
 * are divided by the robot's characteristic length.
 */
#ifndef CHASLES_TOLERANCES_H
#define CHASLES_TOLERANCES_H

#include <float.h>

/* -------------------------------------------- logarithm of a rigid displacement */

/* radian. Below this angle the coefficient (1 - (a/2) cot(a/2)) / a^2 is replaced by its limit
 * 1/12: the quotient loses digits by cancellation, the limit is off by a^2 / 720 < 2e-11. */
#define LOGARITHM_SMALL_ANGLE 1e-4

/* ------------------------------------------------------------------ rigid poses */

/* Radian: distance of a matrix from a rotation in the norm |R_1 - R_2| / 2^0.5, which is the angle
 * between near rotations; the same for each entry of the last row. Up to here a pose is rounded,
 * and the nearest rotation is taken for it: single precision is 1e-7 off, six printed digits 1e-6,
 * a product of many such poses some 1e-6. What is further off is an error of other kinds. */
#define NEARLY_RIGID 1e-5

/* The same distance up to which a matrix is rigid: products of a hundred poses in doubles leave
 * 1e-14, and solutions are judged by 1e-9. */
#define RIGID_TO_ROUNDING 1e-13

/* Residual up to which a least error reaches a pose that rounding has moved off a rigid one, as a
 * multiple of that distance: rounding moves a pose as far from those that an arm of fewer than six
 * joints reaches, and one in a thousand four times as far. */
#define ROUNDED 10.0

/* Parts of half a unit of the last digit by which rounding can move a rotation off a rigid one:
 * nine numbers by half a unit each make 2.1. */
#define ROUNDED_OFF 4.0

/* Units in one, of the decimals of lengths as people write them at most, and of the fewest and the
 * most by which a translation counts as rounded: six printed digits, and eight. More leave less
 * than the residual of a solution. */
#define WRITTEN_DECIMALS 1e5
#define FEWEST_DECIMALS 1e6
#define MOST_DECIMALS 1e8

/* Parts of a unit of the ninth decimal by which a number of nine decimals differs from it in double
 * precision: 1e-7, tenfold. */
#define ROUNDED_NUMBER 1e-6

/* The same distance at which Newton's iteration ends: rounding of R^T R leaves 2e-16. */
#define POLAR_CONVERGED 4e-16

/* ------------------------------------------------------ singular values, linear solves */

/* Cosine. Two rows are orthogonal where the cosine between them is at most this: rounding adds
 * 1e-16 for each product. The same part of the norm of the whole matrix is rounding too. */
#define SVD_ORTHOGONAL 1e-15

/* Part of the largest singular value. The vector of a smaller one is made of rounding, and is
 * replaced by a unit vector orthogonal to the others. */
#define SVD_NULL 1e-13

/* Square of a length, of at most 1. Where every axis keeps less than this outside of the span of
 * the vectors found so far, that span is the whole space, and there is no vector left. */
#define SVD_NOTHING_LEFT 1e-6

/* Square of a pure number, the least pivot of a symmetric matrix. A pivot that rounding made
 * negative becomes positive; no true pivot is so small. */
#define LEAST_PIVOT 1e-300

/* ------------------------------------------- inverse kinematics by Levenberg-Marquardt */

/* 1 / radian^2 or 1 / metre^2, by the coordinate: mu of lambda = mu |W e|^2 / 2 at the first step
 * of an attempt. */
#define LM_FIRST_MU 0.1

/* Factor of mu after a step that was taken, and after one that was refused. The rise undoes
 * about two falls: a refused step costs an evaluation, too much damping only some progress. */
#define LM_MU_DECREASE 0.3
#define LM_MU_INCREASE 8.0

/* In the unit of J^T J, to which lambda is added. J^T J is known to 1e-16 and may be singular: the
 * least lambda keeps its factors finite. Beyond the greatest lambda even the shortest steps do not
 * decrease the error. */
#define LM_LEAST_LAMBDA 1e-14
#define LM_GREATEST_LAMBDA 1e8

/* Radian or metre in any coordinate. The Jacobian predicts nothing further away than the longest
 * step; the shortest step changes nothing, at the resolution of doubles near 1. */
#define LM_LONGEST_STEP 1.0
#define LM_SHORTEST_STEP 1e-15

/* Part of the squared error that a step gains; steps that gain less count as idle and end the
 * attempt. HASTY: from a start that gains little, the next start is the shorter way. PATIENT: an
 * end is brought to the least error nearby, down to rounding. */
#define LM_HASTY_GAIN 0.2
#define LM_PATIENT_GAIN 1e-12

/* Metre or radian. Below this residual an attempt is patient even if it was to be hasty: a solution
 * is near, at a singularity, where convergence is slow. */
#define LM_NEAR_SOLUTION 1e-5

/* Halley's step is tried where the residual [metre or radian] is below HALLEY_RESIDUAL, near enough
 * for second order to matter, and the LM step leaves more than the part HALLEY_REMAINDER of the
 * squared error, where it converges far from quadratically. */
#define HALLEY_RESIDUAL 0.03
#define HALLEY_REMAINDER 0.2

/* ------------------------------------------------------- joint rates, paths by rates
 *
 * One law damps both: the inverse of a singular value s below the border e is
 *
 *     s / (s^2 + lambda^2),   lambda^2 = (1 - (s / e)^2) d^2,   d the damping of s = 0
 *
 * joint_rates has d = e, so that the inverse is s / e^2, at most 1 / e: that bounds the rates. */

/* Pure number, e = d of joint_rates unless the caller gives it: without rate limits it is the
 * damping that bounds the rates, at 25 times the twist. A quarter of the median that the smallest
 * singular value of six-axis arms has over random configurations: few configurations are damped. */
#define RATES_DAMPING_THRESHOLD 0.04

/* Pure numbers, e and the least d of track. Half of RATES_DAMPING_THRESHOLD: here rates have limits of their
 * own, and the damped part of a twist becomes an error of the tool, which grows with d. */
#define TRACK_BORDER 0.02
#define TRACK_DAMPING 0.02

/* Pure number, the greatest d that track rises to: the size of a Jacobian far from singularities;
 * more would damp every direction. */
#define TRACK_GREATEST_DAMPING 1.0

/* Part of the decrease that the Jacobian predicted for the squared error of a step. Below POOR the
 * damping is multiplied by RAISE, above GOOD it is divided by LOWER (Marquardt): at once
 * where a step went wrong, and slowly back: else the tool would swing across a singularity. */
#define TRACK_POOR_STEP 0.25
#define TRACK_GOOD_STEP 0.75
#define TRACK_RAISE_DAMPING 2
#define TRACK_LOWER_DAMPING 1.05

/* Part of the squared error. A smaller predicted decrease is rounding and judges nothing. */
#define TRACK_NO_DECREASE 1e-12

/* Product of two rows over the square of the longer one. A smaller component of a long row in a
 * short one is beneath the damping, so the decomposition for damped solves ends earlier than
 * SVD_ORTHOGONAL. */
#define BOX_ORTHOGONAL 1e-13

/* Part of the border e: damping of the null space of J, which keeps the matrix of the bounded
 * problem positive definite. Its square is 1e-8 of e^2, beneath the damping of all
 * others. */
#define BOX_NULL_SPACE_DAMPING 1e-4

/* Part of the largest gradient component. A multiplier must be larger to free a variable from its
 * bound: smaller ones are rounding and would make the active set cycle. */
#define BOX_RELEASE 1e-10

/* Part of the secondary rates asked for. A projection to the null space that is smaller is
 * rounding. */
#define NULL_MOTION 1e-12

/* Component of a unit vector. Components that differ by less count as equal, so that rounding does
 * not choose the sign of the direction that is lost. */
#define DIRECTION_TIE 1e-9

/* Radians or lengths by which turns of one solution differ beside full turns, and least width of
 * the cells in which equal solutions are sought: far above rounding, far below the distance of
 * branches.
 */
#define SAME_TURNS 1e-9

/* Part of |q| / dt and of the previous rate [rad/s or m/s]: the rounding of the distance that is
 * left to a limit, by which a joint may brake harder than its acceleration limit. */
#define BRAKING_ROUNDING (8 * DBL_EPSILON)

#endif
