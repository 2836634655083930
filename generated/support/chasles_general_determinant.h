/* The determinant of M for many suppressed angles at once, one a lane, and the vector that M takes
 * to zero; part of chasles, the same for every robot of six joints without a structure.
 *
 * With sine s and cosine c of the half angle, each of the six equations without y is
 * (A s^2 + B s c + C c^2) x = 0. Times s and times c they are
 *
 *     [A B C 0]                                  [A B]         [A B]   orthogonal complements of
 *     [0 A B C] (s^3 x, s^2 c x, s c^2 x, c^3 x),                      A (above) and of C (below)
 *
 * of which reflections of A and of C leave a matrix (6, 6) for (s^2 c x, s c^2 x).
 */
#ifndef CHASLES_GENERAL_DETERMINANT_H
#define CHASLES_GENERAL_DETERMINANT_H

#include <float.h>
#include <math.h>
#include <string.h>

#include "chasles_general_equations.h"
#include "chasles_general_vectors.h"

/* The triangle (6, 6) that is singular where M is, by columns, and the determinant of M. */
static void chasles_general_factored(const chasles_general_system *system, const chasles_vector *c,
                                     const chasles_vector *s, chasles_vector (*R)[6],
                                     chasles_vector *determinant)
{
    /* Columns of A, B, C for those of s, then of C, B, A for those of c. */
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
    /* Side by side, for each waits for its roots and quotients. */
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

/* The unit vector that a triangle takes nearest to zero, by inverse iteration. */
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
    /* Squares of what a nearly singular triangle gives may be too large. */
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

#endif
