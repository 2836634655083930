/* Scalar, vector and pose functions. A pose is 16 doubles, 4 x 4 row-major; a twist is six doubles,
 * linear part first. */
#pragma once

#include <math.h>

#define TWIST 6
#define POSE 16

/* Inline maximum and minimum of two numbers that are not NaN; fmax and fmin are slower. */
static inline double larger(double a, double b)
{
    return a > b ? a : b;
}

static inline double smaller(double a, double b)
{
    return a < b ? a : b;
}

/* Clamps a value to [lower, upper]. Returns `lower` for NaN. */
static inline double clamp(double value, double lower, double upper)
{
    return fmin(fmax(value, lower), upper);
}

static inline double dot(const double *restrict a, const double *restrict b, int n)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

static inline double dot3(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Returns a . b for vectors (6,). */
static inline double dot6(const double *a, const double *b)
{
    return (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]) + (a[4] * b[4] + a[5] * b[5]);
}

/* Writes the cross product a x b into `out`. */
static inline void cross(const double *a, const double *b, double *out)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline void rotate(const double *T, const double *x, double *out)
{
    for (int i = 0; i < 3; i++) {
        out[i] = T[4 * i] * x[0] + T[4 * i + 1] * x[1] + T[4 * i + 2] * x[2];
    }
}

static inline void rotate_back(const double *T, const double *x, double *out)
{
    for (int i = 0; i < 3; i++) {
        out[i] = T[i] * x[0] + T[4 + i] * x[1] + T[8 + i] * x[2];
    }
}
