/* Computes the determinant of M, its real roots, and the null vector of M. Each SIMD lane processes
 * one angle of the suppressed joint. This file is part of chasles and is the same for every robot.
 *
 * Let s and c be the sine and cosine of the half angle of joint v (see
 * chasles_general_equations.h). The six equations without y have the form (A s^2 + B s c + C c^2) x
 * = 0 with 6 x 3 matrices A, B and C. The six equations times s, and the six equations times c,
 * give the matrix rows [A B C 0] and [0 A B C] for the unknowns (s^3 x, s^2 c x, s c^2 x, c^3 x).
 */
#ifndef CHASLES_GENERAL_ROOTS_H
#define CHASLES_GENERAL_ROOTS_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_general_equations.h"
#include "chasles_vectors.h"

/* Coefficients of a minimax polynomial P, highest power first, with atan t = t + t z P(z) to 2^-57
 * for z = t^2 and |t| <= 1/2. */
static const double chasles_general_arctangent[] = {
    0.010117105953140847, -0.02743532082961043, 0.04186527516045578, -0.051220140523104356,
    0.05858300759286596,  -0.0666381088370742,  0.07692073937540857, -0.09090896246194469,
    0.11111110659684081,  -0.14285714276386502, 0.19999999999903106, -0.3333333333333298};

/* Computes the polar angle of the point (x, y) as the angle of the nearest axis or diagonal plus a
 * remainder, in every SIMD lane. */
CHASLES_INLINE chasles_vector chasles_general_angles(chasles_vector y, chasles_vector x)
{
    const double right = 1.57079632679489661923;
    const chasles_vector zero = {0.0};
    const chasles_vector width = chasles_vector_sizes(x), height = chasles_vector_sizes(y);
    const chasles_vector_mask steep = height > width;
    const chasles_vector large = chasles_vector_chosen(steep, height, width);
    const chasles_vector small = chasles_vector_chosen(steep, width, height);
    const chasles_vector_mask diagonal = small > 0.5 * large;
    const chasles_vector above = chasles_vector_chosen(diagonal, small - large, small);
    const chasles_vector below = chasles_vector_chosen(diagonal, small + large, large);
    const chasles_vector t = above / (below + DBL_MIN), z = t * t;
    chasles_vector series = zero + chasles_general_arctangent[0];
    CHASLES_UNROLL
    for (int k = 1; k < 12; k++)
        series = series * z + chasles_general_arctangent[k];
    chasles_vector angle = t + t * z * series;
    angle += chasles_vector_chosen(diagonal, zero + 0.5 * right, zero);
    angle = chasles_vector_chosen(steep, right - angle, angle);
    angle = chasles_vector_chosen(x < zero, 2.0 * right - angle, angle);
    return chasles_vector_signed(angle, y);
}

/* Applies the Householder reflection of column j to a six-row matrix, and updates the determinant.
 */
CHASLES_INLINE void chasles_general_reflected(chasles_vector (*a)[6], int j, int columns,
                                              chasles_vector *determinant)
{
    chasles_vector square = a[j][5] * a[j][5];
    CHASLES_UNROLL
    for (int i = j; i < 5; i++)
        square += a[j][i] * a[j][i];
    const chasles_vector norm = chasles_vector_signed(chasles_vector_square_roots(square), a[j][j]);
    const chasles_vector scale = 1.0 / (norm * (norm + a[j][j]) + DBL_MIN);
    *determinant *= norm;
    a[j][j] += norm;
    CHASLES_UNROLL
    for (int k = j + 1; k < columns; k++) {
        chasles_vector dot = a[j][5] * a[k][5];
        CHASLES_UNROLL
        for (int i = j; i < 5; i++)
            dot += a[j][i] * a[k][i];
        dot *= scale;
        CHASLES_UNROLL
        for (int i = j; i < 6; i++)
            a[k][i] -= dot * a[j][i];
    }
    a[j][j] = -norm;
}

/* Reduces six columns of a matrix to triangular form by Householder reflections. */
CHASLES_INLINE void chasles_general_triangle(chasles_vector (*a)[6], int columns,
                                             chasles_vector *determinant)
{
    CHASLES_UNROLL
    for (int j = 0; j < 6; j++)
        chasles_general_reflected(a, j, columns, determinant);
}

/* Solves R x = b in place for an upper triangular matrix R. */
static void chasles_general_upper(chasles_vector (*R)[6], chasles_vector *x)
{
    for (int j = 5; j >= 0; j--) {
        x[j] /= R[j][j];
        for (int i = 0; i < j; i++)
            x[i] -= R[j][i] * x[j];
    }
}

static void chasles_general_lower(chasles_vector (*R)[6], chasles_vector *x)
{
    for (int j = 0; j < 6; j++) {
        for (int i = 0; i < j; i++)
            x[j] -= R[j][i] * x[i];
        x[j] /= R[j][j];
    }
}

/* Computes det M and a 6 x 6 triangular matrix R, which is stored column by column and is singular
 * if M is singular. */
static void chasles_general_factored(const chasles_general_system *system, const chasles_vector *c,
                                     const chasles_vector *s, chasles_vector (*R)[6],
                                     chasles_vector *determinant)
{
    /* Array `high` contains the columns of A, B and C (the rows [A B C 0]), and array `low`
     * contains the columns of C, B and A (the rows [0 A B C]). */
    const chasles_vector zero = {0.0};
    chasles_vector high[9][6], low[9][6];
    for (int f = 0; f < 3; f++) {
        for (int k = 0; k < 3; k++) {
            for (int i = 0; i < 6; i++) {
                high[3 * f + k][i] = system->form[0][f][i][k] + *c * system->form[1][f][i][k] +
                                     *s * system->form[2][f][i][k];
            }
        }
    }
    memcpy(low, high + 6, 3 * sizeof *low);
    memcpy(low + 3, high + 3, 3 * sizeof *low);
    memcpy(low + 6, high, 3 * sizeof *low);
    *determinant = zero + 1.0;
    /* The steps of the two QR factorizations (of `high` and of `low`) alternate. While one
     * factorization waits for a square root or a quotient, the processor can advance the other. */
    CHASLES_UNROLL
    for (int j = 0; j < 3; j++) {
        chasles_general_reflected(high, j, 9, determinant);
        chasles_general_reflected(low, j, 9, determinant);
    }
    for (int k = 0; k < 3; k++) {
        memcpy(R[k], high[3 + k] + 3, 3 * sizeof *R[k]);
        memcpy(R[3 + k], high[6 + k] + 3, 3 * sizeof *R[k]);
        memcpy(R[k] + 3, low[6 + k] + 3, 3 * sizeof *R[k]);
        memcpy(R[3 + k] + 3, low[3 + k] + 3, 3 * sizeof *R[k]);
    }
    chasles_general_triangle(R, 6, determinant);
}

/* Computes the smallest singular vector of a triangular matrix by inverse iteration. */
static void chasles_general_null(chasles_vector (*R)[6], chasles_vector *x)
{
    const chasles_vector zero = {0.0}, one = zero + 1.0;
    chasles_vector largest = zero, square = zero;
    for (int j = 0; j < 6; j++) {
        R[j][j] += chasles_vector_signed(zero + CHASLES_PIVOT_FLOOR, R[j][j]);
        x[j] = one;
    }
    chasles_general_upper(R, x);
    chasles_general_lower(R, x);
    chasles_general_upper(R, x);
    for (int j = 0; j < 6; j++) {
        const chasles_vector size = chasles_vector_sizes(x[j]);
        largest = chasles_vector_chosen(size > largest, size, largest);
    }
    const chasles_vector part = 1.0 / (largest + DBL_MIN);
    for (int j = 0; j < 6; j++) {
        x[j] *= part;
        square += x[j] * x[j];
    }
    const chasles_vector norm = chasles_vector_square_roots(square);
    for (int j = 0; j < 6; j++)
        x[j] /= norm;
}

#define CHASLES_SAMPLES 24
#define CHASLES_HALF (CHASLES_SAMPLES / 2)
/* Number of Chebyshev nodes in each cell (angle interval), at which the determinant is sampled. */
#define CHASLES_NODES 12

/* Computes the coefficients of the determinant, a trigonometric polynomial, from samples of the
 * determinant. */
static void chasles_general_interpolated(const chasles_general_system *system,
                                         chasles_circle_series *series)
{
    const double *cosine = chasles_circle_cosine;
    double values[CHASLES_SAMPLES];
    chasles_vector R[6][6], c, s, determinant;
    for (int from = 0; from < CHASLES_SAMPLES; from += CHASLES_VECTOR_LANES) {
        for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
            CHASLES_LANE(c, l) = cosine[4 * (from + l)];
            CHASLES_LANE(s, l) = cosine[4 * (from + l) + 72];
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

/* Computes a polynomial that approximates the determinant in one cell, from samples of the
 * determinant. */
static void chasles_general_sampled(const void *source, chasles_circle_part *part)
{
    const chasles_general_system *system = (const chasles_general_system *)source;
    double values[CHASLES_NODES + CHASLES_VECTOR_LANES],
        terms[CHASLES_TERMS][CHASLES_TERMS] = {{0.0}};
    chasles_vector R[6][6], c, s, determinant;
    for (int from = 0; from < CHASLES_NODES; from += CHASLES_VECTOR_LANES) {
        for (int l = 0; l < CHASLES_VECTOR_LANES; l++) {
            const double z = chasles_circle_cosine[(4 * (from + l) + 2) % CHASLES_CELLS];
            CHASLES_LANE(c, l) = cos(part->from + part->radius * z);
            CHASLES_LANE(s, l) = sin(part->from + part->radius * z);
        }
        chasles_general_factored(system, &c, &s, R, &determinant);
        memcpy(values + from, &determinant, sizeof determinant);
    }
    /* The Chebyshev polynomials are converted to powers of z. */
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
