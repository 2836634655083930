/* Damped least squares within bounds, for a sequence of dimensionless Jacobians along a path.
 *
 * The solver finds the least-squares solution x of J x = y, with J (6, n) and lower <= x <= upper.
 * Small singular values are damped by the rule in numerics/_tolerances.h. If x violates a bound, an
 * active-set method minimizes |J x - y|^2 + sum over i of d_i^2 (v_i . x)^2 within the bounds.
 *
 * J changes little between steps of a path, so a decomposition usually starts from the U of the
 * previous step.
 *
 * Source: Chiaverini, Siciliano and Egeland 1994 (numerical filtering); Maciejewski and Klein 1989
 * (reuse of U); Stark and Parker 1995 (active set). */
#pragma once

#include "numerics/_vectors.h"

typedef struct {
    int n;
    int moving;                   /* number of columns that are not always zero, from 1 to n */
    double border;                /* the damping threshold e */
    double least_damping;         /* the initial d */
    double damping;               /* the current value of d; see damped_box_adapt */
    int age;                      /* number of decompositions since U was reset to the identity */
    double U[TWIST * TWIST];      /* U, whose rows are u_i */
    double sigma[TWIST];          /* s_i, not sorted */
    double damping_square[TWIST]; /* d_i^2 */
    double *rows;                 /* (6, n) rows s_i v_i */
    double *x;                    /* (n,) the result */
    int *at;                      /* (n,) -1 or 1 if x is at its lower or upper bound, otherwise 0
                                   */
    double *H, *A; /* (n, n): matrix H of the equation H x = g without bounds; submatrix A of H for
                      the free variables */
    double *g, *z; /* (n,): right-hand side g; solution z for the free variables */
    int *free;     /* (n,): indices of the free variables */
} DampedBox;

/* Allocates memory for n columns. Returns 0 on failure. */
int damped_box_new(DampedBox *box, int n);

/* Begins a sequence of Jacobians with damping threshold `border` and initial damping `damping`. */
void damped_box_start(DampedBox *box, double border, double damping);

void damped_box_free(DampedBox *box);

/* Computes the singular value decomposition of the Jacobian J (6, n). Returns the k-th largest
 * singular value, where k = min(6, box->moving). The remaining singular values are always 0. */
double damped_box_decompose(DampedBox *box, const double *J);

/* Computes the unbounded solution x for the right-hand side y (6,) with the last decomposition. */
void damped_box_solve(DampedBox *box, const double *y);

/* Moves the solution x of damped_box_solve to the best solution within the bounds (n,). A variable
 * at a bound has exactly the value of the bound. */
void damped_box_bound(DampedBox *box, const double *lower, const double *upper);

/* Returns |J x - y|^2. */
double damped_box_residual(const DampedBox *box, const double *y);

/* Adapts d to the accuracy of the linear prediction (Marquardt), from the squared error before a
 * step, the predicted error and the error after the step. This damping avoids oscillation at the
 * singularity at the workspace boundary. */
void damped_box_adapt(DampedBox *box, double before, double expected, double after);
