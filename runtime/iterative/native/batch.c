#include "iterative/native/batch.h"

#include <stdlib.h>

#include "call/kernel/posix.h"
#include "iterative/native/evaluate.h"

/* Divides a non-null `memory` among the workspace arrays. Returns their total size in doubles. */
static size_t lay_out(const Arm *arm, Workspace *work, double *memory)
{
    size_t n = arm->n, used = 0;
    const struct {
        double **part;
        size_t size;
    } parts[] = {
        {&work->q, n},
        {&work->trial, n},
        {&work->halley, n},
        {&work->best, (FINALISTS + 1) * n},
        {&work->J, TWIST * n},
        {&work->trial_J, TWIST * n},
        {&work->halley_J, TWIST * n},
        {&work->normal, n * n},
        {&work->A, n * n},
        {&work->gradient, n},
        {&work->step, n},
        {&work->scratch, scratch_size(arm)},
        {&work->distances, arm->n_starts},
    };
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        if (memory) {
            *parts[i].part = memory + used;
        }
        used += parts[i].size;
    }
    return used;
}

/* Solves poses of the batch until it is complete or stopped. */
static void solve_pieces(PoseBatch *batch, int (*is_stopped)(void))
{
    const Arm *arm = batch->arm;
    const Results *all = &batch->results;
    Workspace work = {.free = malloc(arm->n * sizeof(int))};
    double *memory = malloc(lay_out(arm, &work, NULL) * sizeof(double));
    if (!memory || !work.free) {
        atomic_store(&batch->out_of_memory, 1);
    } else {
        lay_out(arm, &work, memory);
        size_t count = batch->count, first;
        while ((first = atomic_fetch_add(&batch->next, POSES_AT_A_TIME)) < count) {
            for (size_t k = first; k < count && k < first + POSES_AT_A_TIME; k++) {
                const Results own = {all->q + k * arm->n, all->residual + k,   all->success + k,
                                     all->ending + k,     all->iterations + k, all->restarts + k};
                const double *seed = batch->seeds ? batch->seeds + k * arm->n : NULL;
                Problem problem = {.arm = arm,
                                   .task = batch->task,
                                   .target = batch->poses + k * POSE,
                                   .work = &work};
                solve_pose(&problem, seed, &own);
            }
            if (is_stopped && is_stopped()) {
                atomic_store(&batch->next, count);
            }
        }
    }
    free(memory);
    free(work.free);
}

static void *help(void *batch)
{
    solve_pieces(batch, NULL);
    return NULL;
}

void solve_batch(PoseBatch *batch, int threads)
{
    pthread_t others[MAX_THREADS];
    int started = 0;
    while (started < threads - 1 && pthread_create(&others[started], NULL, help, batch) == 0) {
        started++;
    }
    solve_pieces(batch, batch->is_stopped);
    for (int k = 0; k < started; k++) {
        pthread_join(others[k], NULL);
    }
}
