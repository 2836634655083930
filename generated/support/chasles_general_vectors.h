/* Angles of vectors, and linear systems of six rows in them; part of chasles, the same for every
 * robot of six joints without a structure.
 */
#ifndef CHASLES_GENERAL_VECTORS_H
#define CHASLES_GENERAL_VECTORS_H

#include <float.h>

#include "chasles_vectors.h"

/* Minimax on |t| <= 1/2, for z = t^2: atan t = t + t z P(z) to 2^-57; highest power first. */
static const double chasles_general_arctangent[] = {
    0.010117105953140847, -0.02743532082961043, 0.04186527516045578, -0.051220140523104356,
    0.05858300759286596,  -0.0666381088370742,  0.07692073937540857, -0.09090896246194469,
    0.11111110659684081,  -0.14285714276386502, 0.19999999999903106, -0.3333333333333298};

/* The angles of points (x, y): of the nearest axis or diagonal, and from there. */
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

/* Reflects column j of a matrix of six rows, and those behind it; multiplies its determinant. */
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

/* Reflects six of the columns of a matrix to a triangle. */
CHASLES_INLINE void chasles_general_triangle(chasles_vector (*a)[6], int columns,
                                             chasles_vector *determinant)
{
    CHASLES_UNROLL
    for (int j = 0; j < 6; j++)
        chasles_general_reflected(a, j, columns, determinant);
}

/* Solves R x = b in place, or with R transposed. */
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

#endif
