/* The turn from one pose to another, as a rotation vector.
 *
 * Source: R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to Robotic Manipulation,
 * 1994, chapter 2.
 */
#ifndef CHASLES_TURN_H
#define CHASLES_TURN_H

#include <math.h>
#include <string.h>

typedef struct {
    double angle, sine, cosine; /* angle in [0, pi] */
} Turn;

/* Axis times angle of B A^T, for the rotations inside of two poses by rows: from A to B, in base
 * axes, along the shorter way round. NaN flows through. */
static inline Turn turn_between(const double *A, const double *B, double *omega)
{
    double R[3][3];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            R[i][j] = B[4 * i] * A[4 * j] + B[4 * i + 1] * A[4 * j + 1] +
                      B[4 * i + 2] * A[4 * j + 2];
        }
    }
    double w[3] = {(R[2][1] - R[1][2]) / 2, (R[0][2] - R[2][0]) / 2, (R[1][0] - R[0][1]) / 2};
    double sine = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    double cosine = (R[0][0] + R[1][1] + R[2][2] - 1) / 2, angle = atan2(sine, cosine);
    double factor = sine > 0 ? angle / sine : 1;
    if (cosine < 0) {
        /* Beyond a quarter turn the axis is a column of the symmetric part: at a half turn the
         * sine is lost. */
        int k = R[0][0] > R[1][1] ? 0 : 1;
        k = R[2][2] > R[k][k] ? 2 : k;
        double a[3], length = 0, side = 0;
        for (int i = 0; i < 3; i++) {
            a[i] = (R[i][k] + R[k][i]) / 2 - (i == k ? cosine : 0);
            length += a[i] * a[i];
            side += a[i] * w[i];
        }
        memcpy(w, a, sizeof w);
        factor = copysign(angle / sqrt(length), side);
    }
    for (int i = 0; i < 3; i++) {
        omega[i] = factor * w[i];
    }
    return (Turn){angle, sine, cosine};
}

#endif
