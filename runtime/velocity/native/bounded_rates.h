/* Joint rates of a twist within bounds, in pure numbers.
 *
 * Rows of the Jacobian are multiplied by `row` (1 / length for linear ones, 1 for angular ones, 0
 * for rows that do not count), columns by `unit` (the length for a slider, 1 for a revolute joint),
 * and rates divided by `unit`.
 *
 * Source: F. Flacco, A. De Luca, O. Khatib, Motion control of redundant robots under joint
 * constraints: saturation in the null space, ICRA 2012, algorithm 1.
 */
#ifndef CHASLES_BOUNDED_RATES_H
#define CHASLES_BOUNDED_RATES_H

#include "numerics/_svd.h"
#include "numerics/_vectors.h"

typedef struct {
    int n, rank;   /* joints; rows that count, at most n */
    double border; /* singular value below which a direction is damped */
    double V[TWIST], row[TWIST];
    double *J;                   /* (6, n) */
    double *unit;                /* (n,) */
    double *lo, *hi;             /* (n,) bounds of the rates */
    double *z;                   /* (n,) secondary rates */
    double *y;                   /* (n,) the result */
    double *exact_lo, *exact_hi; /* (n,) the bounds in rad/s or m/s */
    char *limited;               /* (n,) whether a bound determines the rate of the joint */
    char *locked;                /* (n,) joints that do not move: the others are the whole arm */
    char *held; /* (n,) joints that are held at a bound, as columns that the SVD leaves out */
    Svd svd;
    double *a, *b, *held_rate; /* (n,) candidates y = a + b; rates of the joints held */
    double *best_a, *best_b;   /* (n,) */
    char *best_held;           /* (n,) */
    double *memory;
} RateProblem;

/* Allocates the memory for n joints, which rate_problem_free returns; -1 if there is none. */
int rate_problem_new(RateProblem *p, int n);

void rate_problem_free(RateProblem *p);

/* Computes the rates y for the twist V, or for s V with the largest s in [0, 1] that the bounds
 * leave. Joints at their bounds are held there, and the others make up for them as long as they can
 * without damping. Expects p->svd to be the decomposition of J. Returns s. */
double solve_within_bounds(RateProblem *p);

/* Adds the part of the secondary rates z to y that does not change the twist, within the bounds. */
void add_null_motion(RateProblem *p);

#endif
