/* One attempt: Levenberg-Marquardt steps from a start configuration to a local minimum of the
 * error.
 *
 * The damping is lambda = mu |e|^2 / 2. The factor mu decreases after successful steps and
 * increases after failed steps. The damping vanishes with the error. The iteration therefore
 * converges quadratically, even near singularities. */
#pragma once

#include "iterative/native/arm.h"
#include "iterative/native/pose_error.h"

/* Ends of an attempt: converged (or at the minimum error of a rounded target); at a minimum
 * error, with or without coordinates at limits; out of evaluations; the target is not a pose. */
typedef enum { CONVERGED, AT_LIMITS, STALLED, OUT_OF_BUDGET, NO_POSE } Ending;

/* Iterates from work->q while steps reduce the squared error by the fraction `least_gain`. The
 * result is in work->q and *now; half_square is infinite if the start has no finite residual. */
Ending attempt(const Problem *problem, double least_gain, int *budget, Evaluation *now);

/* Iterates from x (n,) to the minimum error, up to rounding. The minimized error is the
 * displacement, that is, translation and rotation vector. The norm of the pose logarithm would have
 * its minimum at another configuration. */
Ending patient_attempt(const Problem *problem, const double *x, int *budget, Evaluation *now);
