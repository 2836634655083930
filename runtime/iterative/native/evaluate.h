/* Evaluation of an arm: tip pose, weighted error, and Jacobian of the error. */
#pragma once

#include "iterative/native/arm.h"
#include "iterative/native/pose_error.h"

/* The number of doubles of Workspace.scratch. */
int scratch_size(const Arm *arm);

/* Calls a compiled function with one input, and one or two outputs; `second` may be NULL. */
void call_kernel(const chasles_kernel *kernel, const double *x, double *first, double *second);

/* Evaluates the pose error of the arm at the joint values x (n,). Writes the negative derivatives
 * of the weighted pose error with respect to x into `columns` (n, 6). Returns 0 if the residual is
 * not finite. */
int evaluate(const Problem *problem, const double *x, double *columns, Evaluation *out);
