/* Finds the nearest solutions for batches of poses in compiled code. */
#pragma once

#include <float.h>

#include "call/function/function.h"
#include "call/kernel/rigid_poses.h"

#define SCRATCH 8192 /* number of doubles on the stack for a block of rows */
#define MAX_BLOCK 32 /* maximum number of rows, so that the L1 cache holds them */
#define N_MOVES 4    /* lower limits, upper limits, scales, periods */

/* Pointers to the first rows of a call, with strides counted in doubles. */
typedef struct {
    const double *inputs[MAX_OPERANDS];
    ptrdiff_t steps[MAX_OPERANDS];
    const double *q_seed;
    ptrdiff_t seed_step;
    const double *moves[N_MOVES];
    double *results[3]; /* dense arrays: q, residual, margin */
    npy_int8 *slot;     /* slot of the solution, or a negative reason for a missing solution */
} Rows;

static inline npy_intp coordinates_of(const Kernel *kernel)
{
    return kernel->operands[kernel->n_inputs].dims[1];
}

/* Tests whether Python must handle a row: the row needs refinement, or its target is not a pose. */
static inline int is_unsettled(const Function *inverse, int slot, double residual)
{
    return slot < 0 && ((inverse->refinement && residual <= inverse->near) || residual > DBL_MAX);
}

/* Tests whether C can select the nearest solution: the scratch memory must hold all slots. */
int can_select(const Function *inverse);

/* Reads the arrays (n,) of lower limits, upper limits, scales and periods. In the limit arrays,
 * limits of coupled joints may follow. Returns -1 on error. */
int read_moves(PyObject *moves, npy_intp n, const double **to);

/* Finds the nearest solutions of n rows, block by block. */
void run_nearest(const Function *inverse, npy_intp n, const Rows *rows);

/* Python function nearest_rows(inverse, inputs, q_seed, moves, results). */
PyObject *nearest_rows(PyObject *module, PyObject *args);

/* Python function nearest_of_slots(inverse, slots, q_seed, moves, results). */
PyObject *nearest_of_slots(PyObject *module, PyObject *args);
