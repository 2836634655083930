/* Solutions of small linear systems, in place.
 *
 *   solve_ldlt       symmetric, made positive definite by damping; without square roots
 *   solve_cholesky   symmetric, positive semidefinite up to rounding; pivots are kept positive
 */
#ifndef CHASLES_LINEAR_SOLVE_H
#define CHASLES_LINEAR_SOLVE_H

#include <math.h>

#include "numerics/_tolerances.h"
#include "numerics/_vectors.h"

/* See solve_ldlt; inlined once for each m that is a constant there. */
static inline __attribute__((always_inline)) void solve_ldlt_of_size(double *A, int m, double *b)
{
    for (int i = 0; i < m; i++) {
        double inverse = 1 / A[i * m + i];
        for (int j = i + 1; j < m; j++) {
            double factor = A[j * m + i] * inverse;
            for (int k = i + 1; k <= j; k++) {
                A[j * m + k] -= factor * A[k * m + i];
            }
            b[j] -= factor * b[i];
        }
        A[i * m + i] = inverse;
    }
    for (int i = m; i-- > 0;) {
        double sum = b[i];
        for (int j = i + 1; j < m; j++) {
            sum -= A[j * m + i] * b[j];
        }
        b[i] = sum * A[i * m + i];
    }
}

/* Replaces b by the solution of A x = b. A (m, m) is symmetric and positive definite; its lower
 * half is read and destroyed. The usual sizes have loops of constant length, which the compiler
 * unrolls. */
static inline void solve_ldlt(double *A, int m, double *b)
{
    if (m == 6) {
        solve_ldlt_of_size(A, 6, b);
    } else if (m == 7) {
        solve_ldlt_of_size(A, 7, b);
    } else if (m == 5) {
        solve_ldlt_of_size(A, 5, b);
    } else {
        solve_ldlt_of_size(A, m, b);
    }
}

/* Replaces b by the solution of A x = b, for the leading (m, m) block of A, whose rows are `stride`
 * apart. A is symmetric; its lower half is read and replaced by its Cholesky factor. */
static inline void solve_cholesky(double *A, int m, int stride, double *b)
{
    for (int i = 0; i < m; i++) {
        double *row = A + i * stride;
        for (int j = 0; j <= i; j++) {
            const double *other = A + j * stride;
            double rest = row[j] - dot(row, other, j);
            row[j] = j < i ? rest / other[j] : sqrt(fmax(rest, CHOLESKY_LEAST_PIVOT));
        }
        b[i] = (b[i] - dot(row, b, i)) / row[i];
    }
    for (int i = m - 1; i >= 0; i--) {
        for (int j = i + 1; j < m; j++) {
            b[i] -= A[j * stride + i] * b[j];
        }
        b[i] /= A[i * stride + i];
    }
}

#endif
