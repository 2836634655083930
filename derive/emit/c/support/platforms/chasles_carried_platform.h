/* Helper functions (vectors, polynomials, solution slots) for the solvers of a parallel platform
 * with further joints before its legs or on the platform. This file is part of chasles and is the
 * same for every robot. */
#ifndef CHASLES_CARRIED_PLATFORM_H
#define CHASLES_CARRIED_PLATFORM_H

#include <math.h>
#include <string.h>

#include "chasles_carried_tolerances.h"
#include "chasles_circle_roots.h"
#include "chasles_closure_modes.h"

/* Number of samples of a trigonometric polynomial, and maximum degree of the polynomial.
 * CHASLES_CELLS must be a multiple of the number of samples. */
#define CHASLES_CARRIED_SAMPLES 16
#define CHASLES_CARRIED_DEGREE 4
#define CHASLES_CARRIED_EVERY (CHASLES_CELLS / CHASLES_CARRIED_SAMPLES)

static double chasles_carried_dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void chasles_carried_cross(const double *a, const double *b, double *c)
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        c[i] = a[j] * b[k] - a[k] * b[j];
    }
}

/* Computes a trigonometric polynomial from its samples. */
static void chasles_carried_series(const double *values, chasles_circle_series *series)
{
    const double *cosine = chasles_circle_cosine, *sine = chasles_circle_cosine + 72;
    memset(series, 0, sizeof *series);
    for (int m = 0; m <= CHASLES_CARRIED_DEGREE; m++) {
        for (int j = 0; j < CHASLES_CARRIED_SAMPLES; j++) {
            const int at = CHASLES_CARRIED_EVERY * (m * j % CHASLES_CARRIED_SAMPLES);
            series->a[m] += (m ? 2.0 : 1.0) / CHASLES_CARRIED_SAMPLES * values[j] * cosine[at];
            series->b[m] += (m ? 2.0 : 0.0) / CHASLES_CARRIED_SAMPLES * values[j] * sine[at];
        }
        series->most = fmax(series->most, fmax(fabs(series->a[m]), fabs(series->b[m])));
    }
    series->noise = CHASLES_CARRIED_NOISE * (1.0 + series->most);
}

/* Writes NaN to the solution slots from `first` up to, but not including, `end`. The argument `n`
 * is the number of coordinates per slot. */
static void chasles_carried_unused(int first, int end, int n, double *q, double *residual,
                                   double *margin)
{
    for (int i = first * n; i < end * n; i++)
        q[i] = NAN;
    for (int k = first; k < end; k++)
        residual[k] = margin[k] = NAN;
}

/* Computes the pose of each solution of the legs by forward kinematics, and replaces the residual
 * of the solution by the residual of this pose. A margin above `least` is reduced to `least`. */
static void chasles_carried_reached(void (*fk)(const double *q, double *T), const double *T,
                                    double size, double least, int slots, int n, const double *q,
                                    double *residual, double *margin)
{
    for (int k = 0; k < slots; k++) {
        double reached[16];
        if (residual[k] != residual[k])
            continue;
        fk(q + n * k, reached);
        residual[k] = chasles_mode_residual(T, reached, residual[k], size);
        margin[k] = least < margin[k] ? least : margin[k];
    }
}

#endif
