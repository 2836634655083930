/* Damped least squares within bounds, for one Jacobian after another along a path.
 *
 * The solver finds the x nearest to J x = y, J (6, n), with lower <= x <= upper. All numbers are
 * pure: the caller has scaled rows and columns to one unit. Each small singular value is damped by
 * the law of numerics/_tolerances.h; where that x violates a bound, x minimises
 * |J x - y|^2 + sum over i of d_i^2 (v_i . x)^2 within the bounds, by an active-set method.
 *
 * J changes little from one step of a path to the next. The rotations U are therefore kept: applied
 * to the next J they leave rows that are nearly orthogonal already.
 *
 * Source: Chiaverini, Siciliano and Egeland 1994 (numerical filtering, here of all small singular
 * values); Maciejewski and Klein 1989 (keeping U); Stark and Parker 1995 (the active set).
 */
#ifndef CHASLES_DAMPED_BOX_H
#define CHASLES_DAMPED_BOX_H

#include "numerics/_vectors.h"

typedef struct {
    int n;
    int moving;                   /* columns that are not always zero, 1 to n */
    double border;                /* e, a singular value */
    double least_damping;         /* the d to begin with */
    double damping;               /* d now; see damped_box_adapt */
    int age;                      /* decompositions since U began as the identity */
    double U[TWIST * TWIST];      /* u_i in rows */
    double sigma[TWIST];          /* s_i, in no order */
    double damping_square[TWIST]; /* d_i^2 */
    double *rows;                 /* (6, n): s_i v_i */
    double *x;                    /* (n,) the result */
    int *at;                      /* (n,) -1 or 1 where x is at its lower or upper bound, else 0 */
    double *H, *A;                /* (n, n): the matrix of the bounded problem; of its free part */
    double *g, *z;                /* (n,): its right-hand side; the solution for the free part */
    int *free;                    /* (n,): indices of the free variables */
} DampedBox;

/* Allocates memory for n columns, which damped_box_free returns; 0 if there is none. */
int damped_box_new(DampedBox *box, int n, double border, double damping);

void damped_box_free(DampedBox *box);

/* Decomposes J (6, n). Returns the smallest of its min(6, moving) singular values. */
double damped_box_decompose(DampedBox *box, const double *J);

/* Computes x for y (6,) from the last decomposition, without bounds. */
void damped_box_solve(DampedBox *box, const double *y);

/* Moves x, as damped_box_solve left it, to the solution within the bounds (n,). A variable at a
 * bound has exactly its value. Nothing is computed where x violates no bound. */
void damped_box_bound(DampedBox *box, const double *lower, const double *upper);

/* Returns |J x - y|^2 for the x found. */
double damped_box_residual(const DampedBox *box, const double *y);

/* Adapts d to how well J predicted a step (Marquardt), from the squared error before the step, as J
 * predicted it for after the step, and after it. At the border of the workspace a step along a lost
 * direction, whose effect J overrates, would otherwise go back and forth across the singularity. */
void damped_box_adapt(DampedBox *box, double before, double expected, double after);

#endif
