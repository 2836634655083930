/* Selects the solution nearest to a seed for a robot whose motors move several joints. This file is
 * part of chasles and is the same for every robot.
 *
 * The limits of the coordinates and joints form a polytope of allowed configurations. For each
 * revolute joint, the search tries the number of full turns nearest to the seed within the limits,
 * and the adjacent numbers. If none of these numbers of full turns gives a solution within the
 * limits, the search tries up to four full turns more or fewer than the nearest number. */
#ifndef CHASLES_COUPLINGS_H
#define CHASLES_COUPLINGS_H

#include "chasles_nearest.h"

/* Maximum number of full turns by which a returned joint angle may differ from the angle within the
 * limits nearest to the seed. */
#define CHASLES_MAX_WINDINGS 4

/* The couplings of n coordinates q and the joints theta. The values phi of the independent joints
 * determine the coordinates q. */
typedef struct {
    int n, joints;
    const double *measure; /* matrix (n, n) of the equation phi = measure q + constants */
    const double *step;    /* change of q per full turn of each phi (n, n); 0 if phi cannot turn */
    const double *joint;   /* theta = joint q + offset (joints, n) */
    const double *offset;
    const int *only;     /* for each joint, the index of the only phi that moves the joint, or -1 if
                            several phi move the joint */
    const double *ratio; /* change of each joint per unit of phi[only] */
    const int *alone;    /* for each phi, the index of the only coordinate that a full turn of phi
                            changes, or -1 */
} chasles_couplings;

/* Returns the scalar product of two rows. Terms with a zero factor are skipped, because q may
 * contain infinite limits, and 0 * infinity is NaN. */
static inline double chasles_row(int n, const double *row, const double *q)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        sum += row[i] == 0 ? 0 : row[i] * q[i];
    }
    return sum;
}

/* Writes to `low` and `high` the limits of the independent joint value phi[j] minus its constant
 * term. The limits of phi[j] follow from the limits of the coordinates and of the joints. */
static inline void chasles_range(const chasles_couplings *c, const chasles_moves *moves, int j,
                                 double *low, double *high)
{
    const double *row = c->measure + j * c->n;
    *low = *high = 0;
    for (int i = 0; i < c->n; i++) {
        const double a = row[i] == 0 ? 0 : row[i] * moves->lower[i];
        const double b = row[i] == 0 ? 0 : row[i] * moves->upper[i];
        *low += a < b ? a : b;
        *high += a < b ? b : a;
    }
    for (int i = 0; i < c->joints; i++) {
        if (c->only[i] == j) {
            const double a = (moves->lower[c->n + i] - c->offset[i]) / c->ratio[i];
            const double b = (moves->upper[c->n + i] - c->offset[i]) / c->ratio[i];
            *low = fmax(*low, fmin(a, b));
            *high = fmin(*high, fmax(a, b));
        }
    }
}

/* Returns the distance of the coordinates q from the seed, or INFINITY if a coordinate or a joint
 * violates a limit. A coordinate that violates a limit only by rounding is set to the limit. */
static inline double chasles_distance_within(const chasles_couplings *c, const chasles_moves *moves,
                                             const double *q_seed, double *q)
{
    double distance = 0;
    for (int i = 0; i < c->n; i++) {
        const double lower = moves->lower[i], upper = moves->upper[i];
        if (!(q[i] >= lower - CHASLES_AT_LIMIT && q[i] <= upper + CHASLES_AT_LIMIT)) {
            return INFINITY;
        }
        q[i] = fmin(fmax(q[i], lower), upper);
        distance = fmax(distance, fabs(q[i] - q_seed[i]) * moves->scale[i]);
    }
    for (int i = 0; i < c->joints; i++) {
        const double theta = c->offset[i] + chasles_row(c->n, c->joint + i * c->n, q);
        if (!(theta >= moves->lower[c->n + i] - CHASLES_AT_LIMIT &&
              theta <= moves->upper[c->n + i] + CHASLES_AT_LIMIT)) {
            return INFINITY;
        }
    }
    return distance;
}

/* Writes the first and the last number of full turns to try for an independent joint. Returns 0 if
 * no number of full turns keeps the joint within its limits, or if the seed is not finite. */
static inline int chasles_turns(const chasles_couplings *c, const chasles_moves *moves,
                                const double *slot, const double *q_seed, int j, int width,
                                double *first, double *last)
{
    const double *row = c->measure + j * c->n;
    const double phi = chasles_row(c->n, row, slot), rounding = CHASLES_AT_LIMIT;
    double low, high, near = rint((chasles_row(c->n, row, q_seed) - phi) / CHASLES_FULL_TURN);
    chasles_range(c, moves, j, &low, &high);
    *first = ceil((low - phi) / CHASLES_FULL_TURN - rounding);
    *last = floor((high - phi) / CHASLES_FULL_TURN + rounding);
    near = fmin(fmax(near, *first), *last);
    if (!(*first <= near && near <= *last && fabs(near) < 1e15)) {
        return 0;
    }
    *first = fmax(*first, near - (c->alone[j] < 0 ? width : 0));
    *last = fmin(*last, near + (c->alone[j] < 0 ? width : 0));
    return 1;
}

/* Returns whether an independent joint may make full turns. If the period of a coordinate in
 * `moves` is 0, full turns of the coordinate are not allowed. A fixed coordinate has the period 0.
 */
static inline int chasles_can_turn(const chasles_couplings *c, const chasles_moves *moves, int j)
{
    const double *step = c->step + j * c->n;
    for (int i = 0; i < c->n; i++) {
        if (step[i] != 0) {
            return c->alone[j] < 0 || fabs(step[i]) != CHASLES_FULL_TURN || moves->turn[i] > 0;
        }
    }
    return 0;
}

/* Shifts a solution by the full turns that bring it nearest to the seed. Returns the distance of
 * the shifted solution from the seed, or INFINITY if no shifted solution is within the limits. Of
 * several shifted solutions at the same distance, the one with the smallest sum of displacements is
 * selected. */
static inline double chasles_wound(const chasles_couplings *c, const chasles_moves *moves,
                                   const double *slot, const double *q_seed, int width, double *q)
{
    double first[CHASLES_MAX_JOINTS], last[CHASLES_MAX_JOINTS], turns[CHASLES_MAX_JOINTS];
    double at[CHASLES_MAX_JOINTS], nearest = INFINITY, least = INFINITY;
    int j = 0;
    for (int i = 0; i < c->n; i++) {
        first[i] = last[i] = 0;
        if (chasles_can_turn(c, moves, i) &&
            !chasles_turns(c, moves, slot, q_seed, i, width, &first[i], &last[i])) {
            return INFINITY;
        }
        turns[i] = first[i];
    }
    while (j < c->n) {
        double distance, sum = 0;
        for (int k = 0; k < c->n; k++) {
            at[k] = slot[k];
            for (int i = 0; i < c->n; i++) {
                at[k] += turns[i] * c->step[i * c->n + k];
            }
        }
        distance = chasles_distance_within(c, moves, q_seed, at);
        for (int k = 0; k < c->n; k++) {
            sum += fabs(at[k] - q_seed[k]) * moves->scale[k];
        }
        if (distance < INFINITY &&
            (chasles_rounded(distance) < chasles_rounded(nearest) ||
             (chasles_rounded(distance) == chasles_rounded(nearest) && sum < least))) {
            nearest = distance;
            least = sum;
            memcpy(q, at, (size_t)c->n * sizeof *q);
        }
        for (j = 0; j < c->n && turns[j] == last[j]; j++) {
            turns[j] = first[j];
        }
        if (j < c->n) {
            turns[j]++;
        }
    }
    return nearest;
}

/* Selects the solution nearest to a seed, like chasles_nearest, for a robot with couplings. `moves`
 * contains the limits of the coordinates, followed by the limits of the joints. */
static inline int chasles_nearest_coupled(const chasles_couplings *c, const chasles_slots *of,
                                          const chasles_moves *moves, const double *q_seed,
                                          double *q, double *residual, double *margin)
{
    double distance[CHASLES_MAX_SLOTS], at[CHASLES_MAX_JOINTS];
    int best = -1, width = 1;
    for (; best < 0 && width <= CHASLES_MAX_WINDINGS; width *= CHASLES_MAX_WINDINGS) {
        for (int slot = 0; slot < of->slots; slot++) {
            distance[slot] = of->residual[slot] <= of->tolerance
                                 ? chasles_wound(c, moves, of->q + slot * of->n, q_seed, width, at)
                                 : INFINITY;
        }
        best = chasles_least(of->slots, distance);
    }
    if (best < 0) {
        return chasles_none(of, q_seed, q, residual, margin);
    }
    width /= CHASLES_MAX_WINDINGS;
    chasles_wound(c, moves, of->q + best * of->n, q_seed, width, at);
    memcpy(q, at, (size_t)of->n * sizeof *q);
    *residual = of->residual[best];
    *margin = of->margin[best];
    return best;
}

#endif
