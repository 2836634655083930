/* Dimensionless joint rates for a twist, within bounds.
 *
 * Rows of the Jacobian are multiplied by `row` (1 / length if linear, 1 if angular, 0 if ignored),
 * columns by `unit` (the length if prismatic, 1 if revolute), and rates are divided by `unit`.
 *
 * Source: F. Flacco, A. De Luca, O. Khatib, Motion control of redundant robots under joint
 * constraints: saturation in the null space, ICRA 2012, algorithm 1. */
#pragma once

#include "numerics/_svd.h"
#include "numerics/_vectors.h"
#include "velocity/native/damped_box.h"

typedef struct {
    int n, rank;   /* number of joints; number of task components, at most n */
    double border; /* singular value below which a direction is damped */
    double V[TWIST], row[TWIST];
    double *J;                   /* (6, n) */
    double *unit;                /* (n,) */
    double *lo, *hi;             /* (n,) bounds of the rates */
    double *z;                   /* (n,) secondary rates */
    double *y;                   /* (n,) the result */
    double *exact_lo, *exact_hi; /* (n,) the bounds in rad/s or m/s */
    char *limited;               /* (n,) whether a bound limits the rate of the joint */
    char *locked; /* (n,) whether both bounds of a joint are 0, so that the joint is excluded from
                     the problem */
    char *fixed;  /* (n,) whether a joint is fixed at a bound; the SVD leaves out its column */
    Svd svd;
    double *a, *b, *fixed_rate; /* (n,) terms a and b of the candidate rates a + b, and rates of the
                                   fixed joints */
    double *best_a, *best_b;    /* (n,) */
    char *best_fixed;           /* (n,) */
    DampedBox box;
    double *memory;
} RateProblem;

/* Allocates memory for n joints. Returns -1 on failure. */
int rate_problem_new(RateProblem *p, int n);

void rate_problem_free(RateProblem *p);

/* Computes the rates y for the twist s V, where s in [0, 1] is the largest factor for which y is
 * within the bounds. Joints that reach their bounds stay there. The other joints compensate for the
 * missing motion, unless the task needs damping. The member p->svd must be the decomposition of J.
 * Returns s. */
double solve_within_bounds(RateProblem *p);

/* Projects the secondary rates z into the null space, and adds them to y within the bounds. */
void add_null_motion(RateProblem *p);
