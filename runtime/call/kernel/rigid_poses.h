/* Inverses of rounded poses (single precision or printed digits).
 *
 * A pose counts as rigid if at least one of its solutions has a residual as small as a rounding
 * error. Otherwise, the deviation of the pose from a rigid transformation is computed. A pose whose
 * rotation matrix is nearly orthogonal is projected and solved again. For a matrix that is not
 * nearly rigid, the coordinates and margins are NaN. The residuals are infinite, or NaN if a
 * matrix entry is not finite.
 *
 * If the unit length is not 1 m, each residual is recomputed. The new residual is the larger of the
 * position error and the unit length times 2 sin(angle / 2), where angle is the rotation error. */
#pragma once

#include <string.h>

#include "call/kernel/operands.h"
#include "numerics/_tolerances.h"

/* The outputs of an inverse kinematics function. */
enum { SLOTS_Q, SLOTS_RESIDUAL, SLOTS_MARGIN };

/* Tests whether four numbers differ from 0 0 0 1. Comparing bits is faster than comparing doubles.
 */
static inline int differs_from_last_row(const double *row)
{
    const double one = 1;
    uint64_t bits[4], bits_of_one;
    memcpy(bits, row, sizeof bits);
    memcpy(&bits_of_one, &one, sizeof one);
    return (((bits[0] | bits[1] | bits[2]) << 1) | (bits[3] ^ bits_of_one)) != 0;
}

/* Tests whether the last row of a pose is 0 0 0 1, and whether some solution has a residual of at
 * most RIGID_TO_ROUNDING. */
static inline int is_settled(const double *T, const double *residual, npy_intp k)
{
    if (differs_from_last_row(T + 12)) {
        return 0;
    }
    for (npy_intp slot = 0; slot < k; slot++) {
        if (residual[slot] <= RIGID_TO_ROUNDING) {
            return 1;
        }
    }
    return 0;
}

/* Tests a pose without a solution. If its rotation is orthogonal up to rounding, the pose is
 * projected to SE(3) and solved again. */
void settle_pose(const Kernel *kernel, const double *const *inputs, double *const *outputs);

/* Solves one pose. A nearly rigid pose is projected to SE(3) first. A pose that is not nearly rigid
 * gets no solution. If `kernel->fk` is set, the residuals are recomputed. */
void solve_judged(const Kernel *kernel, const double *const *inputs, double *const *outputs);

static inline npy_intp slots_of(const Kernel *kernel)
{
    return kernel->operands[kernel->n_inputs + SLOTS_RESIDUAL].size;
}

static inline void run_kernel(const Kernel *kernel, const double *const *inputs,
                              double *const *outputs)
{
    if (kernel->poses == POSES_JUDGED || kernel->fk) {
        solve_judged(kernel, inputs, outputs);
        return;
    }
    kernel->call(inputs, outputs);
    if (kernel->poses && !is_settled(inputs[0], outputs[SLOTS_RESIDUAL], slots_of(kernel))) {
        settle_pose(kernel, inputs, outputs);
    }
}

/* Runs the kernel on n rows. `input_steps` and `output_steps` are the distances between successive
 * rows. If the kernel has separate code for many poses, that code runs. */
void run_kernel_rows(const Kernel *kernel, npy_intp n, const double *const *inputs,
                     const ptrdiff_t *input_steps, double *const *outputs,
                     const ptrdiff_t *output_steps);
