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
/* Largest residual of a solution [m, rad], as in the runtime. */
#define POLISH_SOLVED 1e-9
/* Two solutions are equal if their coordinates differ by less than this value [m, rad]. Computed
 * copies of a double solution differ by 1e-8. */
#define POLISH_SAME 1e-6
/* Two solutions whose residual stays above POLISH_SETTLED are equal if their coordinates differ by
 * less than this value [m, rad]. Two solutions coincide at the boundary of the reachable set. At
 * the boundary, a residual of 1e-9 causes coordinate errors of about 3e-5. */
#define POLISH_SAME_AT_BORDER 1e-4
/* Largest entry of R R^T - 1 for a valid rotation R; it is about 1e-15 for poses in double
 * precision, and 1e-7 in single precision. */
#define POLISH_RIGID 1e-9
/* Minimum of 1 + trace for the rotation from tool to pose; it keeps steps finite near half a turn.
 */
#define POLISH_HALF_TURN 1e-3
/* Maximum coordinate change per step [m, rad]; a larger change may reach another branch. */
#define POLISH_STEP 0.3
/* If a step is shorter than POLISH_SHORT [m, rad], the next POLISH_MAX_AGAIN steps reuse its
 * equations. Each of these steps reduces the error by about the factor POLISH_SHORT. */
#define POLISH_SHORT 1e-3
#define POLISH_MAX_AGAIN 3
/* Curvature bound of the reachable set of an arm with fewer than six joints, relative to the
 * squared step (radian, or relative to the arm length). For two revolute joints, the curvature of
 * the reachable set is at most 1. */
#define POLISH_BEND 8.0
/* If the ratio of pivot to damping is above this value, damping hardly shortens the step. */
#define POLISH_UNDAMPED 100.0
/* Ratio of the damping to the squared error, for steps from a nominal solution. */
#define POLISH_DAMPING 0.1
/* Minimum damping; squared singular values have errors of 1e-16. */
#define POLISH_MIN_DAMPING 1e-15
/* Maximum ratio of the damping to the squared error; if the iteration needs more damping than this,
 * it has reached the minimum residual. */
#define POLISH_MAX_DAMPING 1e6
/* Maximum number of halved steps near a dead point (77 observed), and the minimum fraction of a
 * step. If even a step with the fraction POLISH_MIN_PART does not reduce the error, the residual is
 * minimal, or the loops cannot be closed. */
#define POLISH_MAX_HALVED 150
#define POLISH_MIN_PART 1e-4
/* The iteration continues only if the squared error after a step is at most this fraction of the
 * squared error before the step. */

#define POLISH_SLOW 0.95

/* Tool displacement (m, rad) that corresponds to a multiple of the axis deviation (radian, or
 * relative to the arm length). The value is at least 1e-6, because rounding near a singularity
 * causes displacements of 1e-8. */
#define POLISH_DEVIATIONS(count) \
    ((count) * POLISH_DEVIATION * (POLISH_LENGTH > 1.0 ? POLISH_LENGTH : 1.0) + 1e-6)
/* Maximum nominal residual of a pose that the true arm may reach because several axes deviate. */
#define POLISH_REACH POLISH_DEVIATIONS(POLISH_UNSURE)
/* Maximum nominal residual at the start of a curve. A curve may lead from an unreachable pose to
 * reachable poses.
 */
#define POLISH_START POLISH_DEVIATIONS(30.0)
/* Maximum squared error (radian, or relative to the length) of a start that lies on the true branch
 * of the loops. Away from dead points, the error of a start is at most ten axis deviations. The
 * maximum error of a hundred starts was one axis deviation. At a dead point, an axis deviation d
 * rotates a link by sqrt(2 d). */
#define POLISH_ON_BRANCH ((100.0 * POLISH_DEVIATION + 2.0) * POLISH_DEVIATION)
/* Maximum residual [m, rad] of a pose that the nominal arm reaches, due to rounding near a
 * singularity. */
#define POLISH_FOLD 1e-7
/* Let s be the square root of a pivot of J J^T. If s is smaller than POLISH_UNSURE axis deviations,
 * the true arm may be singular, and its solution branches may be anywhere. For small axis
 * deviations, s is compared with 0.01 rad, because few poses are so near a singularity. */
#define POLISH_UNSURE \
    (POLISH_DEVIATION > 2.5e-3 ? 4.0 : POLISH_DEVIATION < 2.5e-4 ? 40.0 : 0.01 / POLISH_DEVIATION)
/* A branch has only one solution if e s / sigma^3 is below this limit. Here, e is the axis
 * deviation, s the first step (radian), and sigma the smallest singular value. All 1469 poses with
 * a second solution exceeded this limit in a test of six arms, with errors of 1 to 5 mm and mrad.
 * If no three axes nearly intersect in one point, the limit is 1300 instead of 310. In a test of
 * 300,000 poses of six arms, 3 poses with a second solution were below the larger limit. */
#define POLISH_SWERVED (POLISH_MEETS ? 310.0 : 1300.0)
/* Displacement of surrounding poses as a multiple of the axis deviation. This displacement exceeds
 * the difference between the nominal and the true arm. */
#define POLISH_AROUND 2.5
/* Half length of a pose line, which is a straight line of poses through the target. The unit is the
 * axis deviation. At the ends of the pose line, the nominal arm is far enough from its
 * singularity. */
#define POLISH_LINE 8.0
/* Maximum stride along a curve, in coordinates (radian) and as a fraction of half the line.
 * Solutions that are closer together than a stride are found where the curve nearly touches the
 * target. */
#define POLISH_STRIDE 0.12
#define POLISH_SHARE 0.3
/* If a curve approaches the target pose and turns back, the turning point may hide two solutions.
 * POLISH_TOUCH is the maximum distance of a searched turning point from the target pose. The unit
 * is half the length of the pose line. */
#define POLISH_TOUCH 0.3
/* A curve is lost if its error (radian, or relative to the arm length) before a correction is above
 * this value. */
#define POLISH_OFF_CURVE 0.05

/* Maximum number of steps from a nominal solution; each step doubles the digits. */
#define POLISH_STEPS 6
/* Maximum number of steps from a distant start, such as a point where a curve crosses mu = 0. */
#define POLISH_MAX_STEPS 30
/* Maximum number of strides along a curve. */
#define POLISH_MAX_STRIDES 60
/* Maximum number of directions in which surrounding poses and straight lines of poses are
 * computed. */
#define POLISH_DIRECTIONS 6
/* If the solution of a branch is known, the search uses at most this number of pose lines. */
#define POLISH_FEW_DIRECTIONS 2

/* Offset [rad] from a fold point at which its curvature is measured. */
#define POLISH_BEND_OFFSET 0.03
/* Largest curvature [1/rad] at a fold point of a nominal arm with a self-motion, divided by the
 * axis deviation. The axis deviation causes this curvature. */
#define POLISH_FLAT 8.0
/* If a branch near a fold point has no solution, its curvature [1/rad] is compared with this
 * multiple of the axis deviation. If the squared slope exceeds POLISH_TILTED, the nearest
 * configuration is far from the fold point, where the curvature may be different. */
#define POLISH_FLAT_MISSED 40.0
#define POLISH_TILTED 0.1
/* The second-order equation gives the number of solutions near a fold point. POLISH_LONGEST limits
 * the distance [rad] of the solutions from the fold point. POLISH_SIDEWAYS limits the step
 * orthogonal to v. */
#define POLISH_LONGEST 0.5
#define POLISH_SIDEWAYS 0.1
/* Assumed minimum ratio of a second step to the square of the first step. */
#define POLISH_SQUARED 0.01
/* Minimum fraction of the squared error that is along the unreachable direction at a fold point. At
 * an exact fold point, the whole error is along the unreachable direction. */
#define POLISH_ASIDE 0.01
/* Maximum relative error of each term in the discriminant of the second-order equation. If an error
 * is larger, the sign of the discriminant is uncertain. */
#define POLISH_CLEAR 0.3
/* Bounds for a branch whose nominal solution has a large residual and is near a second singularity.
 * POLISH_SECOND limits the square root of a pivot (rad), and POLISH_FARTHEST limits the residual.
 * The product of this square root and the residual is at most POLISH_AMPLIFIED times the axis
 * deviation (m, rad). The displacement of the fold point by an axis deviation grows as the distance
 * from the second singularity decreases. If the residual is at most ten axis deviations, the square
 * root of the pivot is compared with POLISH_NEARER axis deviations instead. */
#define POLISH_SECOND 0.02
#define POLISH_FARTHEST POLISH_DEVIATIONS(60.0)
#define POLISH_AMPLIFIED (0.25 * (POLISH_LENGTH > 1.0 ? POLISH_LENGTH : 1.0))
#define POLISH_NEARER 4.0

#endif
