/* SIMD vectors with one sample or solution in each lane. This file is part of chasles and is the
 * same for every robot.
 */
#ifndef CHASLES_VECTORS_H
#define CHASLES_VECTORS_H

#include <math.h>
#include <stdint.h>

#if defined(__GNUC__) && !defined(CHASLES_PLAIN)
#if defined(__AVX512F__)
#define CHASLES_VECTOR_LANES 8
#elif defined(__AVX__)
#define CHASLES_VECTOR_LANES 4
#else
#define CHASLES_VECTOR_LANES 2
#endif

/* Vector types of GCC and Clang are used, because the compiler would spill sums of plain arrays to
 * memory. */
typedef double chasles_vector __attribute__((vector_size(8 * CHASLES_VECTOR_LANES)));
typedef int64_t chasles_vector_mask __attribute__((vector_size(8 * CHASLES_VECTOR_LANES)));
#define CHASLES_LANE(x, l) ((x)[l])
#define CHASLES_ZERO {0.0}

#define CHASLES_INLINE static inline __attribute__((always_inline))
/* Loops are unrolled, because a matrix of SIMD vectors stays in registers only if its indices are
 * compile-time constants. */
#define CHASLES_UNROLL _Pragma("GCC unroll 16")

/* Selects one of two values bit by bit with a mask. The value that is not selected may be NaN. */
CHASLES_INLINE chasles_vector chasles_vector_chosen(chasles_vector_mask where, chasles_vector x,
                                                    chasles_vector y)
{
    return (chasles_vector)((where & (chasles_vector_mask)x) | (~where & (chasles_vector_mask)y));
}

CHASLES_INLINE chasles_vector chasles_vector_sizes(chasles_vector x)
{
    return (chasles_vector)((chasles_vector_mask)x & INT64_MAX);
}

/* Returns the magnitude of x with the sign of y. */
CHASLES_INLINE chasles_vector chasles_vector_signed(chasles_vector x, chasles_vector y)
{
    return (chasles_vector)(((chasles_vector_mask)x & INT64_MAX) |
                            ((chasles_vector_mask)y & INT64_MIN));
}
#else
/* In plain C, a vector contains one double. */
#define CHASLES_VECTOR_LANES 1
typedef double chasles_vector;
typedef int chasles_vector_mask;
#define CHASLES_LANE(x, l) ((&(x))[l])
#define CHASLES_ZERO 0.0
#define CHASLES_INLINE static inline
#define CHASLES_UNROLL

CHASLES_INLINE chasles_vector chasles_vector_chosen(chasles_vector_mask where, chasles_vector x,
                                                    chasles_vector y)
{
    return where ? x : y;
}

CHASLES_INLINE chasles_vector chasles_vector_sizes(chasles_vector x)
{
    return fabs(x);
}

CHASLES_INLINE chasles_vector chasles_vector_signed(chasles_vector x, chasles_vector y)
{
    return copysign(x, y);
}
#endif

CHASLES_INLINE chasles_vector chasles_vector_square_roots(chasles_vector x)
{
    for (int l = 0; l < CHASLES_VECTOR_LANES; l++)
        CHASLES_LANE(x, l) = sqrt(CHASLES_LANE(x, l));
    return x;
}

#endif
