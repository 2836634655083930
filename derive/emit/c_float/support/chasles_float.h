/* Defines the mathematical functions that kinematics in single precision uses. This file is part of
 * chasles and is the same for every robot.
 *
 * To use a CORDIC unit or tables, write a header that defines some of the macros below, and compile
 * with -DCHASLES_FLOAT_HOOKS='"header.h"'. */
#ifndef CHASLES_FLOAT_H
#define CHASLES_FLOAT_H

#ifndef __CUDACC_RTC__ /* NVRTC has no headers; the mathematical functions are built in */
#include <math.h>
#endif

#ifdef CHASLES_FLOAT_HOOKS
#include CHASLES_FLOAT_HOOKS
#endif
#ifndef CHASLES_INLINE
#define CHASLES_INLINE static inline
#endif
#ifndef CHASLES_COS_SIN
#define CHASLES_COS_SIN(x, c, s) chasles_cos_sin(x, c, s)
#endif
#ifndef CHASLES_SQRTF
#define CHASLES_SQRTF(x) sqrtf(x)
#endif
#ifndef CHASLES_ATAN2F
#define CHASLES_ATAN2F(y, x) atan2f(y, x)
#endif

#define CHASLES_MAX_REDUCED 8192.0f /* maximum angle [rad] for the exact reduction of angles */

/* Writes the cosine and the sine of an angle, each with an error of at most 1e-7. A multiple of
 * pi/2, split into three parts, is subtracted from the angle. The polynomials for the cosine and
 * the sine come from the Cephes library. */
CHASLES_INLINE void chasles_cos_sin(float x, float *c, float *s)
{
    if (x > -CHASLES_MAX_REDUCED && x < CHASLES_MAX_REDUCED) {
        const int n = (int)(x * 0.636619772f + (x < 0.0f ? -0.5f : 0.5f));
        const float turns = (float)n;
        const float r =
            ((x - turns * 1.5703125f) - turns * 4.837512969970703e-4f) - turns * 7.5497899488e-8f;
        const float z = r * r;
        const float sine =
            r + r * z * (-1.6666654611e-1f + z * (8.3321608736e-3f - z * 1.9515295891e-4f));
        const float cosine =
            1.0f - 0.5f * z +
            z * z *
                (4.166664568298827e-2f + z * (-1.388731625493765e-3f + z * 2.443315711809948e-5f));
        const float along = n & 1 ? sine : cosine, across = n & 1 ? cosine : sine;
        *c = (n + 1) & 2 ? -along : along;
        *s = n & 2 ? -across : across;
    } else {
        *c = cosf(x);
        *s = sinf(x);
    }
}

/* Returns the smaller number, or the other number if one is NaN. */
CHASLES_INLINE float chasles_least(float a, float b)
{
    return a < b || b != b ? a : b;
}

/* Returns the greater number, or the other number if one is NaN. */
CHASLES_INLINE float chasles_greatest(float a, float b)
{
    return a > b || b != b ? a : b;
}

#endif
