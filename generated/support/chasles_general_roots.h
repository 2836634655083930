/* The real roots of det M, a trigonometric polynomial of degree 8 in the suppressed angle; part of
 * chasles, the same for every robot of six joints without a structure.
 *
 * It is known from 24 samples; what is left of degrees above 8 tells its errors.
 */
#ifndef CHASLES_GENERAL_ROOTS_H
#define CHASLES_GENERAL_ROOTS_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_general_determinant.h"

#define CHASLES_SAMPLES 24
#define CHASLES_HALF (CHASLES_SAMPLES / 2)
/* Samples of a cell, at Chebyshev's nodes. */
#define CHASLES_NODES 12

/* The polynomial from the determinant's samples. */
static void chasles_general_interpolated(const chasles_general_system *system,
                                         chasles_circle_series *series)
{
    const double *cosine = chasles_circle_cosine;
    double values[CHASLES_SAMPLES];
    chasles_vector R[6][6], c, s, determinant;
    for (int from = 0; from < CHASLES_SAMPLES; from += CHASLES_LANES) {
        for (int l = 0; l < CHASLES_LANES; l++) {
            c[l] = cosine[4 * (from + l)];
            s[l] = cosine[4 * (from + l) + 72];
        }
        chasles_general_factored(system, &c, &s, R, &determinant);
        memcpy(values + from, &determinant, sizeof determinant);
    }
    series->most = series->noise = 0.0;
    double even[CHASLES_HALF + 1], odd[CHASLES_HALF + 1];
    for (int k = 0; k <= CHASLES_HALF; k++) {
        const double other = k % CHASLES_HALF ? values[CHASLES_SAMPLES - k] : 0.0;
        even[k] = values[k] + other;
        odd[k] = values[k] - other;
    }
    CHASLES_UNROLL
    for (int m = 0; m <= CHASLES_HALF; m++) {
        double a = 0.0, b = 0.0;
        CHASLES_UNROLL
        for (int k = 0; k <= CHASLES_HALF; k++) {
            a += even[k] * cosine[4 * k * m % CHASLES_CELLS];
            b += odd[k] * cosine[4 * k * m % CHASLES_CELLS + 72];
        }
        a *= 2.0 / CHASLES_SAMPLES, b *= 2.0 / CHASLES_SAMPLES;
        const double size = fabs(a) > fabs(b) ? fabs(a) : fabs(b);
        if (m > CHASLES_DEGREE) {
            series->noise = size > series->noise ? size : series->noise;
        } else {
            series->a[m] = m == 0 ? 0.5 * a : a, series->b[m] = b;
            series->most = size > series->most ? size : series->most;
        }
    }
    series->noise += DBL_EPSILON * series->most;
}

/* The same part from samples of the determinant in it: where it is small on a whole cell, several
 * roots being near, it is known there to more digits than from all around the circle. */
static void chasles_general_sampled(const void *source, chasles_circle_part *part)
{
    const chasles_general_system *system = (const chasles_general_system *)source;
    double values[CHASLES_NODES + CHASLES_LANES], terms[CHASLES_TERMS][CHASLES_TERMS] = {{0.0}};
    chasles_vector R[6][6], c, s, determinant;
    for (int from = 0; from < CHASLES_NODES; from += CHASLES_LANES) {
        for (int l = 0; l < CHASLES_LANES; l++) {
            const double z = chasles_circle_cosine[(4 * (from + l) + 2) % CHASLES_CELLS];
            c[l] = cos(part->from + part->radius * z);
            s[l] = sin(part->from + part->radius * z);
        }
        chasles_general_factored(system, &c, &s, R, &determinant);
        memcpy(values + from, &determinant, sizeof determinant);
    }
    /* Chebyshev's polynomials; then powers of z. */
    memset(part->t, 0, sizeof part->t);
    terms[0][0] = terms[1][1] = 1.0;
    part->noise = 0.0;
    for (int k = 0; k < CHASLES_NODES; k++) {
        double sum = 0.0;
        for (int i = 0; i < CHASLES_NODES; i++)
            sum += values[i] * chasles_circle_cosine[k * (4 * i + 2) % CHASLES_CELLS] /
                   (k > 0 ? 6.0 : 12.0);
        if (k > CHASLES_TERMS - 3)
            part->noise += fabs(sum);
        for (int i = 0; k < CHASLES_TERMS && i <= k; i++) {
            if (k > 1)
                terms[k][i] = (i > 0 ? 2.0 * terms[k - 1][i - 1] : 0.0) - terms[k - 2][i];
            part->t[i] += sum * terms[k][i];
        }
    }
}

#endif
