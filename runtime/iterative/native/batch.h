/* Inverse kinematics of many poses on several threads. */
#ifndef CHASLES_BATCH_H
#define CHASLES_BATCH_H

#include <stdatomic.h>
#include <stddef.h>

#include "iterative/native/arm.h"
#include "iterative/native/solve_pose.h"

#define MOST_THREADS 256
#define POSES_AT_A_TIME 16 /* that a thread takes from the batch */

/* The result for a pose depends on that pose and its seed alone, not on the thread or the batch. */
typedef struct {
    const Arm *arm;
    const Task *task;
    const double *poses, *seeds; /* (count, 4, 4); (count, n) or NULL */
    Results results;             /* those of the first pose; arrays over the batch */
    size_t count;
    atomic_size_t next; /* the first pose that no thread has taken yet */
    atomic_int out_of_memory;
    int (*is_stopped)(void); /* asked by the calling thread: nonzero ends the work of all */
} PoseBatch;

/* Solves all poses on at most so many threads, this one included; on fewer where the system does
 * not start them. Sets out_of_memory where a thread found no memory to work in. */
void solve_batch(PoseBatch *batch, int threads);

#endif
