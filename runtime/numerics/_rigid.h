/* Projection of rounded poses to SE(3).
 *
 * The nearest rotation in the Frobenius norm is the orthogonal factor U of the polar decomposition
 * R = U H. Newton's iteration R <- R - R (R^T R - 1) / 2 converges quadratically to the orthogonal
 * factor U.
 *
 * Source: N. J. Higham, Computing the polar decomposition - with applications, 1986; A. Bjorck, C.
 * Bowie, An iterative algorithm for computing the best estimate of an orthogonal matrix, 1971. */
#pragma once

#include <float.h>
#include <math.h>
#include <string.h>

#include "numerics/_tolerances.h"
#include "numerics/_vectors.h"

#define MAX_POLAR_STEPS 4 /* maximum number of steps; two steps usually suffice */

/* The class of a matrix (4, 4): rigid up to rounding error, nearly rigid, or not rigid. */
typedef enum { RIGID, NEAR_RIGID, NOT_RIGID } Rigidity;

/* Writes the entries xx, yy, zz, xy, yz and zx of R^T R - 1, where R is the rotation of a pose.
 * Returns half the squared distance |R - U|^2 of R from the nearest rotation U, to first order. */
static inline double off_orthogonal2(const double *T, double *product)
{
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        product[i] = T[i] * T[i] + T[4 + i] * T[4 + i] + T[8 + i] * T[8 + i] - 1;
        product[3 + i] = T[i] * T[j] + T[4 + i] * T[4 + j] + T[8 + i] * T[8 + j];
    }
    return dot3(product, product) / 8 + dot3(product + 3, product + 3) / 4;
}

static inline double determinant(const double *T)
{
    double normal[3];
    cross(T, T + 4, normal);
    return dot3(normal, T + 8);
}

/* Tests whether the last row is 0 0 0 1 to the tolerance and the translation is finite. */
static inline int has_pose_frame(const double *T, double tolerance)
{
    return fabs(T[12]) <= tolerance && fabs(T[13]) <= tolerance && fabs(T[14]) <= tolerance &&
           fabs(T[15] - 1) <= tolerance && (T[3] + T[7] + T[11]) * 0 == 0;
}

/* Returns RIGID, NEAR_RIGID or NOT_RIGID. A matrix that is not finite is NOT_RIGID. */
static inline Rigidity rigidity(const double *T)
{
    double product[6], off2 = off_orthogonal2(T, product);
    if (!(off2 <= NEARLY_RIGID * NEARLY_RIGID && determinant(T) > 0 &&
          has_pose_frame(T, NEARLY_RIGID))) {
        return NOT_RIGID;
    }
    int exact = off2 <= RIGID_TO_ROUNDING * RIGID_TO_ROUNDING && has_pose_frame(T, 0);
    return exact ? RIGID : NEAR_RIGID;
}

static inline int is_in_units(double number, double per_unit)
{
    double parts = number * per_unit;
    return fabs(parts - rint(parts)) <= ROUNDED_NUMBER;
}

static inline int in_units(const double *T, double per_unit)
{
    for (int k = 0; k < 12; k++) {
        if (k % 4 != 3 && !is_in_units(T[k], per_unit)) {
            return 0;
        }
    }
    return 1;
}

/* Tests whether the three entries of a translation are multiples of a decimal unit. */
static inline int is_placed_in_units(const double *T, double per_unit)
{
    return is_in_units(T[3], per_unit) && is_in_units(T[7], per_unit) &&
           is_in_units(T[11], per_unit);
}

static inline int is_of_single_precision(double number)
{
    return (double)(float)number == number;
}

static inline int is_single(const double *T)
{
    for (int k = 0; k < 12; k++) {
        if (k % 4 != 3 && !is_of_single_precision(T[k])) {
            return 0;
        }
    }
    return 1;
}

/* Returns the maximum rounding error of the entries of a NEAR_RIGID rotation. The result is 0
 * unless the entries have at most nine decimals or are in single precision. */
static inline double coarseness(const double *T)
{
    double product[6], off = sqrt(off_orthogonal2(T, product));
    for (double per_unit = 1e3; per_unit <= 1e9; per_unit *= 10) {
        double half = 0.5 / per_unit;
        if (off <= ROUNDED_OFF * half && in_units(T, per_unit)) {
            return half;
        }
    }
    double half = FLT_EPSILON / 4;
    return off <= ROUNDED_OFF * half && is_single(T) ? half : 0;
}

/* Returns the maximum least-squares residual of a solution for a NEAR_RIGID pose. */
static inline double reached_by_rounding(const double *T)
{
    double product[6], off = fmax(sqrt(off_orthogonal2(T, product)), coarseness(T));
    for (int k = 0; k < 4; k++) {
        off = fmax(off, fabs(T[12 + k] - (k == 3)));
    }
    return ROUNDED * off;
}

/* If the pose is axis-aligned and its translation is rounded, returns the maximum residual that
 * this rounding can cause, otherwise 0. */
static inline double placed_by_rounding(const double *T)
{
    if (!in_units(T, FEWEST_DECIMALS) || is_placed_in_units(T, WRITTEN_DECIMALS)) {
        return 0;
    }
    for (double per_unit = FEWEST_DECIMALS; per_unit <= MAX_DECIMALS; per_unit *= 10) {
        if (is_placed_in_units(T, per_unit)) {
            return ROUNDED * 0.5 / per_unit;
        }
    }
    double size = fmax(fmax(fabs(T[3]), fabs(T[7])), fmax(fabs(T[11]), 1));
    int single = is_of_single_precision(T[3]) && is_of_single_precision(T[7]) &&
                 is_of_single_precision(T[11]);
    return single ? ROUNDED * FLT_EPSILON / 4 * size : 0;
}

static inline void nearest_rigid(const double *T, double *out)
{
    static const double last_row[] = {0, 0, 0, 1};
    double e[6];
    memcpy(out, T, 12 * sizeof *out);
    memcpy(out + 12, last_row, sizeof last_row);
    for (int step = 0; step < MAX_POLAR_STEPS; step++) {
        if (off_orthogonal2(out, e) <= POLAR_CONVERGED * POLAR_CONVERGED) {
            return;
        }
        for (double *row = out; row < out + 12; row += 4) {
            double x = row[0], y = row[1], z = row[2];
            row[0] -= (x * e[0] + y * e[3] + z * e[5]) / 2;
            row[1] -= (x * e[3] + y * e[1] + z * e[4]) / 2;
            row[2] -= (x * e[5] + y * e[4] + z * e[2]) / 2;
        }
    }
}
