/* One attempt: Levenberg-Marquardt steps from one start to the least error nearby.
 *
 * The damping is lambda = mu |e|^2 / 2. mu falls after a step that decreases the error and rises
 * after one that does not, which is tried again. As lambda vanishes with the error, convergence is
 * quadratic, also next to singularities; where the error cannot vanish, the attempt ends at its
 * least value.
 */
#ifndef CHASLES_ATTEMPT_H
#define CHASLES_ATTEMPT_H

#include "iterative/native/arm.h"
#include "iterative/native/pose_error.h"

/* How an attempt ended: within the tolerance, or at the least error for a rounded target; at a
 * least error, with a coordinate held by a limit or with none; out of budget; without a beginning,
 * as the target is no pose. */
typedef enum { CONVERGED, AT_LIMITS, STALLED, OUT_OF_BUDGET, NO_POSE } Ending;

/* Goes from work->q to the least error nearby, for as long as steps gain the part `least_gain` of
 * the squared error. Leaves the result in work->q and its evaluation in *now, whose half_square is
 * infinite where the start cannot be evaluated. */
Ending attempt(const Problem *problem, double least_gain, int *budget, Evaluation *now);

/* Goes from x (n,) to the least error nearby, to rounding. The error is the displacement, with
 * distance and angle apart: the logarithm mixes them, and its least value is not theirs. */
Ending patient_attempt(const Problem *problem, const double *x, int *budget, Evaluation *now);

#endif
