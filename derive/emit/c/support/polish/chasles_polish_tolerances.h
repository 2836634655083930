/* Tolerances for the inverse of arms close to a known structure: name, value, unit and reason. This
 * file is part of chasles and is the same for every robot. The difference of two poses is the
 * larger of a distance (m) and an angle (rad).
 */
#ifndef CHASLES_POLISH_TOLERANCES_H
#define CHASLES_POLISH_TOLERANCES_H

/* Residual [m, rad] at which the iteration ends, which is ten times the rounding error of forward
 * kinematics. */
#define POLISH_CLOSED 1e-14
/* If the residual [m, rad] is below this value, a step without improvement ends the iteration,
 * because only rounding errors remain. */
#define POLISH_SETTLED 1e-12
/* Largest residual of a solution [m, rad]. The runtime uses the same value. */
#define POLISH_SOLVED 1e-9
/* Two solutions are equal if their coordinates differ by less than this value [m, rad]. */
#define POLISH_SAME 1e-6
/* Two solutions whose residual stays above POLISH_SETTLED are equal if their coordinates differ by
 * less than this value [m, rad]. Two solutions coincide at the boundary of the reachable set. */
#define POLISH_SAME_AT_BORDER 1e-4
/* Largest entry of R R^T - 1 for a valid rotation R; it is about 1e-15 for poses in double
 * precision, and 1e-7 in single precision. */
#define POLISH_RIGID 1e-9
/* Lower bound for 1 + trace(R), where R is the rotation from the tool to the pose. The bound keeps
 * steps finite near half a turn. */
#define POLISH_HALF_TURN 1e-3
/* Maximum coordinate change per step [m, rad]; a larger change may reach another branch. */
#define POLISH_STEP 0.3
/* After a step shorter than POLISH_SHORT [m, rad], at most POLISH_MAX_AGAIN further steps reuse the
 * Jacobian of this step. If an arm has fewer than six joints, its reachable poses form a curved
 * set. The curvature causes an error of at most POLISH_BEND times the squared step length. */
#define POLISH_SHORT 1e-3
#define POLISH_MAX_AGAIN 3
#define POLISH_BEND 8.0
/* If the ratio of pivot to damping is above this value, damping hardly shortens the step. */
#define POLISH_UNDAMPED 100.0
/* Ratio of the damping to the squared error, for steps from a nominal solution. */
#define POLISH_DAMPING 0.1
/* Minimum damping. The computed squared singular values have errors of 1e-16. */
#define POLISH_MIN_DAMPING 1e-15
/* Maximum ratio of the damping to the squared error. */
#define POLISH_MAX_DAMPING 1e6
/* Maximum number of halved steps near a dead point (77 observed), and the minimum fraction of a
 * step. If a step shortened to the fraction POLISH_MIN_PART still does not reduce the error, the
 * residual is minimal, or the loops cannot be closed. */
#define POLISH_MAX_HALVED 150
#define POLISH_MIN_PART 1e-4
/* The iteration continues only if the squared error after a step is at most this fraction of the
 * squared error before the step. */

#define POLISH_SLOW 0.95

/* POLISH_DEVIATIONS(count) is the tool displacement (m, rad) for `count` axis deviations. The value
 * is at least 1e-6, because rounding near a singularity causes displacements of 1e-8. */
#define POLISH_DEVIATIONS(count) \
    ((count) * POLISH_DEVIATION * (POLISH_LENGTH > 1.0 ? POLISH_LENGTH : 1.0) + 1e-6)
/* If the residual of the nominal arm is less than this value, the true arm may reach the pose. */
#define POLISH_REACH POLISH_DEVIATIONS(POLISH_UNSURE)
/* Maximum residual of the nominal arm at the start of a curve. */
#define POLISH_START POLISH_DEVIATIONS(30.0)
/* Maximum squared error (radian, or relative to the length) of a start configuration on the correct
 * branch of the loops. At a dead point of a loop, an axis deviation d rotates a link by the angle
 * sqrt(2 d). */
#define POLISH_ON_BRANCH ((100.0 * POLISH_DEVIATION + 2.0) * POLISH_DEVIATION)
/* Maximum residual [m, rad] of a pose that the nominal arm reaches, due to rounding near a
 * singularity. */
#define POLISH_FOLD 1e-7
/* Let s be the square root of a pivot of J J^T. If s is below POLISH_UNSURE times the axis
 * deviation, the true arm may be singular. For small axis deviations, s is compared with 0.01 rad,
 * because few poses are so near a singularity. */
#define POLISH_UNSURE \
    (POLISH_DEVIATION > 2.5e-3 ? 4.0 : POLISH_DEVIATION < 2.5e-4 ? 40.0 : 0.01 / POLISH_DEVIATION)
/* Maximum of e s / sigma^3 for a branch that is known to have only one solution. Here, e is the
 * axis deviation, s the first step (radian), and sigma the smallest singular value. All 1469 poses
 * with a second solution exceeded this limit in a test of six arms, with errors of 1 to 5 mm and
 * mrad. */
#define POLISH_SWERVED (POLISH_MEETS ? 310.0 : 1300.0)
/* The search also solves the nominal arm at poses near the target. This value is their displacement
 * from the target, as a multiple of the axis deviation. This displacement exceeds the difference
 * between the nominal and the true arm. */
#define POLISH_AROUND 2.5
/* Half length of the pose line, a straight line of poses through the target, in axis deviations. At
 * the ends of the pose line, the nominal arm is far enough from its singularity. */
#define POLISH_LINE 8.0
/* POLISH_STRIDE is the maximum coordinate change per step along a curve (radian). POLISH_SHARE is
 * the maximum change of mu per step, as a fraction of half the length of the pose line. */
#define POLISH_STRIDE 0.12
#define POLISH_SHARE 0.3
/* If a curve approaches the target pose and turns back, the turning point may hide two solutions.
 * The search uses a turning point if |mu| at this point is at most POLISH_TOUCH times half the
 * length of the pose line. */
#define POLISH_TOUCH 0.3
/* A curve is lost if its error (radian, or relative to the arm length) exceeds this value before a
 * correction. */
#define POLISH_OFF_CURVE 0.05

/* Maximum number of steps from a nominal solution. Each step doubles the number of correct digits.
 */
#define POLISH_STEPS 6
/* Maximum number of Newton steps from a start configuration far from the solution. */
#define POLISH_MAX_STEPS 30
/* Maximum number of steps along a curve. */
#define POLISH_MAX_STRIDES 60
/* Maximum number of directions in which the search displaces the target pose. */
#define POLISH_DIRECTIONS 6
/* If a solution is known, at most this number of pose lines is searched even without new solutions.
 * The search then continues while each pose line gives a new solution. A pose line is a straight
 * line of poses through the target. */
#define POLISH_FEW_DIRECTIONS 2

/* Distance [rad] from a fold point at which the curvature of the curve is measured. */
#define POLISH_BEND_OFFSET 0.03
/* If the curvature [1/rad] at a fold point is at most this multiple of the axis deviation, the
 * number of solutions near the fold point is uncertain. The axis deviation alone may cause this
 * curvature. If the second-order equation has no real root and slope^2 exceeds POLISH_TILTED times
 * |2 bend lack|, the multiple is POLISH_FLAT_MISSED instead. */
#define POLISH_FLAT 8.0
#define POLISH_FLAT_MISSED 40.0
#define POLISH_TILTED 0.1
/* The second-order equation gives the number of solutions near a fold point. POLISH_LONGEST limits
 * the distance [rad] of the solutions from the fold point. POLISH_SIDEWAYS limits the step
 * orthogonal to v. */
#define POLISH_LONGEST 0.5
#define POLISH_SIDEWAYS 0.1
/* Assumed minimum ratio of a second step to the square of the first step. */
#define POLISH_SQUARED 0.01
/* At an exact fold point, the whole error is along the unreachable direction. If less than this
 * fraction of the squared error lies along the unreachable direction, solutions may exist away from
 * the fold point. */
#define POLISH_ASIDE 0.01
/* Maximum relative error of each term in the discriminant of the second-order equation. */
#define POLISH_CLEAR 0.3
/* Bounds that select branches near a second singularity. Such a branch may end at a fold point
 * despite a large residual. POLISH_SECOND limits the square root of a pivot (rad), and
 * POLISH_FARTHEST limits the residual. POLISH_AMPLIFIED limits the product of the square root and
 * the residual, in axis deviations. A branch is also selected if both values are small: a residual
 * below ten axis deviations, and a square root of the pivot below POLISH_NEARER axis deviations. */
#define POLISH_SECOND 0.02
#define POLISH_FARTHEST POLISH_DEVIATIONS(60.0)
#define POLISH_AMPLIFIED (0.25 * (POLISH_LENGTH > 1.0 ? POLISH_LENGTH : 1.0))
#define POLISH_NEARER 4.0

#endif
