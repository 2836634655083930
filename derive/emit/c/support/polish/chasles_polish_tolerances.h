/* Defines the tolerances for the inverse kinematics of arms close to a known structure, with units
 * and reasons. This file is part of chasles and is the same for every robot. The difference of two
 * poses is the larger of their distance (m) and the angle between them (rad). */
#ifndef CHASLES_POLISH_TOLERANCES_H
#define CHASLES_POLISH_TOLERANCES_H

/* Newton's iteration ends at this residual [m, rad], which is ten times the rounding error of
 * forward kinematics. */
#define POLISH_CLOSED 1e-14
/* If the residual [m, rad] is below this value, a step without improvement ends Newton's iteration,
 * because only rounding errors remain. */
#define POLISH_SETTLED 1e-12
/* Largest residual of a solution [m, rad]. The runtime uses the same limit for the residual of a
 * solution. */
#define POLISH_SOLVED 1e-9
/* Two solutions are equal if their coordinates differ by less than this value [m, rad]. */
#define POLISH_SAME 1e-6
/* Two solutions whose residual stays above POLISH_SETTLED are equal if their coordinates differ by
 * less than this value [m, rad]. Two solutions coincide at the boundary of the reachable set. */
#define POLISH_SAME_AT_BORDER 1e-4
/* Largest allowed entry of R R^T - 1 for a rotation matrix R. The largest entry of R R^T - 1 is
 * about 1e-15 for poses in double precision, and 1e-7 in single precision. */
#define POLISH_RIGID 1e-9
/* Lower bound for 1 + trace(R), where R is the rotation from the tool to the pose. This lower bound
 * keeps Newton steps finite near rotations by half a turn. */
#define POLISH_HALF_TURN 1e-3
/* Maximum coordinate change per Newton step [m, rad], because a larger change may lead to another
 * solution branch. */
#define POLISH_STEP 0.3
/* After a Newton step shorter than POLISH_SHORT [m, rad], at most POLISH_MAX_AGAIN further steps
 * reuse the Jacobian of this step. If an arm has fewer than six joints, its reachable poses form a
 * curved set. The curvature of this set causes a pose error of at most POLISH_BEND times the
 * squared step length. */
#define POLISH_SHORT 1e-3
#define POLISH_MAX_AGAIN 3
#define POLISH_BEND 8.0
/* If the ratio of pivot to damping is above this value, damping hardly shortens the step. */
#define POLISH_UNDAMPED 100.0
/* Ratio of the damping to the squared pose error in Newton steps that start from a solution of the
 * nominal arm. */
#define POLISH_DAMPING 0.1
/* Minimum damping of a Newton step, larger than the errors of 1e-16 in the computed squared
 * singular values. */
#define POLISH_MIN_DAMPING 1e-15
/* Newton's iteration ends if the ratio of the damping to the squared pose error exceeds this value.
 */
#define POLISH_MAX_DAMPING 1e6
/* POLISH_MAX_HALVED is the maximum number of halved steps near a dead point (77 observed), and
 * POLISH_MIN_PART is the minimum fraction of a step. If a step shortened to the fraction
 * POLISH_MIN_PART still does not reduce the error, the residual is minimal, or the loops cannot be
 * closed. */
#define POLISH_MAX_HALVED 150
#define POLISH_MIN_PART 1e-4
/* The iteration continues only if the squared error after a step is at most this fraction of the
 * squared error before the step. */

#define POLISH_SLOW 0.95

/* POLISH_DEVIATIONS(count) is the tool displacement (m, rad) for `count` axis deviations. This tool
 * displacement is at least 1e-6, because rounding near a singularity causes displacements of 1e-8.
 */
#define POLISH_DEVIATIONS(count) \
    ((count) * POLISH_DEVIATION * (POLISH_LENGTH > 1.0 ? POLISH_LENGTH : 1.0) + 1e-6)
/* If the residual of the nominal arm at a pose is below this value, the true arm may reach the
 * pose. */
#define POLISH_REACH POLISH_DEVIATIONS(POLISH_UNSURE)
/* Maximum residual of the nominal arm at the start of a curve. */
#define POLISH_START POLISH_DEVIATIONS(30.0)
/* Maximum squared pose error (radian, or relative to the arm length) of a start configuration on
 * the correct branch of the loops. At a dead point of a loop, an axis deviation d rotates a link by
 * the angle sqrt(2 d). */
#define POLISH_ON_BRANCH ((100.0 * POLISH_DEVIATION + 2.0) * POLISH_DEVIATION)
/* Maximum residual [m, rad] that rounding near a singularity causes for a pose that the nominal arm
 * reaches. */
#define POLISH_FOLD 1e-7
/* The true arm may be singular if the square root of a pivot of J J^T is below POLISH_UNSURE
 * times the axis deviation. For axis deviations from 2.5e-4 to 2.5e-3, this limit is 0.01 rad,
 * because few poses are so near a singularity. */
#define POLISH_UNSURE \
    (POLISH_DEVIATION > 2.5e-3 ? 4.0 : POLISH_DEVIATION < 2.5e-4 ? 40.0 : 0.01 / POLISH_DEVIATION)
/* Maximum of e s / sigma^3 for a branch that is known to have only one solution. In e s / sigma^3,
 * e is the axis deviation, s the first Newton step (radian), and sigma the smallest singular value
 * of the Jacobian. All 1469 poses with a second solution exceeded this limit in a test of six arms,
 * with errors of 1 to 5 mm and mrad. */
#define POLISH_SWERVED (POLISH_MEETS ? 310.0 : 1300.0)
/* The search also solves the nominal arm at poses near the target pose. This value is the
 * displacement of these poses from the target pose, as a multiple of the axis deviation. The
 * displacement of the poses exceeds the difference between the nominal and the true arm. */
#define POLISH_AROUND 2.5
/* Half the length of the pose line (a straight line of poses through the target), as a multiple of
 * the axis deviation. At the ends of the pose line, the nominal arm is far enough from its
 * singularity. */
#define POLISH_LINE 8.0
/* POLISH_STRIDE is the maximum coordinate change per step along a curve (radian). POLISH_SHARE is
 * the maximum change of mu per step, as a fraction of half the length of the pose line. */
#define POLISH_STRIDE 0.12
#define POLISH_SHARE 0.3
/* If a curve approaches the target pose and turns back, the turning point may hide two solutions.
 * The search uses a turning point if |mu| at this point is at most POLISH_TOUCH times half the
 * length of the pose line. */
#define POLISH_TOUCH 0.3
/* The search abandons a curve if a point's distance from the curve exceeds this value before a
 * correction. The distance is measured as a pose error (radian, or relative to the arm length). */
#define POLISH_OFF_CURVE 0.05

/* Maximum number of Newton steps from a nominal solution. Each Newton step doubles the number of
 * correct digits. */
#define POLISH_STEPS 6
/* Maximum number of Newton steps from a start configuration far from the solution. */
#define POLISH_MAX_STEPS 30
/* Maximum number of steps along a curve of configurations. */
#define POLISH_MAX_STRIDES 60
/* Maximum number of directions in which the search displaces the target pose. */
#define POLISH_DIRECTIONS 6
/* If a solution is known, at most this number of pose lines is searched even without new solutions.
 * After these pose lines, the search continues only as long as every further pose line gives a new
 * solution. A pose line is a straight line of poses through the target. */
#define POLISH_FEW_DIRECTIONS 2

/* Distance [rad] from a fold point at which the curvature of the curve is measured. */
#define POLISH_BEND_OFFSET 0.03
/* If the curvature [1/rad] at a fold point is at most POLISH_FLAT axis deviations, the number of
 * solutions near the fold point is uncertain. The axis deviation alone may cause such a small
 * curvature at a fold point. POLISH_FLAT_MISSED replaces POLISH_FLAT if the quadratic e(s) has no
 * real root and slope^2 exceeds POLISH_TILTED |2 bend lack|. */
#define POLISH_FLAT 8.0
#define POLISH_FLAT_MISSED 40.0
#define POLISH_TILTED 0.1
/* Limits within which a quadratic equation gives the number of solutions near a fold point:
 * POLISH_LONGEST for the distance [rad] of the solutions from the fold point, and POLISH_SIDEWAYS
 * for the Newton step orthogonal to the nearly singular joint direction v. */
#define POLISH_LONGEST 0.5
#define POLISH_SIDEWAYS 0.1
/* Assumed minimum ratio of the squared length of the second Newton step to the squared length of
 * the first step. */
#define POLISH_SQUARED 0.01
/* At an exact fold point, the whole pose error is along the twist direction that the joints cannot
 * reach. If less than this fraction of the squared pose error is along the unreachable direction,
 * solutions may exist away from the fold point. */
#define POLISH_ASIDE 0.01
/* Maximum relative error of each term in the discriminant of the quadratic equation at a fold
 * point. */
#define POLISH_CLEAR 0.3
/* Bounds that select branches near a second singularity. A branch near a second singularity may end
 * at a fold point despite a large residual. POLISH_SECOND limits the square root of a pivot (rad),
 * and POLISH_FARTHEST limits the residual. POLISH_AMPLIFIED limits the product of the residual and
 * the square root of the pivot, in axis deviations. A branch is also selected if its residual is
 * below ten axis deviations and the square root of its pivot is below POLISH_NEARER axis
 * deviations. */
#define POLISH_SECOND 0.02
#define POLISH_FARTHEST POLISH_DEVIATIONS(60.0)
#define POLISH_AMPLIFIED (0.25 * (POLISH_LENGTH > 1.0 ? POLISH_LENGTH : 1.0))
#define POLISH_NEARER 4.0

#endif
