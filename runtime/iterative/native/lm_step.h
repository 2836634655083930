/* One step of the Levenberg-Marquardt iteration within joint limits.
 *
 * With e the weighted error and J its Jacobian, the step dq of the free coordinates solves
 *
 *     (J^T J + lambda 1) dq = J^T e
 *
 * and is clipped to the limits. Where branches meet, Halley's step is tried, too. Halley's step
 * uses J + H dq / 2 instead of J, where H is the Hessian and dq is the first step.
 *
 * Source: Sugihara 2011 (damping); Bertsekas, Projected Newton methods, 1982 (limits); Lloyd,
 * Irani and Ahmadi 2022 (Halley's step). */
#pragma once

#include "iterative/native/arm.h"
#include "iterative/native/pose_error.h"

/* Writes the indices of the coordinates that are free to move at work->q. Returns their number. */
int find_free(const Problem *problem, const double *e);

/* Writes J^T J and J^T e of the m free coordinates, from the columns (n, 6) of J. */
void normal_equations(const Workspace *work, const double *columns, const double *e, int m);

/* Tries a step of the m free coordinates from work->q with damping lambda, and writes work->trial
 * and work->trial_J. Writes to *better whether the error decreases. If the error decreases, *now is
 * the evaluation at the end of the step. Each evaluation reduces the remaining number of
 * evaluations by 1. Returns 0 if no step is possible. */
int lm_step(const Problem *problem, int m, double lambda, int *budget, Evaluation *now,
            int *better);
