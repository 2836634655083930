/* Solution of small symmetric linear systems, in place and without square roots. */
#pragma once

#include "numerics/_tolerances.h"
#include "numerics/_vectors.h"

/* Implements solve_symmetric; the compiler inlines this function once for each constant m. */
static inline __attribute__((always_inline)) void solve_of_size(double *A, int m, int stride,
                                                                double *b)
{
    for (int i = 0; i < m; i++) {
        double inverse = 1 / larger(A[i * stride + i], MIN_PIVOT);
        for (int j = i + 1; j < m; j++) {
            double factor = A[j * stride + i] * inverse;
            for (int k = i + 1; k <= j; k++) {
                A[j * stride + k] -= factor * A[k * stride + i];
            }
            b[j] -= factor * b[i];
        }
        A[i * stride + i] = inverse;
    }
    for (int i = m; i-- > 0;) {
        double sum = b[i];
        for (int j = i + 1; j < m; j++) {
            sum -= A[j * stride + i] * b[j];
        }
        b[i] = sum * A[i * stride + i];
    }
}

/* Replaces b by the solution of A x = b, for the leading (m, m) block of A with the row stride
 * `stride`. A is symmetric and positive semidefinite up to rounding; its lower half is overwritten.
 * The compiler unrolls the loops for the usual sizes. */
static inline void solve_symmetric(double *A, int m, int stride, double *b)
{
    if (m == 6 && stride == 6) {
        solve_of_size(A, 6, 6, b);
    } else if (m == 7 && stride == 7) {
        solve_of_size(A, 7, 7, b);
    } else if (m == 5 && stride == 5) {
        solve_of_size(A, 5, 5, b);
    } else {
        solve_of_size(A, m, stride, b);
    }
}
