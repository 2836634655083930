/* Orthogonal rows of a small matrix by plane rotations: Hestenes's one-sided Jacobi.
 *
 * Turned until they are orthogonal, the rows of W are singular values times unit vectors: the
 * decomposition W = Y^T (diag(s) V), where the rows of Y began as those of the identity. Small
 * singular values come out with as many digits as large ones, and rows that are nearly orthogonal
 * take few rotations.
 *
 * Source: M. R. Hestenes, Inversion of matrices by biorthogonalization and related results, 1958.
 */
#ifndef CHASLES_ORTHOGONAL_H
#define CHASLES_ORTHOGONAL_H

#include <math.h>

#define MOST_SWEEPS 40 /* over all pairs of rows; 5 to 8 are usual, 2 where little has changed */

static inline double rows_dot(const double *restrict a, const double *restrict b, int n)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

static inline void rows_turn(double *restrict a, double *restrict b, int n, double c, double s)
{
    for (int i = 0; i < n; i++) {
        double x = a[i], y = b[i];
        a[i] = c * x - s * y;
        b[i] = s * x + c * y;
    }
}

/* Whether two rows with squares aa, bb and product ab count as orthogonal; `scale` is the caller's.
 * True where one is NaN, or sweeps go on to the last. */
typedef int rows_test(double aa, double bb, double ab, double scale);

/* Turns pairs of the p rows of W (p, m) until all are orthogonal; those of Y (p, p), `stride` apart,
 * go along. */
static inline __attribute__((always_inline)) void rows_orthogonalize(double *W, int p, int m,
                                                                     double *Y, int stride,
                                                                     rows_test *orthogonal,
                                                                     double scale)
{
    int turned = 1;
    for (int sweep = 0; turned && sweep < MOST_SWEEPS; sweep++) {
        turned = 0;
        for (int i = 0; i < p; i++) {
            for (int j = i + 1; j < p; j++) {
                double *a = W + i * m, *b = W + j * m;
                double aa = rows_dot(a, a, m), bb = rows_dot(b, b, m), ab = rows_dot(a, b, m);
                if (orthogonal(aa, bb, ab, scale)) {
                    continue;
                }
                double tau = (bb - aa) / (2 * ab);
                double t = copysign(1 / (fabs(tau) + sqrt(1 + tau * tau)), tau);
                double c = 1 / sqrt(1 + t * t);
                rows_turn(a, b, m, c, c * t);
                rows_turn(Y + i * stride, Y + j * stride, p, c, c * t);
                turned = 1;
            }
        }
    }
}

#endif
