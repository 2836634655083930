/* Defines C arithmetic on SIMD vectors of LANES values, one value per pose or solution branch. This
 * file is part of chasles and is the same for every robot.
 *
 * chasles_lanes.h is included for each instruction set, with CHASLES_ISA 0 (baseline), 1 (AVX2) or
 * 2 (AVX-512). The header defines the vector type `lanes`, functions of this type, and conversions
 * between rows of doubles and SIMD lanes. Each lane has the same result as scalar C, including NaN
 * and infinities, except for the last digits of transcendental functions. The error of an arc
 * tangent is at most 2 units in the last place. With FMA, the error of a cosine or sine is at most
 * 1.5 units in the last place. Functions of libmvec, the vector library of glibc, have an error of
 * at most 4 units in the last place. */
#ifndef CHASLES_LANES_H
#define CHASLES_LANES_H

#include <float.h>
#include <immintrin.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Minimax polynomials P and Q for |y| <= pi/4, highest powers first. With z = y^2, sin y = y +
 * y z P(z) to 2^-57, and cos y = 1 - z/2 + z^2 Q(z) to 2^-63. */
static const double lanes_sine[] = {1.589623007685026e-10,  -2.505074776274793e-08,
                                    2.7557313621395764e-06, -0.00019841269829589612,
                                    0.008333333333322118,   -0.1666666666666663};
static const double lanes_cosine[] = {-1.1358536307896614e-11, 2.0875700837723448e-09,
                                      -2.755731417926397e-07,  2.4801587288851585e-05,
                                      -0.0013888888888873056,  0.041666666666666595};
/* pi/2 as a sum of three doubles, rounded down. */
static const double lanes_right_angle[] = {1.5707963267948966, 6.123233995736765e-17,
                                           1.0828566739219139e-32};
#define LANES_FARTHEST 1e5 /* maximum angle [rad]; libmvec computes functions of larger angles */
/* Coefficients of the minimax polynomial P for the arc tangent of |t| <= 1/2, lowest power first.
 * With z = t^2, atan t = t + t z P(z) to 2^-57. */
static const double lanes_arctangent[] = {
    -0.3333333333333298,   0.19999999999903106, -0.14285714276386502, 0.11111110659684081,
    -0.09090896246194469,  0.07692073937540857, -0.0666381088370742,  0.05858300759286596,
    -0.051220140523104356, 0.04186527516045578, -0.02743532082961043, 0.010117105953140847};

#define LANES_TINY 5e-324 /* the smallest positive double */
#define LANES_INLINE static inline __attribute__((always_inline)) LANES_TARGET
/* LANES_SCHEDULED lets the compiler interleave two independent vectors. LANES_SPARING makes the
 * compiler spill fewer registers to memory. */
#ifdef __clang__
#define LANES_SCHEDULED
#define LANES_SPARING
#else
#define LANES_SCHEDULED __attribute__((optimize("schedule-insns")))
#define LANES_SPARING \
    __attribute__((optimize("schedule-insns", "sched-pressure", "live-range-shrinkage")))
#endif

#define LANES_JOIN_(a, b) a##_##b
#define LANES_JOIN(a, b) LANES_JOIN_(a, b)
#define LANES_NAME(name) LANES_JOIN(name, LANES_SET)

/* Subtracting the zero vector converts a number to a vector, and preserves -0. */
#define LANES_OF(number) ((number) - LANES_NAME(lanes_zero))
/* Conditions have the vector type `lanes_where`. LANES_CHOICE selects bits by a condition, so a NaN
 * in the value that is not selected has no effect. */
#define LANES_NOT(x) ((lanes_where) ~(x))
#define LANES_AND(x, y) ((lanes_where)((x) & (y)))
#define LANES_OR(x, y) ((lanes_where)((x) | (y)))
/* 1 or 0. */
#define LANES_NUMBER(condition) LANES_CHOICE(condition, 1.0, 0.0)
#define LANES_COUNT(branches) ((branches) < LANES ? (branches) : LANES) /* in one vector */

/* Declares a variable and computes its value by a function of one or two SIMD vectors. */
#define LANES_LET1(value, name, x) \
    lanes value;                   \
    LANES_NAME(lanes_##name)(&x, &value)
#define LANES_LET2(value, name, x, y) \
    lanes value;                      \
    LANES_NAME(lanes_##name)(&x, &y, &value)
#define LANES_COS_SIN(c, s, x) \
    lanes c, s;                \
    LANES_NAME(lanes_cos_sin)(&x, &c, &s)

/* Functions take SIMD vectors by address, because the baseline ABI cannot pass wide vectors by
 * value. */
#define LANES_PART(x, k) (((lanes_part *)(x))[k])
#define LANES_PARTS (int)(sizeof(lanes) / sizeof(lanes_part))
#define LANES_BY_PARTS(name, function)                                       \
    LANES_INLINE void LANES_NAME(lanes_##name)(const lanes *x, lanes *value) \
    {                                                                        \
        for (int k = 0; k < LANES_PARTS; k++) {                              \
            LANES_PART(value, k) = function(LANES_PART(x, k));               \
        }                                                                    \
    }
#define LANES_LIBMVEC(name)                                 \
    LANES_TARGET lanes_part LANES_VECTOR(name)(lanes_part); \
    LANES_BY_PARTS(name, LANES_VECTOR(name))
/* Defines a function that calls libm in each SIMD lane, because libmvec lacks the function. */
#define LANES_LIBM(name)                                                                   \
    static inline LANES_TARGET void LANES_NAME(lanes_##name)(const lanes *x, lanes *value) \
    {                                                                                      \
        for (int k = 0; k < LANES; k++) {                                                  \
            (*value)[k] = name((*x)[k]);                                                   \
        }                                                                                  \
    }
#endif

#undef LANES
#undef LANES_SET
#undef LANES_TARGET
#undef LANES_VECTOR
#undef LANES_SQRT
#undef LANES_ALL
#undef LANES_COMPARED
#undef LANES_MAX
#undef LANES_MIN
#undef LANES_FMA
#undef LANES_LESS_PRODUCT
#undef LANES_LT
#undef LANES_LE
#undef LANES_EQ
#undef LANES_NE
#undef LANES_NEGATIVE
#undef LANES_MINUS
#undef LANES_CHOICE
#undef LANES_ANY
#undef lanes
#undef lanes_mask
#undef lanes_part
#undef lanes_where
/* LANES_TARGET contains tune=haswell, because tuning for Skylake or Zen makes the code a third
 * slower.
 *
 * LANES_MAX and LANES_MIN return the second argument if an argument is NaN. LANES_MINUS returns the
 * sign bit in each lane in which the condition is true, and 0 in the other lanes. */
#if CHASLES_ISA == 2
#define LANES 8
#define LANES_SET avx512
#define LANES_TARGET __attribute__((target("avx512f,avx512dq,avx512vl,avx2,fma,tune=haswell")))
#define LANES_VECTOR(name) _ZGVeN8v_##name
/* The mask is explicit, because g++ 12 warns about intrinsics without a mask. */
#define LANES_ALL (__mmask8) - 1
#define LANES_SQRT(x) _mm512_maskz_sqrt_pd(LANES_ALL, x)
#define LANES_MAX(x, y) ((lanes)_mm512_maskz_max_pd(LANES_ALL, LANES_OF(x), LANES_OF(y)))
#define LANES_MIN(x, y) ((lanes)_mm512_maskz_min_pd(LANES_ALL, LANES_OF(x), LANES_OF(y)))
#define LANES_FMA(x, y, z) ((lanes)_mm512_fmadd_pd(x, y, z))
#define LANES_LESS_PRODUCT(z, x, y) ((lanes)_mm512_fnmadd_pd(x, y, z))
#define LANES_COMPARED(x, y, how) _mm512_cmp_pd_mask(LANES_OF(x), LANES_OF(y), how)
#define LANES_LT(x, y) LANES_COMPARED(x, y, _CMP_LT_OQ)
#define LANES_LE(x, y) LANES_COMPARED(x, y, _CMP_LE_OQ)
#define LANES_EQ(x, y) LANES_COMPARED(x, y, _CMP_EQ_OQ)
#define LANES_NE(x, y) LANES_COMPARED(x, y, _CMP_NEQ_UQ)
#define LANES_NEGATIVE(x) _mm512_movepi64_mask((__m512i)(x))
#define LANES_CHOICE(condition, x, y) \
    ((lanes)_mm512_mask_blend_pd(condition, LANES_OF(y), LANES_OF(x)))
#define LANES_MINUS(condition) \
    ((lanes_mask)_mm512_maskz_mov_epi64(condition, _mm512_set1_epi64(INT64_MIN)))
#define LANES_ANY(condition) (condition)
#define lanes_part __m512d
#define lanes_where __mmask8
#else
#define LANES 4
#define LANES_LT(x, y) ((lanes_mask)(LANES_OF(x) < LANES_OF(y)))
#define LANES_LE(x, y) ((lanes_mask)(LANES_OF(x) <= LANES_OF(y)))
#define LANES_EQ(x, y) ((lanes_mask)(LANES_OF(x) == LANES_OF(y)))
#define LANES_NE(x, y) ((lanes_mask)(LANES_OF(x) != LANES_OF(y)))
#define LANES_MINUS(condition) ((condition) & INT64_MIN)
#define lanes_where lanes_mask
#if CHASLES_ISA == 1
#define LANES_SET avx2
#define LANES_TARGET __attribute__((target("avx2,fma,tune=haswell")))
#define LANES_VECTOR(name) _ZGVdN4v_##name
#define LANES_SQRT _mm256_sqrt_pd
#define LANES_MAX(x, y) ((lanes)_mm256_max_pd(LANES_OF(x), LANES_OF(y)))
#define LANES_MIN(x, y) ((lanes)_mm256_min_pd(LANES_OF(x), LANES_OF(y)))
#define LANES_FMA(x, y, z) ((lanes)_mm256_fmadd_pd(x, y, z))
#define LANES_LESS_PRODUCT(z, x, y) ((lanes)_mm256_fnmadd_pd(x, y, z))
#define LANES_NEGATIVE(x) \
    ((lanes_mask)(x)) /* the blend instruction uses only the sign bit of a condition */
#define LANES_CHOICE(condition, x, y) \
    ((lanes)_mm256_blendv_pd(LANES_OF(y), LANES_OF(x), (__m256d)(condition)))
#define LANES_ANY(condition) _mm256_movemask_pd((__m256d)(condition))
#define lanes_part __m256d
#else
#define LANES_SET baseline
#define LANES_TARGET
#define LANES_VECTOR(name) _ZGVbN2v_##name
#define LANES_SQRT _mm_sqrt_pd
#define LANES_MAX(x, y) LANES_CHOICE(LANES_LT(y, x), x, y)
#define LANES_MIN(x, y) LANES_CHOICE(LANES_LT(x, y), x, y)
#define LANES_FMA(x, y, z) ((x) * (y) + (z))
#define LANES_NEGATIVE(x) ((lanes_mask)((lanes_mask)(x) < 0))
#define LANES_CHOICE(condition, x, y) \
    ((lanes)(((condition) & (lanes_mask)LANES_OF(x)) | (~(condition) & (lanes_mask)LANES_OF(y))))
#define lanes_part __m128d
#endif
#endif
#define lanes LANES_NAME(lanes_type)
#define lanes_mask LANES_NAME(lanes_mask_type)

#if (CHASLES_ISA == 2 && !LANES_HAS_AVX512) || (CHASLES_ISA == 1 && !LANES_HAS_AVX2) || \
    (CHASLES_ISA == 0 && !LANES_HAS_BASELINE)
#if CHASLES_ISA == 2
#define LANES_HAS_AVX512 1
#elif CHASLES_ISA == 1
#define LANES_HAS_AVX2 1
#else
#define LANES_HAS_BASELINE 1
#endif

typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));
typedef int64_t lanes_mask __attribute__((vector_size(LANES * sizeof(double))));
typedef double LANES_NAME(lanes_row)
    __attribute__((vector_size(LANES * sizeof(double)), aligned(sizeof(double))));
static const lanes LANES_NAME(lanes_zero) = {0};

/* ---- functions that operate on SIMD lanes ---- */

LANES_LIBMVEC(sin)
LANES_LIBMVEC(cos)
#if __GLIBC_PREREQ(2, 35)
LANES_LIBMVEC(tan)
#else
LANES_LIBM(tan)
#endif
LANES_BY_PARTS(sqrt, LANES_SQRT)

/* Computes 1 / sqrt(x) with an error of at most 2 units in the last place, if x and 1 / x are
 * normal numbers. The reciprocal square root is NaN if x is negative or NaN. AVX-512 estimates the
 * result with an error e of at most 2^-13. The series of (1 - e)^(-1/2) refines the estimate with a
 * truncation error of 35/128 e^4. Instruction sets other than AVX-512 compute the square root and
 * the quotient separately. */
LANES_INLINE void LANES_NAME(lanes_rsqrt)(const lanes *x, lanes *value)
{
#if CHASLES_ISA == 2
    const lanes estimate = (lanes)_mm512_maskz_rsqrt14_pd(LANES_ALL, *x);
    const lanes e = LANES_LESS_PRODUCT(LANES_OF(1.0), *x * estimate, estimate);
    const lanes series =
        LANES_FMA(LANES_FMA(LANES_OF(0.3125), e, LANES_OF(0.375)), e, LANES_OF(0.5));
    *value = LANES_FMA(series, estimate * e, estimate);
#else
    const lanes inverse = 1.0 / *x;
    LANES_NAME(lanes_sqrt)(x, value);
    *value *= inverse;
#endif
}

LANES_INLINE void LANES_NAME(lanes_fabs)(const lanes *x, lanes *value)
{
    *value = (lanes)((lanes_mask)*x & INT64_MAX);
}

#if CHASLES_ISA > 0
/* Computes cosine and sine by libmvec in SIMD lanes whose angle is large or not finite. */
static __attribute__((noinline, cold)) LANES_TARGET void LANES_NAME(lanes_cos_sin_far)(
    const lanes *x, const lanes_where *far, lanes *c, lanes *s)
{
    lanes far_c, far_s;
    LANES_NAME(lanes_cos)(x, &far_c);
    LANES_NAME(lanes_sin)(x, &far_s);
    *c = LANES_CHOICE(*far, far_c, *c);
    *s = LANES_CHOICE(*far, far_s, *s);
}

/* Computes cosine and sine by Cody-Waite reduction to |y| <= pi/4 and two polynomials. */
static inline LANES_TARGET void LANES_NAME(lanes_cos_sin)(const lanes *x, lanes *c, lanes *s)
{
    const double units = 6755399441055744.0; /* adding 1.5 * 2^52 rounds a number to an integer */
    const lanes shifted = LANES_FMA(*x, LANES_OF(0.63661977236758134), LANES_OF(units));
    const lanes n = shifted - units;
    lanes y = *x;
    for (int k = 0; k < 3; k++) {
        y = LANES_LESS_PRODUCT(y, n, LANES_OF(lanes_right_angle[k]));
    }
    const lanes z = y * y;
    lanes sine = LANES_OF(lanes_sine[0]), cosine = LANES_OF(lanes_cosine[0]);
    for (int k = 1; k < 6; k++) {
        sine = LANES_FMA(sine, z, LANES_OF(lanes_sine[k]));
        cosine = LANES_FMA(cosine, z, LANES_OF(lanes_cosine[k]));
    }
    sine = LANES_FMA(y * z, sine, y);
    cosine = LANES_FMA(z, LANES_FMA(z, cosine, LANES_OF(-0.5)), LANES_OF(1.0));
    /* Restores the sign of sin(-0) = -0, which the polynomial sum has lost. */
    const lanes_mask sine_bits = (lanes_mask)sine | ((lanes_mask)y & INT64_MIN);
    const lanes_mask quarter = (lanes_mask)shifted, odd = -(quarter & 1);
    const lanes_mask swapped = (sine_bits ^ (lanes_mask)cosine) & odd;
    *s = (lanes)(sine_bits ^ swapped ^ ((quarter << 62) & INT64_MIN));
    *c = (lanes)((lanes_mask)cosine ^ swapped ^ (((quarter + 1) << 62) & INT64_MIN));
    lanes size;
    LANES_NAME(lanes_fabs)(x, &size);
    const lanes_where far = LANES_NOT(LANES_LE(size, LANES_FARTHEST));
    if (LANES_ANY(far)) {
        LANES_NAME(lanes_cos_sin_far)(x, &far, c, s);
    }
}
#else
static inline LANES_TARGET void LANES_NAME(lanes_cos_sin)(const lanes *x, lanes *c, lanes *s)
{
    LANES_NAME(lanes_cos)(x, c);
    LANES_NAME(lanes_sin)(x, s);
}
#endif

/* Computes the angle atan2(y, x). Let a be the smaller and b the larger of |x| and |y|. The angle
 * follows from the arc tangent of (a - b) / (a + b) near a diagonal, otherwise from the arc tangent
 * of a / b. In the quotient, only a + b and the division cause rounding errors. The angle is wrong
 * if |x| and |y| differ and their sum overflows. */
LANES_INLINE void LANES_NAME(lanes_atan2)(const lanes *y, const lanes *x, lanes *value)
{
    const double *const p = lanes_arctangent;
    const double eighth = 0.78539816339744828, rest = 3.061616997868383e-17; /* sum is pi/4 */
    lanes width, height;
    LANES_NAME(lanes_fabs)(x, &width);
    LANES_NAME(lanes_fabs)(y, &height);
    const lanes_where steep = LANES_LT(width, height);
    const lanes large = LANES_CHOICE(steep, height, width);
    const lanes small = LANES_CHOICE(steep, width, height);
    /* `diagonal` is true if x and y are infinite (quotient 0), and false if x and y are 0. */
    const lanes_where diagonal = LANES_LT(LANES_MIN(0.5 * large, DBL_MAX), small);
    const lanes above = LANES_CHOICE(diagonal, LANES_MAX(small - large, -DBL_MAX), small);
    const lanes below = LANES_MAX(LANES_TINY, LANES_CHOICE(diagonal, large + small, large));
    const lanes t = above / below, z = t * t, zz = z * z;
    lanes even = LANES_FMA(zz, LANES_OF(p[10]), LANES_OF(p[8]));
    lanes odd = LANES_FMA(zz, LANES_OF(p[11]), LANES_OF(p[9]));
    even = LANES_FMA(zz, even, LANES_OF(p[6]));
    odd = LANES_FMA(zz, odd, LANES_OF(p[7]));
    even = LANES_FMA(zz, even, LANES_OF(p[4]));
    odd = LANES_FMA(zz, odd, LANES_OF(p[5]));
    even = LANES_FMA(zz, even, LANES_OF(p[2]));
    odd = LANES_FMA(zz, odd, LANES_OF(p[3]));
    even = LANES_FMA(zz, even, LANES_OF(p[0]));
    odd = LANES_FMA(zz, odd, LANES_OF(p[1]));
    /* The arc tangent of t is the angle from an axis or diagonal whose direction is `count` times
     * 45 degrees. */
    const lanes_mask backwards = LANES_MINUS(steep) ^ ((lanes_mask)*x & INT64_MIN);
    const lanes signed_t = (lanes)((lanes_mask)t ^ backwards);
    const lanes axis = LANES_CHOICE(steep, 2.0, LANES_CHOICE(LANES_NEGATIVE(*x), 4.0, 0.0));
    const lanes count = axis + (lanes)((lanes_mask)LANES_NUMBER(diagonal) ^ backwards);
    const lanes curved = LANES_FMA(signed_t * z, LANES_FMA(z, odd, even), count * rest);
    const lanes angle = LANES_FMA(count, LANES_OF(eighth), signed_t + curved);
    *value = (lanes)((lanes_mask)angle | ((lanes_mask)*y & INT64_MIN));
}

/* Computes the angles atan2(y, x) of two points at once. The coordinates of each point must be
 * equal in lanes 2 k and 2 k + 1. */
LANES_INLINE void LANES_NAME(lanes_two_atan2)(const lanes *y1, const lanes *x1, const lanes *y2,
                                              const lanes *x2, lanes *value1, lanes *value2)
{
#if LANES == 8
    const lanes y = __builtin_shufflevector(*y1, *y2, 0, 9, 2, 11, 4, 13, 6, 15);
    const lanes x = __builtin_shufflevector(*x1, *x2, 0, 9, 2, 11, 4, 13, 6, 15);
    lanes both;
    LANES_NAME(lanes_atan2)(&y, &x, &both);
    *value1 = __builtin_shufflevector(both, both, 0, 0, 2, 2, 4, 4, 6, 6);
    *value2 = __builtin_shufflevector(both, both, 1, 1, 3, 3, 5, 5, 7, 7);
#else
    const lanes y = __builtin_shufflevector(*y1, *y2, 0, 5, 2, 7);
    const lanes x = __builtin_shufflevector(*x1, *x2, 0, 5, 2, 7);
    lanes both;
    LANES_NAME(lanes_atan2)(&y, &x, &both);
    *value1 = __builtin_shufflevector(both, both, 0, 0, 2, 2);
    *value2 = __builtin_shufflevector(both, both, 1, 1, 3, 3);
#endif
}

LANES_INLINE void LANES_NAME(lanes_supplement)(const lanes *a, const lanes *y, lanes *value)
{
    lanes size;
    LANES_NAME(lanes_fabs)(a, &size);
    *value = (lanes)((lanes_mask)(3.14159265358979323846 - size) | ((lanes_mask)*y & INT64_MIN));
}

LANES_INLINE void LANES_NAME(lanes_atan)(const lanes *x, lanes *value)
{
    const lanes one = LANES_OF(1.0);
    LANES_NAME(lanes_atan2)(x, &one, value);
}

LANES_INLINE void LANES_NAME(lanes_sign)(const lanes *x, lanes *value)
{
    const lanes_where less = LANES_LT(*x, 0.0), more = LANES_LT(0.0, *x);
    *value = LANES_CHOICE(less, -1.0, LANES_CHOICE(more, 1.0, *x));
}

/* If one argument is NaN, the functions return the other argument, like fmin and fmax in C. */
LANES_INLINE void LANES_NAME(lanes_fmin)(const lanes *x, const lanes *y, lanes *value)
{
    *value = LANES_CHOICE(LANES_NE(*y, *y), *x, LANES_MIN(*x, *y));
}

LANES_INLINE void LANES_NAME(lanes_fmax)(const lanes *x, const lanes *y, lanes *value)
{
    *value = LANES_CHOICE(LANES_NE(*y, *y), *x, LANES_MAX(*x, *y));
}

/* ---- rows to lanes and back ---- */

/* Transposes LANES vectors of a matrix into LANES rows. */
LANES_INLINE void LANES_NAME(lanes_transpose)(const lanes *a, lanes *rows)
{
#if LANES == 8
    lanes b[8], c[8];
    for (int i = 0; i < 8; i += 2) {
        b[i] = __builtin_shufflevector(a[i], a[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        b[i + 1] = __builtin_shufflevector(a[i], a[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (int i = 0; i < 8; i += 4) {
        for (int j = i; j < i + 2; j++) {
            c[j] = __builtin_shufflevector(b[j], b[j + 2], 0, 1, 8, 9, 4, 5, 12, 13);
            c[j + 2] = __builtin_shufflevector(b[j], b[j + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
    }
    for (int j = 0; j < 4; j++) {
        rows[j] = __builtin_shufflevector(c[j], c[j + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        rows[j + 4] = __builtin_shufflevector(c[j], c[j + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
#else
    lanes b[4];
    for (int i = 0; i < 4; i += 2) {
        b[i] = __builtin_shufflevector(a[i], a[i + 1], 0, 4, 2, 6);
        b[i + 1] = __builtin_shufflevector(a[i], a[i + 1], 1, 5, 3, 7);
    }
    for (int j = 0; j < 2; j++) {
        rows[j] = __builtin_shufflevector(b[j], b[j + 2], 0, 1, 4, 5);
        rows[j + 2] = __builtin_shufflevector(b[j], b[j + 2], 2, 3, 6, 7);
    }
#endif
}

/* Loads the first `width` doubles of a row, and sets the remaining lanes to 0. */
static inline LANES_TARGET void LANES_NAME(lanes_load)(const double *row, int width, lanes *to)
{
#if CHASLES_ISA == 2
    *to = (lanes)_mm512_maskz_loadu_pd((__mmask8)((1 << width) - 1), row);
#else
    lanes found = {0};
    for (int k = 0; k < width; k++) {
        found[k] = row[k];
    }
    *to = found;
#endif
}

/* Transposes rows to lanes in registers, because a wide load would wait for narrow stores. */
static inline LANES_TARGET void LANES_NAME(lanes_gather)(const double *rows, ptrdiff_t step,
                                                         int size, int count, lanes *to)
{
    for (int k = 0; k < size; k += LANES) {
        int width = size - k < LANES ? size - k : LANES;
        lanes block[LANES], turned[LANES];
        for (int lane = 0; lane < LANES; lane++) {
            /* An unused lane repeats the last row, so that the lane contains valid values. */
            const double *row = rows + (lane < count ? lane : count - 1) * step;
            LANES_NAME(lanes_load)(row + k, width, &block[lane]);
        }
        LANES_NAME(lanes_transpose)(block, turned);
        for (int i = 0; i < width; i++) {
            to[k + i] = turned[i];
        }
    }
}

LANES_INLINE void LANES_NAME(lanes_scatter)(const lanes *from, int size, int count, double *rows,
                                            ptrdiff_t step)
{
    int k = 0;
    for (; k < size && size >= LANES; k += LANES) {
        lanes block[LANES];
        k = k + LANES > size ? size - LANES : k;
        LANES_NAME(lanes_transpose)(from + k, block);
        if (count == LANES) {
            for (int lane = 0; lane < LANES; lane++) {
                *(LANES_NAME(lanes_row) *)(rows + lane * step + k) = block[lane];
            }
        } else {
            for (int lane = 0; lane < count; lane++) {
                *(LANES_NAME(lanes_row) *)(rows + lane * step + k) = block[lane];
            }
        }
    }
    if (size == 1 && step == 1 && count == LANES) {
        *(LANES_NAME(lanes_row) *)rows = *from;
        return;
    }
#if CHASLES_ISA == 2
    if (2 < size && size < LANES) {
        lanes block[LANES] = {LANES_NAME(lanes_zero)}, turned[LANES];
        for (; k < size; k++) {
            block[k] = from[k];
        }
        LANES_NAME(lanes_transpose)(block, turned);
        for (int lane = 0; lane < count; lane++) {
            _mm512_mask_storeu_pd(rows + lane * step, (__mmask8)((1 << size) - 1), turned[lane]);
        }
        return;
    }
#endif
    for (; k < size; k++) {
        const double *at = (const double *)(from + k);
        for (int lane = 0; lane < count; lane++) {
            rows[lane * step + k] = at[lane];
        }
    }
}
#endif
