#include "call/kernel/rigid_poses.h"

#include <math.h>

#include "numerics/_rigid.h"

#define BLOCK                                                                                \
    256 /* rows per block: a multiple of every number of lanes, and few enough for the cache \
         */

static void clear_slots(const Kernel *kernel, double *const *outputs, double residual)
{
    const double values[] = {NAN, residual, NAN};
    for (int i = 0; i < kernel->n_outputs; i++) {
        npy_intp size = kernel->operands[kernel->n_inputs + i].size;
        for (npy_intp k = 0; k < size; k++) {
            outputs[i][k] = values[i];
        }
    }
}

/* Returns the residual for a matrix that is not a pose: infinity, or NaN for non-finite entries. */
static double residual_without_pose(const double *T)
{
    double sum = 0;
    for (int i = 0; i < POSE; i++) {
        sum += T[i] * 0;
    }
    return sum == 0 ? INFINITY : NAN;
}

/* Recomputes all residuals that are above rounding level. */
static void measure_slots(const Kernel *kernel, const double *T, double *const *outputs)
{
    npy_intp k = slots_of(kernel);
    double *residual = outputs[SLOTS_RESIDUAL], unit = kernel->unit;
    for (npy_intp slot = 0; slot < k; slot++) {
        const double *q = outputs[SLOTS_Q] + slot * kernel->fk->sizes[0];
        double reached[POSE], distance2 = 0, turned2 = 0;
        double *to = reached;
        if (!(residual[slot] > RIGID_TO_ROUNDING * smaller(unit, 1) && isfinite(residual[slot]))) {
            continue;
        }
        kernel->fk->call(&q, &to);
        for (int i = 0; i < 12; i++) {
            double apart = reached[i] - T[i];
            distance2 += i % 4 == 3 ? apart * apart : 0;
            turned2 += i % 4 == 3 ? 0 : apart * apart;
        }
        residual[slot] = sqrt(larger(distance2, turned2 / 2 * unit * unit));
    }
}

/* Solves for the nearest rigid pose. Clears the results if the matrix is not nearly rigid. */
static void solve_other(const Kernel *kernel, Rigidity found, const double *const *inputs,
                        double *const *outputs)
{
    double T[POSE];
    const double *projected[MAX_OPERANDS] = {T};
    if (found == NOT_RIGID) {
        clear_slots(kernel, outputs, residual_without_pose(inputs[0]));
        return;
    }
    nearest_rigid(inputs[0], T);
    for (int i = 1; i < kernel->n_inputs; i++) {
        projected[i] = inputs[i];
    }
    kernel->call(projected, outputs);
    if (kernel->fk) {
        measure_slots(kernel, T, outputs);
    }
}

void settle_pose(const Kernel *kernel, const double *const *inputs, double *const *outputs)
{
    Rigidity found = rigidity(inputs[0]);
    if (found != RIGID) {
        solve_other(kernel, found, inputs, outputs);
    }
}

void solve_judged(const Kernel *kernel, const double *const *inputs, double *const *outputs)
{
    Rigidity found = rigidity(inputs[0]);
    if (found != RIGID) {
        solve_other(kernel, found, inputs, outputs);
        return;
    }
    kernel->call(inputs, outputs);
    if (kernel->fk) {
        measure_slots(kernel, inputs[0], outputs);
    }
}

/* Tests whether all n rows are rigid up to rounding error. */
static int rows_are_rigid(npy_intp n, const double *T, ptrdiff_t step, const double *residual,
                          ptrdiff_t residual_step, npy_intp k)
{
    for (; n-- > 0; T += step, residual += residual_step) {
        if (!is_settled(T, residual, k) && rigidity(T) != RIGID) {
            return 0;
        }
    }
    return 1;
}

static void solve_projected(const Kernel *kernel, npy_intp n, const double *const *inputs,
                            const ptrdiff_t *input_steps, double *const *outputs,
                            const ptrdiff_t *output_steps)
{
    double poses[BLOCK * POSE];
    const double *projected[MAX_OPERANDS] = {poses};
    ptrdiff_t steps[MAX_OPERANDS] = {POSE};
    Rigidity found[BLOCK];
    for (npy_intp row = 0; row < n; row++) {
        const double *T = inputs[0] + row * input_steps[0];
        found[row] = rigidity(T);
        if (found[row] == NEAR_RIGID) {
            nearest_rigid(T, poses + row * POSE);
        } else {
            memcpy(poses + row * POSE, T, POSE * sizeof(double));
        }
    }
    for (int i = 1; i < kernel->n_inputs; i++) {
        projected[i] = inputs[i];
        steps[i] = input_steps[i];
    }
    kernel->rows((size_t)n, projected, steps, outputs, output_steps);
    for (npy_intp row = 0; row < n; row++) {
        double *const own[] = {outputs[0] + row * output_steps[0],
                               outputs[1] + row * output_steps[1],
                               outputs[2] + row * output_steps[2]};
        if (found[row] == NOT_RIGID) {
            clear_slots(kernel, own, residual_without_pose(poses + row * POSE));
        } else if (kernel->fk) {
            measure_slots(kernel, poses + row * POSE, own);
        }
    }
}

/* Computes an inverse kinematics function for n rows with the code for batches. Nearly rigid poses
 * are replaced by rigid transformations. */
static void solve_rows(const Kernel *kernel, npy_intp n, const double *const *inputs,
                       const ptrdiff_t *input_steps, double *const *outputs,
                       const ptrdiff_t *output_steps)
{
    const double *from[MAX_OPERANDS];
    double *to[SLOTS_MARGIN + 1];
    npy_intp k = slots_of(kernel);
    if (kernel->poses == POSES_BY_RESIDUAL) {
        /* One call solves all poses, because large results can then bypass the processor caches. */
        kernel->rows((size_t)n, inputs, input_steps, outputs, output_steps);
    }
    for (npy_intp first = 0; first < n; first += BLOCK) {
        npy_intp rows = n - first < BLOCK ? n - first : BLOCK;
        for (int i = 0; i < kernel->n_inputs; i++) {
            from[i] = inputs[i] + first * input_steps[i];
        }
        for (int i = 0; i < kernel->n_outputs; i++) {
            to[i] = outputs[i] + first * output_steps[i];
        }
        int projected = kernel->poses == POSES_JUDGED ||
                        !rows_are_rigid(rows, from[0], input_steps[0], to[SLOTS_RESIDUAL],
                                        output_steps[SLOTS_RESIDUAL], k);
        if (projected) {
            solve_projected(kernel, rows, from, input_steps, to, output_steps);
        }
        for (npy_intp row = 0; kernel->fk && !projected && row < rows; row++) {
            double *const own[] = {to[0] + row * output_steps[0], to[1] + row * output_steps[1],
                                   to[2] + row * output_steps[2]};
            measure_slots(kernel, from[0] + row * input_steps[0], own);
        }
    }
}

void run_kernel_rows(const Kernel *kernel, npy_intp n, const double *const *inputs,
                     const ptrdiff_t *input_steps, double *const *outputs,
                     const ptrdiff_t *output_steps)
{
    if (kernel->rows && n > 1 && kernel->poses) {
        solve_rows(kernel, n, inputs, input_steps, outputs, output_steps);
        return;
    }
    if (kernel->rows && n > 1) {
        kernel->rows((size_t)n, inputs, input_steps, outputs, output_steps);
        return;
    }
    for (npy_intp row = 0; row < n; row++) {
        const double *from[MAX_OPERANDS];
        double *to[MAX_OPERANDS];
        for (int i = 0; i < kernel->n_inputs; i++) {
            from[i] = inputs[i] + row * input_steps[i];
        }
        for (int i = 0; i < kernel->n_outputs; i++) {
            to[i] = outputs[i] + row * output_steps[i];
        }
        run_kernel(kernel, from, to);
    }
}
