/* Computes the cosines and sines of several angles. This file is part of chasles and is the same
 * for every robot.
 *
 * Uses libmvec, the vector library of glibc, if the compiler supports AVX2 or AVX-512. Each libmvec
 * call computes the cosines or sines of four or eight angles. Without libmvec, libm computes the
 * cosines and sines. The results of libmvec and libm differ by at most one unit in the last place.
 * Define CHASLES_PLAIN to use libm everywhere. */
#ifndef CHASLES_COS_SIN_H
#define CHASLES_COS_SIN_H

#include <math.h>

/* GCC 12 computed wrong results when it packed scalar code into AVX-512 vectors. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("no-tree-slp-vectorize")
#endif

#if defined(__x86_64__) && defined(__GLIBC__) && !defined(CHASLES_PLAIN)
#if defined(__AVX512F__)
#define CHASLES_ANGLES 8
#define CHASLES_MANY_COS _ZGVeN8v_cos
#define CHASLES_MANY_SIN _ZGVeN8v_sin
#elif defined(__AVX2__)
#define CHASLES_ANGLES 4
#define CHASLES_MANY_COS _ZGVdN4v_cos
#define CHASLES_MANY_SIN _ZGVdN4v_sin
#endif
#endif

#ifdef CHASLES_ANGLES
#include <string.h>

typedef double chasles_angles __attribute__((vector_size(CHASLES_ANGLES * sizeof(double))));
#ifdef __cplusplus
extern "C" {
#endif
chasles_angles CHASLES_MANY_COS(chasles_angles);
chasles_angles CHASLES_MANY_SIN(chasles_angles);
#ifdef __cplusplus
}
#endif

#define CHASLES_ANGLE(i) (k + (i) < n ? angle[k + (i)] : 0.0)
static inline void chasles_cos_sin(int n, const double *angle, double *c, double *s)
{
    for (int k = 0; k < n; k += CHASLES_ANGLES) {
        size_t bytes = (size_t)(n - k < CHASLES_ANGLES ? n - k : CHASLES_ANGLES) * sizeof(double);
        /* The vector of angles is assembled in registers. */
        const chasles_angles some = {
            CHASLES_ANGLE(0), CHASLES_ANGLE(1), CHASLES_ANGLE(2), CHASLES_ANGLE(3),
#if CHASLES_ANGLES == 8
            CHASLES_ANGLE(4), CHASLES_ANGLE(5), CHASLES_ANGLE(6), CHASLES_ANGLE(7),
#endif
        };
        chasles_angles result = CHASLES_MANY_COS(some);
        memcpy(c + k, &result, bytes);
        result = CHASLES_MANY_SIN(some);
        memcpy(s + k, &result, bytes);
    }
}
#else
static inline void chasles_cos_sin(int n, const double *angle, double *c, double *s)
{
    for (int k = 0; k < n; k++) {
        c[k] = cos(angle[k]);
        s[k] = sin(angle[k]);
    }
}
#endif

#endif
