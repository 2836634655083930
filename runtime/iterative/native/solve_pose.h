/* Iterative inverse kinematics of one pose: attempts from several start configurations.
 *
 * If no attempt converges, the best results are refined to the nearest local minimum of the error.
 * A part of the evaluation budget is reserved for refining the best results. */
#pragma once

#include "iterative/native/arm.h"

/* Addresses of the results for one pose, or for the first pose of a batch. */
typedef struct {
    double *q; /* (n,) coordinates, or NaN if no start configuration could be evaluated at all */
    double *residual;       /* [m] the distance, or the angle times the unit length */
    unsigned char *success; /* whether the search has converged */
    signed char *ending;    /* a value of Ending, see attempt.h */
    int *iterations;        /* number of evaluations of forward kinematics */
    int *restarts;          /* number of start configurations after the first */
} Results;

/* Solves for the target pose, projected if it is nearly rigid (_rigid.h). The first start
 * configuration is `seed` (n,), unless it is NULL. */
void solve_pose(const Problem *problem, const double *seed, const Results *results);
