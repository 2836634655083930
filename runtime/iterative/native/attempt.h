/* One attempt: Levenberg-Marquardt steps from a start configuration to a local minimum of the
 * error.
 *
 * The damping is lambda = mu |e|^2 / 2. The factor mu decreases after successful steps and
 * increases after failed steps. The damping approaches 0 as the error approaches 0. The iteration
 * therefore converges quadratically, even near singularities. */
#pragma once

#include "iterative/native/arm.h"
#include "iterative/native/pose_error.h"

/* Results of an attempt. CONVERGED: the error is within the tolerance, or minimal for a rounded
 * target. AT_LIMITS: the error has a local minimum with coordinates at their limits. STALLED: the
 * local minimum is inside the limits. OUT_OF_BUDGET: no evaluations are left. NO_POSE: the target
 * is not a pose. */
typedef enum { CONVERGED, AT_LIMITS, STALLED, OUT_OF_BUDGET, NO_POSE } Ending;

/* Iterates from work->q until a step reduces the squared error by less than the fraction
 * `least_gain`. */
Ending attempt(const Problem *problem, double least_gain, int *budget, Evaluation *now);

/* Iterates from x (n,) to the minimum error, up to rounding. */
Ending patient_attempt(const Problem *problem, const double *x, int *budget, Evaluation *now);
