/* Inverse kinematics of one pose: attempts from one start after another.
 *
 * A start that gains little is followed by the next. Where none reaches the target, the best ends
 * are refined to the least error nearby, for which a part of the budget is reserved.
 */
#ifndef CHASLES_SOLVE_POSE_H
#define CHASLES_SOLVE_POSE_H

#include "iterative/native/arm.h"

/* Where the results of one pose go, or of the first pose of a batch. */
typedef struct {
    double *q;              /* (n,) coordinates; NaN where no start could be evaluated */
    double *residual;       /* metre: of the distance, or the angle times the unit */
    unsigned char *success; /* whether the search converged */
    signed char *ending;    /* an Ending of attempt.h */
    int *iterations;        /* evaluations of forward kinematics */
    int *restarts;          /* starts after the first */
} Results;

/* Solves for the target of the problem, or the rigid pose nearest to it where it is nearly rigid
 * (_rigid.h); seed (n,) or NULL is where the first attempt begins. */
void solve_pose(const Problem *problem, const double *seed, const Results *results);

#endif
