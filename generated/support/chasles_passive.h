/* Selects the solution nearest to a seed for a robot with loops whose passive joints have limits.
 * This file is part of chasles and is the same for every robot.
 *
 * The solutions are tested in the order of their distances from the seed. The configuration of a
 * solution includes the values of the passive joints. */
#ifndef CHASLES_PASSIVE_H
#define CHASLES_PASSIVE_H

#include "chasles_nearest.h"

/* Passive joints that have limits. The values of passive joints follow from the n coordinates of
 * the robot. In `moves`, the limits of the coordinates come first, then the limits of the passive
 * joints. */
typedef struct {
    int joints;
    int (*inside)(const chasles_moves *moves, const double *q);
} chasles_passive;

/* Returns whether passive joints are within their limits.
 *
 * n       is the number of coordinates.
 * joints  is the number of passive joints with limits.
 * index   contains the index of each joint in the configuration z.
 * turn    contains CHASLES_FULL_TURN for a joint whose full turns keep the configuration, otherwise
 * 0.
 */
static inline int chasles_passive_inside(const chasles_moves *moves, int n, int joints,
                                         const int *index, const double *turn, const double *z)
{
    for (int i = 0; i < joints; i++) {
        const double lower = moves->lower[n + i] - CHASLES_AT_LIMIT;
        double at = z[index[i]];
        if (turn[i] > 0 && lower > -INFINITY) {
            at += turn[i] * ceil((lower - at) / turn[i]);
        }
        if (!(at >= lower && at <= moves->upper[n + i] + CHASLES_AT_LIMIT)) {
            return 0;
        }
    }
    return 1;
}

/* Selects the solution nearest to a seed, like chasles_nearest, for a robot with limits of passive
 * joints. */
static inline int chasles_nearest_passive(const chasles_passive *p, const chasles_slots *of,
                                          const chasles_moves *moves, const double *q_seed,
                                          double *q, double *residual, double *margin)
{
    double left[CHASLES_MAX_SLOTS], at[CHASLES_MAX_JOINTS];
    const chasles_slots inside = {of->n, of->slots, of->q, left, of->margin, of->tolerance};
    int limited = 0;
    for (int i = 0; i < p->joints; i++) {
        limited |= moves->lower[of->n + i] > -INFINITY || moves->upper[of->n + i] < INFINITY;
    }
    memcpy(left, of->residual, (size_t)of->slots * sizeof *left);
    for (;;) {
        const int best = chasles_nearest(&inside, moves, q_seed, at, residual, margin);
        if (best < 0) {
            return chasles_none(of, q_seed, q, residual, margin);
        }
        if (!limited || p->inside(moves, at)) {
            memcpy(q, at, (size_t)of->n * sizeof *q);
            return best;
        }
        left[best] = INFINITY;
    }
}

#endif
