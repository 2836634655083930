/* Orthogonalization of matrix rows by plane rotations: Hestenes's one-sided Jacobi method.
 *
 * After the rotations, the matrix is Y^T diag(s) V: each row is a singular value times a unit
 * vector, and Y, initially the identity, accumulates the rotations. Small and large singular values
 * have the same relative accuracy. Nearly orthogonal rows need few rotations.
 *
 * Source: M. R. Hestenes, Inversion of matrices by biorthogonalization and related results, 1958.
 */
#pragma once

#include <math.h>

#include "numerics/_vectors.h"

#define MAX_SWEEPS 40 /* maximum number of sweeps; usually 5 to 8, or 2 after small changes */

/* Replaces rows a and b by c a - s b and s a + c b. */
static inline void rotate_rows(double *restrict a, double *restrict b, int n, double c, double s)
{
    for (int i = 0; i < n; i++) {
        double x = a[i], y = b[i];
        a[i] = c * x - s * y;
        b[i] = s * x + c * y;
    }
}

/* Tests whether two rows are orthogonal, from their squared lengths aa and bb and their product ab,
 * relative to `scale`. */
typedef int orthogonality_test(double aa, double bb, double ab, double scale);

/* Rotates pairs of rows of W (p, m) until all rows of W are orthogonal. The rows of Y (p, p), with
 * the row stride `stride`, are rotated in the same way. */
static inline __attribute__((always_inline)) void orthogonalize_rows(double *W, int p, int m,
                                                                     double *Y, int stride,
                                                                     orthogonality_test *orthogonal,
                                                                     double scale)
{
    int rotated = 1;
    for (int sweep = 0; rotated && sweep < MAX_SWEEPS; sweep++) {
        rotated = 0;
        for (int i = 0; i < p; i++) {
            for (int j = i + 1; j < p; j++) {
                double *a = W + i * m, *b = W + j * m;
                double aa = dot(a, a, m), bb = dot(b, b, m), ab = dot(a, b, m);
                if (orthogonal(aa, bb, ab, scale)) {
                    continue;
                }
                double tau = (bb - aa) / (2 * ab);
                double t = copysign(1 / (fabs(tau) + sqrt(1 + tau * tau)), tau);
                double c = 1 / sqrt(1 + t * t);
                rotate_rows(a, b, m, c, c * t);
                rotate_rows(Y + i * stride, Y + j * stride, p, c, c * t);
                rotated = 1;
            }
        }
    }
}
