/* The equations of a platform on six rods in Study coordinates, for many poses at once (one pose
 * per SIMD lane). This file is part of chasles and is the same for every robot.
 *
 * Quaternions e and g = p e, with e.g = 0, represent the rotation b -> e b / e and the position p.
 * A rod of length l from the base point a to the platform point b satisfies |g + e b - a e|^2 = l^2
 * e.e. With the matrices L and R of
 * left and right multiplication, let M = R(b) - L(a), c = |a|^2 + |b|^2 - l^2 and S = c + 2 L(a)
 * R(b). The equation of the rod is then g.g + 2 g.M e + e.S e = 0. Subtracting the equation of the
 * last rod eliminates g.g from the other equations. For constant b, all coefficients are linear in
 * a and c, and thus in the path parameter t.
 *
 * Source:
 *     Wampler 1996, Forward displacement analysis of general six-in-parallel SPS (Stewart) platform
 *     manipulators using soma coordinates: forty solutions.
 */
#ifndef CHASLES_HEXAPOD_SYSTEM_H
#define CHASLES_HEXAPOD_SYSTEM_H

#include <math.h>
#include <string.h>

#include "chasles_vectors.h"

#define CHASLES_RODS 6
#define CHASLES_SOMA 8

typedef struct {
    chasles_vector re, im;
} chasles_hexapod_lanes;

/* A complex number. */
typedef struct {
    double re, im;
} chasles_hexapod_number;

/* Coefficients of the rod equations: the entries (0, 1), (0, 2), (0, 3), (1, 2), (1, 3) and (2, 3)
 * of the antisymmetric matrix M, and the upper triangle of S. */
typedef struct {
    chasles_hexapod_number M[CHASLES_RODS][6], S[CHASLES_RODS][10];
} chasles_hexapod_forms;

/* The coefficients of the rod equations at the start of a path, and their change from the start to
 * the end of the path. */
typedef struct {
    chasles_hexapod_forms at, change;
    int moves; /* whether M and S also change along the path, not only the constants c */
} chasles_hexapod_path;

/* The coefficients of the rod equations at the path parameter of each SIMD lane. */
typedef struct {
    chasles_hexapod_lanes M[CHASLES_RODS][6], S[CHASLES_RODS][10];
} chasles_hexapod_place;

static inline void chasles_hexapod_add(chasles_hexapod_lanes *sum, const chasles_hexapod_lanes *x,
                                       const chasles_hexapod_lanes *y)
{
    sum->re += x->re * y->re - x->im * y->im;
    sum->im += x->re * y->im + x->im * y->re;
}

static inline void chasles_hexapod_subtract(chasles_hexapod_lanes *sum,
                                            const chasles_hexapod_lanes *x,
                                            const chasles_hexapod_lanes *y)
{
    sum->re -= x->re * y->re - x->im * y->im;
    sum->im -= x->re * y->im + x->im * y->re;
}

/* Computes the coefficients M and S in the equation of one rod. */
static void chasles_hexapod_rod(const chasles_hexapod_number *a, const double *b,
                                chasles_hexapod_number c, chasles_hexapod_number *M,
                                chasles_hexapod_number *S)
{
    /* Axis and sign of the entries (0, 1), (0, 2), (0, 3), (1, 2), (1, 3) and (2, 3) of the
     * matrices L and R. */
    static const int axis[6] = {0, 1, 2, 2, 1, 0};
    static const double of_left[6] = {-1.0, -1.0, -1.0, -1.0, 1.0, -1.0};
    static const double of_right[6] = {-1.0, -1.0, -1.0, 1.0, -1.0, 1.0};
    chasles_hexapod_number L[4][4] = {{{0.0, 0.0}}};
    double R[4][4] = {{0.0}};
    for (int k = 0, i = 0; i < 4; i++) {
        for (int j = i + 1; j < 4; j++, k++) {
            R[i][j] = of_right[k] * b[axis[k]], R[j][i] = -R[i][j];
            L[i][j].re = of_left[k] * a[axis[k]].re, L[j][i].re = -L[i][j].re;
            L[i][j].im = of_left[k] * a[axis[k]].im, L[j][i].im = -L[i][j].im;
            M[k].re = R[i][j] - L[i][j].re, M[k].im = -L[i][j].im;
        }
    }
    for (int k = 0, i = 0; i < 4; i++) {
        for (int j = i; j < 4; j++, k++) {
            S[k].re = i == j ? c.re : 0.0, S[k].im = i == j ? c.im : 0.0;
            for (int m = 0; m < 4; m++)
                S[k].re += 2.0 * L[i][m].re * R[m][j], S[k].im += 2.0 * L[i][m].im * R[m][j];
        }
    }
}

static void chasles_hexapod_forms_of(const chasles_hexapod_number (*a)[3], const double (*b)[3],
                                     const chasles_hexapod_number *c, chasles_hexapod_forms *forms)
{
    const int last = CHASLES_RODS - 1;
    for (int i = 0; i < CHASLES_RODS; i++)
        chasles_hexapod_rod(a[i], b[i], c[i], forms->M[i], forms->S[i]);
    for (int i = 0; i < last; i++) {
        for (int k = 0; k < 6; k++)
            forms->M[i][k].re -= forms->M[last][k].re, forms->M[i][k].im -= forms->M[last][k].im;
        for (int k = 0; k < 10; k++)
            forms->S[i][k].re -= forms->S[last][k].re, forms->S[i][k].im -= forms->S[last][k].im;
    }
}

/* Interpolates a coefficient at the path parameter t of each SIMD lane. */
static inline void chasles_hexapod_between(const chasles_hexapod_number *at,
                                           const chasles_hexapod_number *change,
                                           const chasles_vector *t, chasles_hexapod_lanes *value)
{
    value->re = at->re + *t * change->re;
    value->im = at->im + *t * change->im;
}

/* Computes the coefficients of the rod equations at a path parameter. The first call for a path
 * must set the argument `all`. Without `all`, only the coefficients that change along the path are
 * updated. */
static void chasles_hexapod_placed(const chasles_hexapod_path *path, const chasles_vector *t,
                                   int all, chasles_hexapod_place *place)
{
    static const int diagonal[4] = {0, 4, 7, 9};
    for (int i = 0; i < CHASLES_RODS; i++) {
        if (all || path->moves) {
            for (int k = 0; k < 6; k++)
                chasles_hexapod_between(&path->at.M[i][k], &path->change.M[i][k], t,
                                        &place->M[i][k]);
            for (int k = 0; k < 10; k++)
                chasles_hexapod_between(&path->at.S[i][k], &path->change.S[i][k], t,
                                        &place->S[i][k]);
        } else {
            for (int k = 0; k < 4; k++) {
                const int d = diagonal[k];
                chasles_hexapod_between(&path->at.S[i][d], &path->change.S[i][d], t,
                                        &place->S[i][d]);
            }
        }
    }
}

/* Computes half the gradient of a rod equation at (e, g). */
static inline void chasles_hexapod_gradient(const chasles_hexapod_lanes *M,
                                            const chasles_hexapod_lanes *S,
                                            const chasles_hexapod_lanes *x,
                                            chasles_hexapod_lanes *half)
{
    memset(half, 0, CHASLES_SOMA * sizeof *half);
    for (int k = 0, i = 0; i < 4; i++) {
        for (int j = i + 1; j < 4; j++, k++) {
            chasles_hexapod_add(half + 4 + i, M + k, x + j);
            chasles_hexapod_subtract(half + 4 + j, M + k, x + i);
            chasles_hexapod_add(half + j, M + k, x + 4 + i);
            chasles_hexapod_subtract(half + i, M + k, x + 4 + j);
        }
    }
    for (int k = 0, i = 0; i < 4; i++) {
        for (int j = i; j < 4; j++, k++) {
            chasles_hexapod_add(half + i, S + k, x + j);
            if (j > i)
                chasles_hexapod_add(half + j, S + k, x + i);
        }
    }
}

/* Computes half the Jacobian of the equations. The last column of `a` contains the values of the
 * equations, times -1/2. The last row of `a` makes Newton steps orthogonal to the pose vector in
 * the argument `of`, because only the direction of a pose vector matters. */
static void chasles_hexapod_newton(const chasles_hexapod_place *place,
                                   const chasles_hexapod_lanes *x, const chasles_hexapod_lanes *of,
                                   chasles_hexapod_lanes (*a)[CHASLES_SOMA + 1])
{
    for (int i = 0; i < CHASLES_RODS; i++)
        chasles_hexapod_gradient(place->M[i], place->S[i], x, a[i]);
    for (int k = 0; k < 4; k++) {
        chasles_hexapod_lanes *last = a[CHASLES_RODS - 1] + 4 + k;
        last->re += x[4 + k].re, last->im += x[4 + k].im;
        a[6][k].re = 0.5 * x[4 + k].re, a[6][k].im = 0.5 * x[4 + k].im;
        a[6][4 + k].re = 0.5 * x[k].re, a[6][4 + k].im = 0.5 * x[k].im;
    }
    for (int k = 0; k < CHASLES_SOMA; k++)
        a[7][k].re = of[k].re, a[7][k].im = -of[k].im;
    for (int i = 0; i < 8; i++) {
        chasles_hexapod_lanes sum = {CHASLES_ZERO, CHASLES_ZERO};
        for (int k = 0; k < CHASLES_SOMA && i < 7; k++)
            chasles_hexapod_subtract(&sum, a[i] + k, x + k);
        a[i][8].re = 0.5 * sum.re, a[i][8].im = 0.5 * sum.im;
    }
}

/* Differentiates each equation with respect to the path parameter, at constant x, and writes the
 * derivatives, times -1/2, to the last column of `a`. */
static void chasles_hexapod_along(const chasles_hexapod_path *path, const chasles_hexapod_lanes *x,
                                  chasles_hexapod_lanes (*a)[CHASLES_SOMA + 1])
{
    chasles_vector zero = {0.0};
    chasles_hexapod_lanes square = {zero, zero}, half[CHASLES_SOMA], M[6], S[10];
    for (int k = 0; k < 4; k++)
        chasles_hexapod_add(&square, x + k, x + k);
    for (int i = 0; i < CHASLES_RODS; i++) {
        chasles_hexapod_lanes sum = {zero, zero};
        if (path->moves) {
            for (int k = 0; k < 6; k++) {
                M[k].re = zero + path->change.M[i][k].re;
                M[k].im = zero + path->change.M[i][k].im;
            }
            for (int k = 0; k < 10; k++) {
                S[k].re = zero + path->change.S[i][k].re;
                S[k].im = zero + path->change.S[i][k].im;
            }
            chasles_hexapod_gradient(M, S, x, half);
            for (int k = 0; k < CHASLES_SOMA; k++)
                chasles_hexapod_subtract(&sum, half + k, x + k);
        } else {
            const chasles_hexapod_number *c = path->change.S[i];
            sum.re = -(c->re * square.re - c->im * square.im);
            sum.im = -(c->re * square.im + c->im * square.re);
        }
        a[i][8].re = 0.5 * sum.re, a[i][8].im = 0.5 * sum.im;
    }
    a[6][8].re = a[6][8].im = a[7][8].re = a[7][8].im = zero;
}

/* Swaps two values in the SIMD lanes that a mask selects. */
static inline void chasles_hexapod_exchange(const chasles_vector_mask *mask, chasles_vector *x,
                                            chasles_vector *y)
{
    const chasles_vector one = *x;
    *x = chasles_vector_chosen(*mask, *y, one);
    *y = chasles_vector_chosen(*mask, one, *y);
}

static inline void chasles_hexapod_square(const chasles_hexapod_lanes *x, chasles_vector *square)
{
    *square = x->re * x->re + x->im * x->im;
}

/* Solves eight linear equations by elimination, with separate pivots in each SIMD lane. The last
 * column of `a` is the right-hand side. */
static void chasles_hexapod_solve(chasles_hexapod_lanes (*a)[CHASLES_SOMA + 1],
                                  chasles_hexapod_lanes *x)
{
    for (int j = 0; j < CHASLES_SOMA; j++) {
        chasles_vector most, size;
        chasles_hexapod_square(&a[j][j], &most);
        for (int i = j + 1; i < CHASLES_SOMA; i++) {
            chasles_hexapod_square(&a[i][j], &size);
            const chasles_vector_mask larger = size > most;
            chasles_hexapod_exchange(&larger, &size, &most);
            for (int k = j; k <= CHASLES_SOMA; k++) {
                chasles_hexapod_exchange(&larger, &a[i][k].re, &a[j][k].re);
                chasles_hexapod_exchange(&larger, &a[i][k].im, &a[j][k].im);
            }
        }
        const chasles_hexapod_lanes inverse = {a[j][j].re / most, -a[j][j].im / most};
        for (int k = j + 1; k <= CHASLES_SOMA; k++) {
            chasles_hexapod_lanes scaled = {CHASLES_ZERO, CHASLES_ZERO};
            chasles_hexapod_add(&scaled, &inverse, &a[j][k]);
            a[j][k] = scaled;
        }
        for (int i = j + 1; i < CHASLES_SOMA; i++) {
            for (int k = j + 1; k <= CHASLES_SOMA; k++)
                chasles_hexapod_subtract(&a[i][k], &a[i][j], &a[j][k]);
        }
    }
    for (int j = CHASLES_SOMA - 1; j >= 0; j--) {
        x[j] = a[j][CHASLES_SOMA];
        for (int k = j + 1; k < CHASLES_SOMA; k++)
            chasles_hexapod_subtract(x + j, &a[j][k], x + k);
    }
}

#endif
