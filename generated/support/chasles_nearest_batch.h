/* Selects the solutions nearest to seed configurations for a batch of poses while the solutions are
 * still in SIMD lanes. This file is part of chasles and is the same for every robot.
 *
 * chasles_nearest_batch.h is included after chasles_batch.h, once for each instruction set. */
#ifndef CHASLES_NEAREST_BATCH_H
#define CHASLES_NEAREST_BATCH_H

#include "chasles_nearest.h"

/* The seeds of a batch, the distance metric, and the largest residual of a valid solution. `step`
 * is the number of doubles from one seed to the next. */
typedef struct {
    const double *q;
    ptrdiff_t step;
    const chasles_moves *moves;
    double tolerance;
} chasles_seeds;
#endif

/* Selects in each SIMD lane the solution that is nearest to the seed, without regard to the limits.
 * `found` receives the coordinates of the selected solution (shifted by full turns towards the
 * seed), its residual and its margin. `least` receives the distance between the selected solution
 * and the seed. The lowest bits of the distance in `least` are replaced by the index of the
 * solution slot. `is_inside` becomes 1 in lanes whose solution is within the limits, otherwise 0.
 *
 * `slots` contains SIMD vectors: n coordinates for each of the k solution slots, then k residuals
 * and k margins. */
LANES_INLINE void LANES_NAME(chasles_select_lanes)(int n, int k, const lanes *slots,
                                                   const lanes *q_seed, const chasles_seeds *by,
                                                   lanes *least, lanes *is_inside, lanes *found)
{
    const chasles_moves *moves = by->moves;
    *least = LANES_OF(INFINITY);
    for (int j = 0; j < n + 2; j++) {
        found[j] = LANES_NAME(lanes_zero);
    }
    for (int slot = 0; slot < k; slot++) {
        const lanes *q = slots + slot * n, residual = slots[k * n + slot];
        lanes largest = LANES_NAME(lanes_zero), key;
        for (int j = 0; j < n; j++) {
            const lanes apart = q[j] - q_seed[j];
            lanes move = apart - moves->turn[j] * CHASLES_TURNS(apart);
            LANES_NAME(lanes_fabs)(&move, &move);
            largest = LANES_MAX(move * moves->scale[j], largest);
        }
        /* A solution with a NaN residual is not selected, because comparisons with NaN are false.
         */
        key = (lanes)(((lanes_mask)largest & ~(int64_t)CHASLES_ROUNDING) | slot);
        const lanes_where is_nearer =
            LANES_AND(LANES_LT(key, *least), LANES_LE(residual, by->tolerance));
        *least = LANES_CHOICE(is_nearer, key, *least);
        for (int j = 0; j < n; j++) {
            found[j] = LANES_CHOICE(is_nearer, q[j], found[j]);
        }
        found[n] = LANES_CHOICE(is_nearer, residual, found[n]);
        found[n + 1] = LANES_CHOICE(is_nearer, slots[k * n + k + slot], found[n + 1]);
    }
    lanes_where holds = LANES_LT(*least, INFINITY);
    for (int j = 0; j < n; j++) {
        found[j] -= moves->turn[j] * CHASLES_TURNS(found[j] - q_seed[j]);
        holds = LANES_AND(holds, LANES_AND(LANES_LE(moves->lower[j], found[j]),
                                           LANES_LE(found[j], moves->upper[j])));
    }
    *is_inside = LANES_NUMBER(holds);
}

/* Calls chasles_nearest, which respects the limits, for the solutions of one SIMD lane. */
static LANES_TARGET __attribute__((noinline, unused)) int LANES_NAME(chasles_nearest_lane)(
    int n, int k, const double *slots, const double *q_seed, const chasles_seeds *by, double *q,
    double *residual, double *margin)
{
    double rows[LANES_MAX_OUTPUTS];
    const chasles_slots of = {n, k, rows, rows + k * n, rows + k * n + k, by->tolerance};
    for (int i = 0; i < k * (n + 2); i++) {
        rows[i] = slots[i * LANES];
    }
    return chasles_nearest(&of, by->moves, q_seed, q, residual, margin);
}

/* Writes the nearest solution of each pose to q, residual and margin, without gaps between the
 * rows. Also writes to `slot` the index of the nearest solution, or the reason why there is no
 * solution. The function `kernel` is an inverse kinematics function with k solution slots of n
 * coordinates. */
static LANES_TARGET __attribute__((unused)) void LANES_NAME(lanes_nearest)(
    LANES_NAME(lanes_kernel) kernel, const lanes_shape *shape, size_t count,
    const double *const *inputs, const ptrdiff_t *input_steps, int n, int k,
    const chasles_seeds *by, double *const *outputs, signed char *slot)
{
    lanes work[LANES_MAX_INPUTS + LANES_MAX_OUTPUTS] __attribute__((aligned(4096)));
    lanes seed[CHASLES_MAX_JOINTS], found[CHASLES_MAX_JOINTS + 2], least, is_inside;
    lanes *out = work;
    for (int i = 0; i < shape->inputs; i++) {
        out += shape->sizes[i];
    }
    for (size_t row = 0; row < count; row += LANES) {
        const int here = count - row < LANES ? (int)(count - row) : LANES;
        const double *q_seed = by->q + (ptrdiff_t)row * by->step;
        double *const q = outputs[0] + row * (size_t)n;
        lanes *at = work;
        for (int i = 0; i < shape->inputs; i++) {
            const double *rows = inputs[i] + (ptrdiff_t)row * input_steps[i];
            LANES_NAME(lanes_gather)(rows, input_steps[i], shape->sizes[i], here, at);
            at += shape->sizes[i];
        }
        LANES_NAME(lanes_gather)(q_seed, by->step, n, here, seed);
        kernel(work, out);
        LANES_NAME(chasles_select_lanes)(n, k, out, seed, by, &least, &is_inside, found);
        LANES_NAME(lanes_scatter)(found, n, here, q, n);
        LANES_NAME(lanes_scatter)(found + n, 1, here, outputs[1] + row, 1);
        LANES_NAME(lanes_scatter)(found + n + 1, 1, here, outputs[2] + row, 1);
        for (int lane = 0; lane < here; lane++) {
            slot[row + lane] = (signed char)(((lanes_mask)least)[lane] & CHASLES_ROUNDING);
            if (is_inside[lane] == 0) {
                slot[row + lane] = (signed char)LANES_NAME(chasles_nearest_lane)(
                    n, k, (const double *)out + lane, q_seed + lane * by->step, by, q + lane * n,
                    outputs[1] + row + lane, outputs[2] + row + lane);
            }
        }
    }
}
