/* Selects the inverse kinematics solution nearest to a seed configuration, within joint limits.
 * This file is part of chasles and is the same for every robot.
 *
 * Each periodic joint is shifted by full turns to the value within its limits that is nearest to
 * the seed. */
#ifndef CHASLES_NEAREST_H
#define CHASLES_NEAREST_H

#include <stddef.h>

#include "chasles_distance.h"

#ifdef __TINYC__
/* The compiler tcc accepts neither its own INFINITY nor a negated infinity in constant expressions.
 */
#undef INFINITY
#define INFINITY 1e308 * 1e308
#endif

#define CHASLES_SOLVED 1e-9    /* largest residual of a valid solution [m, rad] */
#define CHASLES_AT_LIMIT 1e-12 /* limit violations up to this value count as rounding errors */
#define CHASLES_MAX_SLOTS 64   /* maximum number of solution slots per pose */
#define CHASLES_MAX_JOINTS 64  /* maximum number of coordinates of a robot */

/* If a function finds no solution, it returns one of the following negative numbers instead of the
 * index of a solution slot. The number states the reason. */
#define CHASLES_OUT_OF_REACH (-1)   /* no solution reaches the pose */
#define CHASLES_OUTSIDE_LIMITS (-2) /* all solutions of the pose are outside the limits */
#define CHASLES_NOT_FINITE (-3)     /* the seed or every residual is NaN, or the seed is infinite */

/* Converts each displacement in a vector to a number of full turns, rounded to an integer. Adding
 * and subtracting 1.5 * 2^52 rounds a number to an integer. */
#define CHASLES_TURNS(apart) \
    (((apart) * (1 / CHASLES_FULL_TURN) + 6755399441055744.0) - 6755399441055744.0)

/* Limits, weights and periods of the coordinates of a robot. */
typedef struct {
    const double *lower, *upper; /* limits of a coordinate, infinite if there is no limit */
    const double *scale;         /* weight of a coordinate's displacement in the distance */
    const double *turn; /* CHASLES_FULL_TURN if a full turn leaves the pose unchanged, otherwise 0
                         */
} chasles_moves;

/* The solution slots of an inverse kinematics function, with one solution per row. */
typedef struct {
    int n, slots;
    const double *q, *residual, *margin;
    double tolerance; /* largest residual of a valid solution */
} chasles_slots;

/* Writes the coordinates of a solution, each shifted by full turns to the value within its limits
 * that is nearest to the seed. Returns the distance of the shifted solution from the seed, or
 * INFINITY if a coordinate has no value within its limits. A coordinate that violates a limit only
 * by rounding is set to the limit. */
static inline double chasles_limited(int n, const chasles_moves *moves, const double *slot,
                                     const double *q_seed, double *q)
{
    double distance = 0;
    for (int j = 0; j < n; j++) {
        const double low = moves->lower[j] - CHASLES_AT_LIMIT;
        const double high = moves->upper[j] + CHASLES_AT_LIMIT, turn = moves->turn[j];
        double at = slot[j], move;
        if (turn > 0) {
            at = slot[j] - turn * rint((slot[j] - q_seed[j]) * (1 / CHASLES_FULL_TURN));
            at = at < low ? slot[j] + turn * ceil((low - slot[j]) * (1 / CHASLES_FULL_TURN)) : at;
            at =
                at > high ? slot[j] + turn * floor((high - slot[j]) * (1 / CHASLES_FULL_TURN)) : at;
        }
        if (!(at >= low && at <= high)) {
            return INFINITY;
        }
        at = at < moves->lower[j] ? moves->lower[j] : at;
        q[j] = at > moves->upper[j] ? moves->upper[j] : at;
        move = fabs(q[j] - q_seed[j]) * moves->scale[j];
        distance = move > distance ? move : distance;
    }
    return distance;
}

/* Writes the coordinates of a solution, each shifted by full turns to the value nearest to the
 * seed. Returns whether the shifted coordinates are within the limits. */
static inline int chasles_is_inside(int n, const chasles_moves *moves, const double *slot,
                                    const double *q_seed, double *q)
{
    int inside = 1;
    for (int j = 0; j < n; j++) {
        const double turns = (slot[j] - q_seed[j]) * (1 / CHASLES_FULL_TURN);
        q[j] = slot[j] - moves->turn[j] * rint(turns);
        inside &= (q[j] >= moves->lower[j]) & (q[j] <= moves->upper[j]);
    }
    return inside;
}

/* Writes the distance of each solution from the seed. */
static inline void chasles_distances(const chasles_slots *of, const chasles_moves *moves,
                                     const double *q_seed, double *distance)
{
    const double *q = of->q;
    for (int slot = 0; slot < of->slots; slot++, q += of->n) {
        const double own = chasles_distance(of->n, q_seed, q, moves->turn, moves->scale);
        distance[slot] = of->residual[slot] <= of->tolerance ? own : INFINITY;
    }
}

/* Returns the solution slot with the smallest distance, or -1 if all distances are infinite. */
static inline int chasles_least(int slots, const double *distance)
{
    uint64_t least = UINT64_MAX;
    for (int slot = 0; slot < slots; slot++) {
        const uint64_t key = chasles_rounded(distance[slot]) | (uint64_t)slot;
        least = key < least ? key : least;
    }
    return least < chasles_rounded(INFINITY) ? (int)(least & CHASLES_ROUNDING) : -1;
}

/* Sets the coordinates q to NaN, because there is no solution. Writes the smallest residual of all
 * solution slots, and the margin of the slot with this residual. Returns the reason why there is no
 * solution, as a negative number. */
static inline int chasles_none(const chasles_slots *of, const double *q_seed, double *q,
                               double *residual, double *margin)
{
    double sum = 0;
    int finite = 1, best = -1;
    for (int j = 0; j < of->n; j++) {
        sum += q_seed[j] * 0;
    }
    finite = sum == 0;
    for (int j = 0; j < of->n; j++) {
        q[j] = NAN;
    }
    for (int slot = 0; slot < of->slots; slot++) {
        const double own = of->residual[slot];
        best = own == own && (best < 0 || own < of->residual[best]) ? slot : best;
    }
    if (!finite || best < 0) {
        *residual = *margin = NAN;
        return CHASLES_NOT_FINITE;
    }
    *residual = of->residual[best];
    *margin = of->margin[best];
    return *residual <= of->tolerance ? CHASLES_OUTSIDE_LIMITS : CHASLES_OUT_OF_REACH;
}

/* Returns the same result as chasles_nearest. The input `distance` contains the distances that
 * chasles_distances computes without regard to the limits. Solutions are tested in the order of
 * their distances, until no later solution can be nearer to the seed. The function overwrites
 * entries of the array `distance`. */
static inline int chasles_nearest_limited(const chasles_slots *of, const chasles_moves *moves,
                                          const double *q_seed, double *distance, double *q,
                                          double *residual, double *margin)
{
    double at[CHASLES_MAX_JOINTS];
    for (;;) {
        const int best = chasles_least(of->slots, distance);
        double limited;
        if (best < 0) {
            return chasles_none(of, q_seed, q, residual, margin);
        }
        limited = chasles_limited(of->n, moves, of->q + best * of->n, q_seed, at);
        if (limited <= distance[best]) {
            memcpy(q, at, (size_t)of->n * sizeof *q);
            *residual = of->residual[best];
            *margin = of->margin[best];
            return best;
        }
        distance[best] = limited;
    }
}

/* Writes the solution nearest to the seed, its residual and margin. Returns the index of the
 * solution slot that contains the nearest solution. Of several solutions at the same distance, the
 * function selects the one with the lowest index. If there is no solution, the function sets q to
 * NaN, writes the smallest residual and its margin, and returns the reason as a negative number.
 * The arrays q and q_seed may be the same. */
static inline int chasles_nearest(const chasles_slots *of, const chasles_moves *moves,
                                  const double *q_seed, double *q, double *residual, double *margin)
{
    double distance[CHASLES_MAX_SLOTS], at[CHASLES_MAX_JOINTS];
    int best;
    chasles_distances(of, moves, q_seed, distance);
    best = chasles_least(of->slots, distance);
    if (best >= 0 && chasles_is_inside(of->n, moves, of->q + best * of->n, q_seed, at)) {
        memcpy(q, at, (size_t)of->n * sizeof *q);
        *residual = of->residual[best];
        *margin = of->margin[best];
        return best;
    }
    return chasles_nearest_limited(of, moves, q_seed, distance, q, residual, margin);
}

/* Applies chasles_nearest to a batch of `rows` poses, each with k solution slots of n coordinates.
 * `moves` contains pointers to the limits and weights, in the order of the fields of chasles_moves.
 * The rows of the outputs q, residual and margin are contiguous in memory. */
static inline void chasles_nearest_slots(size_t rows, int n, int k, const double *const *slots,
                                         double tolerance, const double *const *moves,
                                         const double *q_seed, ptrdiff_t seed_step,
                                         double *const *outputs, signed char *slot)
{
    const chasles_moves by = {moves[0], moves[1], moves[2], moves[3]};
    for (size_t row = 0; row < rows; row++, q_seed += seed_step) {
        const size_t first = row * (size_t)k;
        const chasles_slots of = {
            n, k, slots[0] + first * (size_t)n, slots[1] + first, slots[2] + first, tolerance};
        slot[row] = (signed char)chasles_nearest(&of, &by, q_seed, outputs[0] + row * (size_t)n,
                                                 outputs[1] + row, outputs[2] + row);
    }
}

#endif
