/* The inner loops of the generalized ufuncs of chasles.velocity._rates. */
#pragma once

#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <numpy/ndarraytypes.h>

/* Damped least-squares joint rates for a twist, within bounds.
 * Operands: J (6, n), V (6), lower (n), upper (n), z (n), unit (n), row (6), border, rank
 *   -> rates (n), twist (6), damping, smallest, direction (6), scale, limited (n) */
void solve_loop(char **arguments, const npy_intp *dimensions, const npy_intp *steps, void *data);

/* Rate bounds from joint, rate and acceleration limits.
 * Operands: q (n), lower (n), upper (n), rate limit (n), acceleration limit (n), previous rate (n),
 * dt
 *   -> minimum rate (n), maximum rate (n) */
void bounds_loop(char **arguments, const npy_intp *dimensions, const npy_intp *steps, void *data);

/* The product of the singular values, and its gradient with respect to q.
 * Operands: J (6, n), H (6, n, n), unit (n), row (6), rank -> w, gradient (n) */
void gradient_loop(char **arguments, const npy_intp *dimensions, const npy_intp *steps, void *data);
