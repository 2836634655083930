/* Computes the rigid pose nearest to a 4 x 4 matrix. This file is part of chasles and is the same
 * for every robot.
 *
 * Inverse kinematics does not correct a target pose T, so its residual is at least the distance of
 * T from a rigid pose. Poses in single precision or read from text should first be projected onto
 * rigid poses.
 *
 * Example:
 *
 *   double rigid[16];
 *   if (chasles_project(T, 1e-5, rigid)) robot_ik(rigid, q, residual, margin);
 */
#ifndef CHASLES_RIGID_H
#define CHASLES_RIGID_H

#include <math.h>

/* Writes the rigid pose nearest to T (4 x 4) to `rigid`, and returns 1. The pointers `rigid` and T
 * may be equal. The rotation of the rigid pose is nearest to the rotation part of T in the
 * Frobenius norm. Returns 0 and leaves `rigid` unchanged if T is not finite, is left-handed, or
 * deviates from a rigid pose by more than the tolerance (radian, at most 0.1). The deviation of T
 * is |R^T R - 1| / sqrt(8) for the rotation part R, or the error of an entry in the last row of T.
 *
 * The iteration R <- R (3 - R^T R) / 2 converges quadratically to the orthogonal factor of R's
 * polar decomposition (Bjorck and Bowie 1971, Higham 1986). */
static inline int chasles_project(const double *T, double tolerance, double *rigid)
{
    double R[9], E[9], off2 = 0, sum = 0;
    int i, j, k, step;
    const double determinant = T[0] * (T[5] * T[10] - T[6] * T[9]) -
                               T[1] * (T[4] * T[10] - T[6] * T[8]) +
                               T[2] * (T[4] * T[9] - T[5] * T[8]);
    for (k = 0; k < 16; k++) {
        sum += T[k] * 0;
    }
    for (k = 0; k < 9; k++) {
        R[k] = T[k / 3 * 4 + k % 3];
    }
    for (step = 0; step < 6; step++) {
        for (i = 0; i < 3; i++) {
            for (j = 0; j < 3; j++) {
                E[3 * i + j] = R[i] * R[j] + R[3 + i] * R[3 + j] + R[6 + i] * R[6 + j] - (i == j);
                off2 += step == 0 ? E[3 * i + j] * E[3 * i + j] / 8 : 0;
            }
        }
        for (k = 0; k < 9; k += 3) {
            const double x = R[k], y = R[k + 1], z = R[k + 2];
            for (j = 0; j < 3; j++) {
                R[k + j] -= (x * E[j] + y * E[3 + j] + z * E[6 + j]) / 2;
            }
        }
    }
    if (!(sum == 0 && off2 <= tolerance * tolerance && determinant > 0 &&
          fabs(T[12]) <= tolerance && fabs(T[13]) <= tolerance && fabs(T[14]) <= tolerance &&
          fabs(T[15] - 1) <= tolerance)) {
        return 0;
    }
    for (k = 0; k < 12; k++) {
        rigid[k] = k % 4 == 3 ? T[k] : R[k / 4 * 3 + k % 4];
    }
    for (k = 12; k < 16; k++) {
        rigid[k] = k == 15;
    }
    return 1;
}

#endif
