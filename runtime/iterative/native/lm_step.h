/* One step of the Levenberg-Marquardt iteration within joint limits.
 *
 * With e the error weighted by the task and J its Jacobian, the step dq solves
 *
 *     (J^T J + lambda 1) dq = J^T e
 *
 * for the coordinates that no limit holds. The step is cut off at the limits. Where branches meet,
 * Halley's step is tried as well: J + H dq / 2 for J, H being the Hessian and dq the step by J.
 *
 * Source: Sugihara 2011 (damping); Bertsekas, Projected Newton methods, 1982 (limits); Lloyd, Irani
 * and Ahmadi 2022 (Halley's step).
 */
#ifndef CHASLES_LM_STEP_H
#define CHASLES_LM_STEP_H

#include "iterative/native/arm.h"
#include "iterative/native/pose_error.h"

/* Writes the coordinates that are free to move from work->q; returns how many they are. */
int find_free(const Problem *problem, const double *e);

/* Writes J^T J and J^T e of the m free coordinates, from the columns (n, 6) of J. */
void normal_equations(const Workspace *work, const double *columns, const double *e, int m);

/* Tries a step of the m free coordinates from work->q, damped by lambda; it is left in work->trial
 * and work->trial_J. *better tells whether the error decreases, and then *now is the evaluation at
 * its end. Each evaluation takes one off the budget. Returns 0 where no step can lead anywhere. */
int lm_step(const Problem *problem, int m, double lambda, int *budget, Evaluation *now,
            int *better);

#endif
