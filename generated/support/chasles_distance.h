/* Distance of a configuration from a seed, for choosing the nearest solution. This header of
 * chasles is the same for the generated C of every robot and for the runtime.
 *
 * The distance is the largest weighted displacement of a coordinate. If distances differ only by
 * rounding errors, the solution with the lowest index is selected. Copies of one solution that
 * differ by full turns can have equal distances. Then the copy with the smallest sum of
 * displacements is selected. */
#ifndef CHASLES_DISTANCE_H
#define CHASLES_DISTANCE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define CHASLES_FULL_TURN 6.283185307179586
#define CHASLES_ROUNDING 63 /* number of low bits of a distance that rounding errors may change */

/* Rounds a number of full turns to an integer. Without a rounding instruction, rint is a slow
 * function call. Adding and subtracting 1.5 * 2^52 rounds values below 2^51 to the integer that
 * rint returns. */
static inline double chasles_whole(double turns)
{
#ifdef __SSE4_1__
    return rint(turns);
#else
    const double large = 6755399441055744.0;
    return fabs(turns) < 2251799813685248.0 ? (turns + large) - large : rint(turns);
#endif
}

/* Returns the size of a coordinate displacement. For a coordinate with period 2 pi, `turn` is
 * CHASLES_FULL_TURN, and the result is the length of the shorter way around the circle. For any
 * other coordinate, `turn` is 0. */
static inline double chasles_move(double apart, double turn)
{
    return fabs(apart - turn * chasles_whole(apart * (1 / CHASLES_FULL_TURN)));
}

/* Returns the distance between a configuration of n coordinates and a seed, or NaN if a
 * displacement is NaN. */
static inline double chasles_distance(int n, const double *q_seed, const double *q,
                                      const double *turn, const double *scale)
{
    double largest = 0;
    for (int j = 0; j < n; j++) {
        const double move = chasles_move(q[j] - q_seed[j], turn[j]) * scale[j];
        largest = move <= largest ? largest : move;
    }
    return largest;
}

/* Returns the sum of the displacements of n coordinates from a seed. */
static inline double chasles_sum_of_moves(int n, const double *q_seed, const double *q,
                                          const double *turn, const double *scale)
{
    double sum = 0;
    for (int j = 0; j < n; j++) {
        sum += chasles_move(q[j] - q_seed[j], turn[j]) * scale[j];
    }
    return sum;
}

/* Returns the bit pattern of a distance as an integer. The low bits, which rounding may change, are
 * zero. Sorting these integers sorts the distances, because distances are not negative. NaN is
 * last. */
static inline uint64_t chasles_rounded(double distance)
{
    uint64_t bits;
    memcpy(&bits, &distance, sizeof bits);
    return bits & ~(uint64_t)CHASLES_ROUNDING;
}

#endif
