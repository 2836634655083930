/* Iterative inverse kinematics of pose batches on several threads. */
#pragma once

#include <stdatomic.h>
#include <stddef.h>

#include "iterative/native/arm.h"
#include "iterative/native/solve_pose.h"

#define MAX_THREADS 256
#define POSES_AT_A_TIME 16 /* number of poses per work item of a thread */

/* A result depends on its pose and seed only, not on the thread or the batch. */
typedef struct {
    const Arm *arm;
    const Task *task;
    const double *poses, *seeds; /* poses (count, 4, 4); seeds (count, n) or NULL */
    Results results;             /* addresses of the first entries of the result arrays */
    size_t count;
    atomic_size_t next; /* the first pose that is not yet assigned to a thread */
    atomic_int out_of_memory;
    int (*is_stopped)(
        void); /* the calling thread calls this function; a nonzero result stops all threads */
} PoseBatch;

/* Solves all poses on at most `threads` threads, including the calling thread. Sets out_of_memory
 * if an allocation fails. */
void solve_batch(PoseBatch *batch, int threads);
