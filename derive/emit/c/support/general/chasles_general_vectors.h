/* Vectors of numbers, of as many samples or solutions, and linear systems of six rows in them; part
 * of chasles, the same for every robot of six revolute joints.
 */
#ifndef CHASLES_GENERAL_VECTORS_H
#define CHASLES_GENERAL_VECTORS_H

#include <float.h>
#include <math.h>
#include <stdint.h>

/* As wide as registers are: wider vectors would go through memory. */
#if defined(__AVX512F__)
#define CHASLES_LANES 8
#elif defined(__AVX__)
#define CHASLES_LANES 4
#else
#define CHASLES_LANES 2
#endif

/* GCC's and Clang's vectors: of plain arrays, sums would go through memory. */
typedef double chasles_general_lanes __attribute__((vector_size(8 * CHASLES_LANES)));
typedef int64_t chasles_general_mask __attribute__((vector_size(8 * CHASLES_LANES)));

#define CHASLES_INLINE static inline __attribute__((always_inline))
/* Matrices of vectors stay in registers where their indices are known. */
#define CHASLES_UNROLL _Pragma("GCC unroll 16")

/* By bits: what is not chosen may be NaN. */
CHASLES_INLINE chasles_general_lanes chasles_general_chosen(chasles_general_mask where,
                                                            chasles_general_lanes x,
                                                            chasles_general_lanes y)
{
    return (chasles_general_lanes)((where & (chasles_general_mask)x) |
                                   (~where & (chasles_general_mask)y));
}

CHASLES_INLINE chasles_general_lanes chasles_general_sizes(chasles_general_lanes x)
{
    return (chasles_general_lanes)((chasles_general_mask)x & INT64_MAX);
}

/* The size of x with the sign of y. */
CHASLES_INLINE chasles_general_lanes chasles_general_signed(chasles_general_lanes x,
                                                            chasles_general_lanes y)
{
    return (chasles_general_lanes)(((chasles_general_mask)x & INT64_MAX) |
                                   ((chasles_general_mask)y & INT64_MIN));
}

CHASLES_INLINE chasles_general_lanes chasles_general_square_roots(chasles_general_lanes x)
{
    for (int l = 0; l < CHASLES_LANES; l++)
        x[l] = sqrt(x[l]);
    return x;
}

/* Minimax on |t| <= 1/2, for z = t^2: atan t = t + t z P(z) to 2^-57; highest power first. */
static const double chasles_general_arctangent[] = {
    0.010117105953140847, -0.02743532082961043, 0.04186527516045578, -0.051220140523104356,
    0.05858300759286596,  -0.0666381088370742,  0.07692073937540857, -0.09090896246194469,
    0.11111110659684081,  -0.14285714276386502, 0.19999999999903106, -0.3333333333333298};

/* The angles of points (x, y): of the nearest axis or diagonal, and from there. */
CHASLES_INLINE chasles_general_lanes chasles_general_angles(chasles_general_lanes y,
                                                            chasles_general_lanes x)
{
    const double right = 1.57079632679489661923;
    const chasles_general_lanes zero = {0.0};
    const chasles_general_lanes width = chasles_general_sizes(x), height = chasles_general_sizes(y);
    const chasles_general_mask steep = height > width;
    const chasles_general_lanes large = chasles_general_chosen(steep, height, width);
    const chasles_general_lanes small = chasles_general_chosen(steep, width, height);
    const chasles_general_mask diagonal = small > 0.5 * large;
    const chasles_general_lanes above = chasles_general_chosen(diagonal, small - large, small);
    const chasles_general_lanes below = chasles_general_chosen(diagonal, small + large, large);
    const chasles_general_lanes t = above / (below + DBL_MIN), z = t * t;
    chasles_general_lanes series = zero + chasles_general_arctangent[0];
    CHASLES_UNROLL
    for (int k = 1; k < 12; k++)
        series = series * z + chasles_general_arctangent[k];
    chasles_general_lanes angle = t + t * z * series;
    angle += chasles_general_chosen(diagonal, zero + 0.5 * right, zero);
    angle = chasles_general_chosen(steep, right - angle, angle);
    angle = chasles_general_chosen(x < zero, 2.0 * right - angle, angle);
    return chasles_general_signed(angle, y);
}

/* Reflects column j of a matrix of six rows, and those behind it; multiplies its determinant. */
CHASLES_INLINE void chasles_general_reflected(chasles_general_lanes (*a)[6], int j, int columns,
                                              chasles_general_lanes *determinant)
{
    chasles_general_lanes square = a[j][5] * a[j][5];
    CHASLES_UNROLL
    for (int i = j; i < 5; i++)
        square += a[j][i] * a[j][i];
    const chasles_general_lanes norm =
        chasles_general_signed(chasles_general_square_roots(square), a[j][j]);
    const chasles_general_lanes scale = 1.0 / (norm * (norm + a[j][j]) + DBL_MIN);
    *determinant *= norm;
    a[j][j] += norm;
    CHASLES_UNROLL
    for (int k = j + 1; k < columns; k++) {
        chasles_general_lanes dot = a[j][5] * a[k][5];
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
CHASLES_INLINE void chasles_general_triangle(chasles_general_lanes (*a)[6], int columns,
                                             chasles_general_lanes *determinant)
{
    CHASLES_UNROLL
    for (int j = 0; j < 6; j++)
        chasles_general_reflected(a, j, columns, determinant);
}

/* Solves R x = b in place, or with R transposed. */
static void chasles_general_upper(chasles_general_lanes (*R)[6], chasles_general_lanes *x)
{
    for (int j = 5; j >= 0; j--) {
        x[j] /= R[j][j];
        for (int i = 0; i < j; i++)
            x[i] -= R[j][i] * x[j];
    }
}

static void chasles_general_lower(chasles_general_lanes (*R)[6], chasles_general_lanes *x)
{
    for (int j = 0; j < 6; j++) {
        for (int i = 0; i < j; i++)
            x[j] -= R[j][i] * x[i];
        x[j] /= R[j][j];
    }
}

#endif
