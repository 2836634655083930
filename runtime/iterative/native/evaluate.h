/* Evaluation of an arm: the pose of its tip, the weighted error, and the error's Jacobian. */
#ifndef CHASLES_EVALUATE_H
#define CHASLES_EVALUATE_H

#include "iterative/native/arm.h"
#include "iterative/native/pose_error.h"

/* The number of doubles of Workspace.scratch. */
int scratch_size(const Arm *arm);

/* Calls a compiled function with one input and one output, or two; `second` may be NULL. */
void call_kernel(const chasles_kernel *kernel, const double *x, double *first, double *second);

/* Evaluates the arm at x (n_all,). Writes the Jacobian of the error into `columns` (n, 6): the
 * decrease of the weighted error by each coordinate. For a platform the joints of the chain, x[n:],
 * are first moved to where the actuators have their values x[:n]. Returns 0 where that fails or the
 * residual is not finite. */
int evaluate(const Problem *problem, double *x, double *columns, Evaluation *out);

#endif
