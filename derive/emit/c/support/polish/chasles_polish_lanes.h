/* Defines the types with which chasles_polish.h computes one branch or several branches at once. If
 * POLISH_ON_LANES is 1, the number types are the SIMD vectors of chasles_lanes.h. If
 * POLISH_ON_LANES is 0, the number types are scalars. This file is part of chasles and is the same
 * for every robot. The file is included once for each robot. */
#undef POLISH_INLINE
#undef POLISH_UNROLL
#undef POLISH_OF
#undef POLISH_NOT
#undef POLISH_AND
#undef POLISH_OR
#undef POLISH_RSQRT
#undef POLISH_MAX
#undef POLISH_MIN
#if POLISH_ON_LANES
#define POLISH_INLINE LANES_INLINE
#define POLISH_UNROLL _Pragma("GCC unroll 16")
#define POLISH_OF(x) LANES_OF(x)
#define POLISH_NOT(x) LANES_NOT(x)
#define POLISH_AND(x, y) LANES_AND(x, y)
#define POLISH_OR(x, y) LANES_OR(x, y)
#define POLISH_MAX(x, y) LANES_MAX(x, y)
#define POLISH_MIN(x, y) LANES_MIN(x, y)
#define POLISH_RSQRT(value, x) LANES_LET1(value, rsqrt, x)
#else
/* Removes the macros of the previous robot if one file includes several robots. */
#undef LANES
#undef LANES_TARGET
#undef LANES_LT
#undef LANES_CHOICE
#undef LANES_ANY
#undef lanes
#undef lanes_where
#define LANES 1
#define LANES_TARGET
#define LANES_LT(x, y) ((x) < (y))
#define LANES_CHOICE(condition, x, y) ((condition) ? (x) : (y))
#define LANES_ANY(condition) (condition)
#define lanes double
#define lanes_where int
#define POLISH_INLINE static inline
#define POLISH_UNROLL
#define POLISH_OF(x) (x)
#define POLISH_NOT(x) (!(x))
#define POLISH_AND(x, y) ((x) && (y))
#define POLISH_OR(x, y) ((x) || (y))
#define POLISH_MAX(x, y) ((x) > (y) ? (x) : (y))
#define POLISH_MIN(x, y) ((x) < (y) ? (x) : (y))
#define POLISH_RSQRT(value, x) const double value = 1.0 / sqrt(x)
#endif
