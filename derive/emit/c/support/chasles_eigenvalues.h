/* Eigenvalues of a real matrix (16, 16): balanced, brought to Hessenberg form, then by Francis'
 * double steps; part of chasles, the same for every robot.
 */
#ifndef CHASLES_EIGENVALUES_H
#define CHASLES_EIGENVALUES_H

#include <float.h>
#include <math.h>

/* Rows and columns scaled by powers of two until their sums agree (Osborne). */
static void chasles_general_balance(double (*H)[16])
{
    for (int round = 0, changed = 1; changed && round < 8; round++) {
        changed = 0;
        for (int i = 0; i < 16; i++) {
            double column = 0.0, row = 0.0;
            for (int k = 0; k < 16; k++) {
                if (k == i)
                    continue;
                column += fabs(H[k][i]);
                row += fabs(H[i][k]);
            }
            if (!(column > 0.0 && row > 0.0))
                continue;
            int up, down;
            frexp(row, &up);
            frexp(column, &down);
            const int half = (up - down) / 2;
            if (half > -2 && half < 2)
                continue;
            changed = 1;
            for (int k = 0; k < 16; k++)
                H[i][k] = ldexp(H[i][k], -half);
            for (int k = 0; k < 16; k++)
                H[k][i] = ldexp(H[k][i], half);
        }
    }
}

/* Householder's reduction to a matrix that is zero below its first subdiagonal. */
static void chasles_general_hessenberg(double (*H)[16])
{
    for (int j = 0; j < 14; j++) {
        double norm = 0.0, h[16] = {0.0}, sum[16] = {0.0};
        for (int i = j + 1; i < 16; i++)
            norm += H[i][j] * H[i][j];
        norm = copysign(sqrt(norm), H[j + 1][j]);
        const double scale = norm * (norm + H[j + 1][j]);
        if (scale == 0.0)
            continue;
        for (int i = j + 1; i < 16; i++)
            h[i] = H[i][j];
        h[j + 1] += norm;
        for (int i = j + 1; i < 16; i++) {
            for (int k = 0; k < 16; k++)
                sum[k] += h[i] * H[i][k];
        }
        for (int i = j + 1; i < 16; i++) {
            const double factor = h[i] / scale;
            for (int k = 0; k < 16; k++)
                H[i][k] -= factor * sum[k];
        }
        for (int i = 0; i < 16; i++) {
            double along = 0.0;
            for (int k = 0; k < 16; k++)
                along += H[i][k] * h[k];
            along /= scale;
            for (int k = 0; k < 16; k++)
                H[i][k] -= along * h[k];
        }
        for (int i = j + 2; i < 16; i++)
            H[i][j] = 0.0;
    }
}

/* The eigenvalues of a Hessenberg matrix by Francis's double step; how many were found. */
static int chasles_general_eigenvalues(double (*H)[16], double *re, double *im)
{
    int high = 15, steps = 0, found = 0;
    double moved = 0.0;
    while (high >= 0) {
        int low = high;
        for (; low > 0; low--) {
            const double size = fabs(H[low - 1][low - 1]) + fabs(H[low][low]);
            if (fabs(H[low][low - 1]) <= DBL_EPSILON * (size > 0.0 ? size : 1.0))
                break;
        }
        if (low == high) {
            re[found] = H[high][high] + moved, im[found++] = 0.0;
            high--, steps = 0;
            continue;
        }
        double x = H[high][high], y = H[high - 1][high - 1];
        double w = H[high][high - 1] * H[high - 1][high];
        if (low == high - 1) {
            const double half = 0.5 * (y - x), square = half * half + w, root = sqrt(fabs(square));
            if (square >= 0.0) {
                const double far = half + copysign(root, half);
                re[found] = x + moved + far, im[found++] = 0.0;
                re[found] = x + moved - (far != 0.0 ? w / far : 0.0), im[found++] = 0.0;
            } else {
                re[found] = x + moved + half, im[found++] = root;
                re[found] = x + moved + half, im[found++] = -root;
            }
            high -= 2, steps = 0;
            continue;
        }
        if (++steps > 60)
            return found;
        if (steps % 10 == 0) {
            /* A shift out of the ordinary, where the ordinary ones go round in circles. */
            moved += x;
            for (int i = 0; i <= high; i++)
                H[i][i] -= x;
            const double size = fabs(H[high][high - 1]) + fabs(H[high - 1][high - 2]);
            x = y = 0.75 * size;
            w = -0.4375 * size * size;
        }
        double p = 0.0, q = 0.0, r = 0.0;
        int m = high - 2;
        for (; m >= low; m--) {
            const double z = H[m][m], a = x - z, b = y - z;
            p = (a * b - w) / H[m + 1][m] + H[m][m + 1];
            q = H[m + 1][m + 1] - z - a - b;
            r = H[m + 2][m + 1];
            const double size = fabs(p) + fabs(q) + fabs(r);
            p /= size, q /= size, r /= size;
            if (m == low)
                break;
            const double small = fabs(H[m][m - 1]) * (fabs(q) + fabs(r));
            const double large =
                fabs(p) * (fabs(H[m - 1][m - 1]) + fabs(z) + fabs(H[m + 1][m + 1]));
            if (small <= DBL_EPSILON * large)
                break;
        }
        for (int k = m; k < high; k++) {
            const int last = k + 1 == high;
            double size = 1.0;
            if (k > m) {
                p = H[k][k - 1], q = H[k + 1][k - 1], r = last ? 0.0 : H[k + 2][k - 1];
                size = fabs(p) + fabs(q) + fabs(r);
                if (size == 0.0)
                    continue;
                p /= size, q /= size, r /= size;
            }
            const double norm = copysign(sqrt(p * p + q * q + r * r), p);
            if (k > m) {
                H[k][k - 1] = -norm * size;
                H[k + 1][k - 1] = 0.0;
                if (!last)
                    H[k + 2][k - 1] = 0.0;
            } else if (m > low) {
                H[k][k - 1] = -H[k][k - 1];
            }
            p += norm;
            const double a = p / norm, b = q / norm, c = r / norm;
            q /= p, r /= p;
            if (last) {
                for (int j = k; j <= high; j++) {
                    const double t = H[k][j] + q * H[k + 1][j];
                    H[k][j] -= t * a, H[k + 1][j] -= t * b;
                }
                for (int i = low; i <= high; i++) {
                    const double t = a * H[i][k] + b * H[i][k + 1];
                    H[i][k] -= t, H[i][k + 1] -= t * q;
                }
            } else {
                const int end = k + 3 < high ? k + 3 : high;
                for (int j = k; j <= high; j++) {
                    const double t = H[k][j] + q * H[k + 1][j] + r * H[k + 2][j];
                    H[k][j] -= t * a, H[k + 1][j] -= t * b, H[k + 2][j] -= t * c;
                }
                for (int i = low; i <= end; i++) {
                    const double t = a * H[i][k] + b * H[i][k + 1] + c * H[i][k + 2];
                    H[i][k] -= t, H[i][k + 1] -= t * q, H[i][k + 2] -= t * r;
                }
            }
        }
    }
    return found;
}

#endif
