/* Tolerances for the inverse of nearly structured arms: name, value, unit and reason. This file is
 * part of chasles and is the same for every robot. The difference of two poses is the larger of a
 * distance (m) and an angle (rad).
 */
#ifndef CHASLES_POLISH_TOLERANCES_H
#define CHASLES_POLISH_TOLERANCES_H

/* m, rad: residual at which the iteration ends, ten times the rounding of forward kinematics. */
#define POLISH_CLOSED 1e-14
/* m, rad: below this residual, a step without improvement ends the iteration, because only rounding
 * remains. */
#define POLISH_SETTLED 1e-12
/* m, rad: largest residual of a solution, as in the runtime. */
#define POLISH_SOLVED 1e-9
/* m, rad: solutions with coordinates closer than this are equal. Computed copies of a double
 * solution differ by 1e-8. */
#define POLISH_SAME 1e-6
/* m, rad: distance of equal solutions if the residual stays above POLISH_SETTLED. The pose is then
 * at the boundary of the reach, where a residual of 1e-9 causes coordinate errors of about 3e-5. */
#define POLISH_SAME_AT_BORDER 1e-4
/* Largest entry of R R^T - 1 for a valid rotation R: about 1e-15 for poses in double precision,
 * 1e-7 in single precision. */
#define POLISH_RIGID 1e-9
/* Minimum of 1 + trace of the rotation from tool to pose; keeps steps finite near half a turn. */
#define POLISH_HALF_TURN 1e-3
/* m, rad: largest coordinate change per step; a larger change may reach another branch. */
#define POLISH_STEP 0.3
/* m, rad: maximum length of a step whose equations are reused, and number of steps that reuse them.
 * Each step with reused equations reduces the error by about this factor. */
#define POLISH_SHORT 1e-3
#define POLISH_MAX_AGAIN 3
/* Curvature bound of the reachable set of an arm with fewer than six joints, relative to the
 * squared step (radian, or relative to the arm length). For two revolute joints, this curvature is
 * at most 1. */
#define POLISH_BEND 8.0
/* Smallest ratio of pivot to damping at which damping hardly shortens the step. */
#define POLISH_UNDAMPED 100.0
/* Damping relative to the squared error, for steps from a nominal solution. */
#define POLISH_DAMPING 0.1
/* Minimum damping: squared singular values have errors of 1e-16. */
#define POLISH_MIN_DAMPING 1e-15
/* Maximum damping relative to the squared error: above it, the minimum residual is reached. */
#define POLISH_MAX_DAMPING 1e6
/* Maximum number of steps near a dead point, with halved steps (77 observed); and smallest step
 * fraction: below it, the minimum residual or the boundary of loop closure is reached. */
#define POLISH_MAX_HALVED 150
#define POLISH_MIN_PART 1e-4
/* The iteration continues only if a step reduces the squared error to this fraction of it. */
#define POLISH_SLOW 0.95

/* Tool displacement (m, rad) for a multiple of the axis deviation (radian, or relative to the arm
 * length). At least 1e-6, because rounding near a singularity causes 1e-8. */
#define POLISH_DEVIATIONS(count) \
    ((count) * POLISH_DEVIATION * (POLISH_LENGTH > 1.0 ? POLISH_LENGTH : 1.0) + 1e-6)
/* Largest nominal residual at which the true arm might reach a pose: several axes deviate. */
#define POLISH_REACH POLISH_DEVIATIONS(POLISH_UNSURE)
/* Largest nominal residual of a start for a curve, which may lead within reach. */
#define POLISH_START POLISH_DEVIATIONS(30.0)
/* Largest squared error (radian, or relative to the length) of a start on the true loop branch. The
 * bound of ten deviations is safe: the maximum of a hundred starts was one deviation. */
#define POLISH_ON_BRANCH (100.0 * POLISH_DEVIATION * POLISH_DEVIATION)
/* m, rad: largest residual of a pose that the nominal arm reaches: rounding near a singularity. */
#define POLISH_FOLD 1e-7
/* If a pivot of J J^T is below the square of this value (in deviations), branches may lie anywhere:
 * so close to a nominal singularity, the true arm may be singular. Up to 0.01 rad for small
 * deviations, because few poses are so close. */
#define POLISH_UNSURE \
    (POLISH_DEVIATION > 2.5e-3 ? 4.0 : POLISH_DEVIATION < 2.5e-4 ? 40.0 : 0.01 / POLISH_DEVIATION)
/* Deviation (radian, or relative to the length) times first step (radian) over the cubed smallest
 * singular value. Below this value, a branch has only one solution: among 1469 poses with a second
 * solution (six arms, errors of 1 to 5 mm and mrad), none was below. If no three axes nearly
 * intersect, the limit is larger: 3 of 300,000 poses of six arms were below it. */
#define POLISH_SWERVED (POLISH_MEETS ? 310.0 : 1300.0)
/* Displacement of surrounding poses, as a multiple of the axis deviation: larger than the
 * difference of the arms. */
#define POLISH_AROUND 2.5
/* Half length of a line of poses, as a multiple of the axis deviation: at its ends, the nominal arm
 * is far enough from its singularity. */
#define POLISH_LINE 8.0
/* Largest stride along a curve: in coordinates (radian), and as a fraction of half the line.
 * Solutions that are closer together are found where the curve nearly touches the target. */
#define POLISH_STRIDE 0.12
#define POLISH_SHARE 0.3
/* Fraction of half the line up to which an extremum may hide two solutions. */
#define POLISH_TOUCH 0.3
/* Error (radian, or relative to the arm length) before a correction at which a curve is lost. */
#define POLISH_OFF_CURVE 0.05

/* Maximum numbers: steps from a nominal solution (each doubles the digits), steps from a crossing,
 * strides along a curve, line directions, and line directions for branches with a known
 * solution. */
#define POLISH_STEPS 6
#define POLISH_MAX_STEPS 30
#define POLISH_MAX_STRIDES 60
#define POLISH_WAYS 6
#define POLISH_FEW_WAYS 2

/* rad: offset from a fold at which its curvature is measured. */
#define POLISH_BEND_OFFSET 0.03
/* Curvature at a fold (1/rad), as a multiple of the axis deviation, that the deviation alone may
 * cause: for a self-motion, the nominal curvature is zero. */
#define POLISH_FLAT 8.0
/* Curvature limit (1/rad), as a multiple of the axis deviation, at folds without a solution. If the
 * squared slope is above POLISH_TILTED, the nearest point is far from the fold, and the curvature
 * may differ. */
#define POLISH_FLAT_MISSED 40.0
#define POLISH_TILTED 0.1
/* rad: largest distance from a fold to its solutions, and largest step orthogonal to the fold
 * direction, at which the second-order equation gives their number. */
#define POLISH_LONGEST 0.5
#define POLISH_SIDEWAYS 0.1
/* Assumed minimum ratio of a second step to the squared first step. */
#define POLISH_SQUARED 0.01
/* Fraction of the squared error along the unreachable direction, below which the point is not a
 * fold; at a fold, the fraction is 1. */
#define POLISH_ASIDE 0.01
/* Allowed relative error of the terms in this equation's discriminant. */
#define POLISH_CLEAR 0.3
/* Bounds for a branch near a second singularity whose nominal solution misses the pose by far:
 * square root of a pivot (rad), residual, and the product of both (m, rad), per unit deviation. The
 * nearer the second singularity, the further the deviation moves the fold. For residuals up to ten
 * deviations, the root is bounded by POLISH_NEARER deviations. */
#define POLISH_SECOND 0.02
#define POLISH_FARTHEST POLISH_DEVIATIONS(60.0)
#define POLISH_AMPLIFIED (0.25 * (POLISH_LENGTH > 1.0 ? POLISH_LENGTH : 1.0))
#define POLISH_NEARER 4.0

#endif
