/* Kinematics on a graphics processor (GPU): columns of arrays, and the solution nearest to a seed.
 * This file is part of chasles and is the same for every robot. nvcc and NVRTC compile it.
 */
#ifndef CHASLES_CUDA_CUH
#define CHASLES_CUDA_CUH

#define CHASLES_INLINE __device__ __forceinline__
#include "chasles_float.h"

#ifdef __CUDACC_RTC__
#define INFINITY __int_as_float(0x7f800000)
#define NAN __int_as_float(0x7fffffff)
#endif

#define CHASLES_FULL_TURN 6.283185307179586
#ifndef CHASLES_THREADS
#define CHASLES_THREADS 128 /* maximum number of threads in a block */
#endif

/* Writes the cosine and the sine of an angle. */
CHASLES_INLINE void chasles_cos_sin(double x, double *c, double *s)
{
    sincos(x, s, c);
}

namespace chasles
{

/* The entries of one pose in an array. The same entries of consecutive poses are adjacent, so that
 * the threads of a warp access adjacent numbers. A plain array is a column with step 1. */
template <typename T> struct column {
    T *first;
    size_t step;

    CHASLES_INLINE column(T *first, size_t step = 1) : first(first), step(step)
    {
    }
    CHASLES_INLINE T &operator[](int entry) const
    {
        return first[entry * step];
    }
};

/* Constants of a kind of number. */
template <typename Real> struct precision;

template <> struct precision<float> {
    typedef unsigned int integer;
    static constexpr float solved = CHASLES_SOLVED_SINGLE; /* largest residual [m, rad] */
    static constexpr float at_limit = 1e-5f; /* limit violation that is treated as rounding */
};

template <> struct precision<double> {
    typedef unsigned long long integer;
    static constexpr double solved = 1e-9;
    static constexpr double at_limit = 1e-12;
};

/* Limits, weights and periods of n coordinates. A period is a full turn, or 0 if a full turn
 * changes the pose. */
template <typename Real, int n> struct moves {
    Real lower[n], upper[n], scale[n], turn[n];

    /* Replaces the limits of the robot and the weights 1, unless an argument is NULL. */
    CHASLES_INLINE void replace(const Real *own_lower, const Real *own_upper, const Real *weights)
    {
#pragma unroll
        for (int j = 0; j < n; j++) {
            lower[j] = own_lower ? own_lower[j] : lower[j];
            upper[j] = own_upper ? own_upper[j] : upper[j];
            scale[j] = weights ? weights[j] * scale[j] : scale[j];
        }
    }
};

/* The k solution slots of an inverse, and the seed. Loops over slots are unrolled, because an array
 * stays in registers only if its indices are constants. */
template <typename Real, int n, int k> struct slots {
    typedef typename precision<Real>::integer integer;
    static constexpr integer rounding = 63; /* low bits of a distance that rounding may change */
    static constexpr Real turns = (Real)(1 / CHASLES_FULL_TURN);

    Real q[n * k], residual[k], margin[k], seed[n];

    /* Returns the bits of a distance without the low bits that rounding may change. As integers,
     * they have the order of the distances; NaN is last. */
    static CHASLES_INLINE integer rounded(Real distance)
    {
        integer bits;
        memcpy(&bits, &distance, sizeof bits);
        return bits & ~rounding;
    }

    /* Returns the distance of a slot from the seed without limits. */
    CHASLES_INLINE Real distance(int slot, const moves<Real, n> &by) const
    {
        Real largest = 0;
#pragma unroll
        for (int j = 0; j < n; j++) {
            const Real apart = q[slot * n + j] - seed[j];
            const Real move = fabs(apart - by.turn[j] * rint(apart * turns)) * by.scale[j];
            largest = move <= largest ? largest : move;
        }
        return residual[slot] <= precision<Real>::solved ? largest : (Real)INFINITY;
    }

    /* Returns the slot with the smallest distance, the lowest slot if distances differ only by
     * rounding, or -1 if all distances are infinite. */
    static CHASLES_INLINE int least(const Real *distance)
    {
        integer smallest = ~(integer)0;
#pragma unroll
        for (int slot = 0; slot < k; slot++) {
            const integer key = rounded(distance[slot]) | (integer)slot;
            smallest = key < smallest ? key : smallest;
        }
        return smallest < rounded((Real)INFINITY) ? (int)(smallest & rounding) : -1;
    }

    /* Writes the m numbers that belong to a slot. */
    template <int m> static CHASLES_INLINE void copy(int best, const Real *from, Real *at)
    {
#pragma unroll
        for (int entry = 0; entry < m * k; entry++) {
            at[entry % m] = entry / m == best || entry < m ? from[entry] : at[entry % m];
        }
    }

    /* Shifts coordinates by full turns to the values nearest to the seed. Returns whether they are
     * within the limits. */
    CHASLES_INLINE bool is_inside(const moves<Real, n> &by, Real *at) const
    {
        bool inside = true;
#pragma unroll
        for (int j = 0; j < n; j++) {
            at[j] -= by.turn[j] * rint((at[j] - seed[j]) * turns);
            inside &= (at[j] >= by.lower[j]) & (at[j] <= by.upper[j]);
        }
        return inside;
    }

    /* Shifts coordinates by full turns to the values nearest to the seed within the limits. Returns
     * their distance, or INFINITY if a coordinate has no value within its limits. A coordinate that
     * violates a limit only by rounding is set to the limit. */
    CHASLES_INLINE Real limited(const moves<Real, n> &by, Real *at) const
    {
        Real largest = 0;
        bool inside = true;
#pragma unroll
        for (int j = 0; j < n; j++) {
            const Real low = by.lower[j] - precision<Real>::at_limit;
            const Real high = by.upper[j] + precision<Real>::at_limit, turn = by.turn[j];
            const Real own = at[j];
            Real x = own;
            if (turn > 0) {
                x = own - turn * rint((own - seed[j]) * turns);
                x = x < low ? own + turn * ceil((low - own) * turns) : x;
                x = x > high ? own + turn * floor((high - own) * turns) : x;
            }
            inside &= x >= low && x <= high;
            x = x < by.lower[j] ? by.lower[j] : x;
            at[j] = x > by.upper[j] ? by.upper[j] : x;
            const Real move = fabs(at[j] - seed[j]) * by.scale[j];
            largest = move > largest ? move : largest;
        }
        return inside ? largest : (Real)INFINITY;
    }

    /* Returns the reason for a missing solution: -1 out of reach, -2 outside the limits, -3 NaN.
     * Writes NaN, and the smallest residual with its margin. */
    CHASLES_INLINE int none(Real *at, Real *own_residual, Real *own_margin) const
    {
        Real sum = 0;
#pragma unroll
        for (int j = 0; j < n; j++) {
            sum += seed[j] * 0;
            at[j] = NAN;
        }
        *own_residual = *own_margin = NAN;
#pragma unroll
        for (int slot = 0; slot < k; slot++) {
            const Real own = residual[slot];
            if (sum == 0 && own == own && !(own >= *own_residual)) {
                *own_residual = own;
                *own_margin = margin[slot];
            }
        }
        if (*own_residual != *own_residual) {
            return -3;
        }
        return *own_residual <= precision<Real>::solved ? -2 : -1;
    }

    /* Writes the solution nearest to the seed within the limits, its residual and its margin.
     * Returns its slot, or the reason for the missing solution. The distance is the largest
     * weighted displacement of a coordinate. */
    CHASLES_INLINE int nearest(const moves<Real, n> &by, Real *at, Real *own_residual,
                               Real *own_margin) const
    {
        Real distances[k];
#pragma unroll
        for (int slot = 0; slot < k; slot++) {
            distances[slot] = distance(slot, by);
        }
        int best = least(distances);
        copy<n>(best, q, at);
        bool found = best >= 0 && is_inside(by, at);
        while (!found) { /* no later solution can be nearer once `found` is true */
            best = least(distances);
            if (best < 0) {
                return none(at, own_residual, own_margin);
            }
            copy<n>(best, q, at);
            const Real own = limited(by, at);
            found = true;
#pragma unroll
            for (int slot = 0; slot < k; slot++) {
                found &= slot != best || own <= distances[slot];
                distances[slot] = slot == best ? own : distances[slot];
            }
        }
        copy<1>(best, residual, own_residual);
        copy<1>(best, margin, own_margin);
        return best;
    }
};

} // namespace chasles

#endif
