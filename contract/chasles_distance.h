/* The distance of a configuration from a seed, by which the nearest solution is chosen; part of
 * chasles, the same for the C of every robot and for the runtime.
 *
 * The distance is the largest weighted move of a coordinate. Of solutions whose distances are equal
 * but for rounding, the one in the lowest slot is the nearest; of turns of one solution, the turn
 * with the smallest sum of the moves.
 */
#ifndef CHASLES_DISTANCE_H
#define CHASLES_DISTANCE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define CHASLES_FULL_TURN 6.283185307179586
#define CHASLES_ROUNDING 63 /* the bits of a distance that count as rounding */

/* Returns the nearest whole number of a number of turns. Without an instruction for it, rint is a
 * call; a number of less than 2^51 in a sum with 1.5 * 2^52 is rounded in the same way. */
static inline double chasles_whole(double turns)
{
#ifdef __SSE4_1__
    return rint(turns);
#else
    const double large = 6755399441055744.0;
    return fabs(turns) < 2251799813685248.0 ? (turns + large) - large : rint(turns);
#endif
}

/* Returns the move of a coordinate, by the shorter way round where a full turn leaves the pose
 * unchanged: there `turn` is CHASLES_FULL_TURN, else 0. */
static inline double chasles_move(double apart, double turn)
{
    return fabs(apart - turn * chasles_whole(apart * (1 / CHASLES_FULL_TURN)));
}

/* Returns the distance of n coordinates from a seed, NaN if a move is NaN. */
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

/* Returns the sum of the moves of n coordinates from a seed. */
static inline double chasles_sum_of_moves(int n, const double *q_seed, const double *q,
                                          const double *turn, const double *scale)
{
    double sum = 0;
    for (int j = 0; j < n; j++) {
        sum += chasles_move(q[j] - q_seed[j], turn[j]) * scale[j];
    }
    return sum;
}

/* Returns the bits of a distance without its rounding. They are in the order of the distances,
 * which are positive; those of NaN are the last. */
static inline uint64_t chasles_rounded(double distance)
{
    uint64_t bits;
    memcpy(&bits, &distance, sizeof bits);
    return bits & ~(uint64_t)CHASLES_ROUNDING;
}

#endif
