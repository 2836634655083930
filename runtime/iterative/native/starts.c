#include "iterative/native/starts.h"

#include <math.h>
#include <string.h>

#include "iterative/native/evaluate.h"

/* Writes the weighted squared distances of the table poses from the target. The squared distance of
 * two rotations is half the squared Frobenius norm of their difference. For a small angle between
 * the rotations, the squared distance is approximately angle^2. */
static void measure_starts(const Problem *problem, double *distances)
{
    const Arm *arm = problem->arm;
    int count = arm->n_starts;
    double linear = 0, angular = 0;
    for (int i = 0; i < 3; i++) {
        linear = larger(linear, problem->task->weights[i]);
        angular = larger(angular, problem->task->weights[i + 3]);
    }
    memset(distances, 0, count * sizeof(double));
    for (int i = 0; i < 12; i++) {
        const double *entry = arm->start_poses + (size_t)i * count, wanted = problem->target[i];
        double weight = i % 4 == 3 ? linear * linear : angular * angular / 2;
        for (int s = 0; s < count; s++) {
            double difference = entry[s] - wanted;
            distances[s] += weight * difference * difference;
        }
    }
}

/* Copies a start configuration (n,) from the table, with the seed values of locked coordinates. */
static void copy_start(const Problem *problem, const double *seed, int start, double *to)
{
    const Arm *arm = problem->arm;
    const Task *task = problem->task;
    memcpy(to, arm->starts + (size_t)start * arm->n, arm->n * sizeof(double));
    for (int k = 0; k < arm->n && task->n_locked; k++) {
        to[k] = task->locked[k] ? seed[k] : to[k];
    }
}

/* Writes half the squared pose error of each start configuration, with the locked coordinates at
 * their seed values. The tabulated poses cannot be used, because they belong to other values of the
 * locked coordinates. */
static void measure_locked_starts(const Problem *problem, const double *seed, double *distances)
{
    const Workspace *work = problem->work;
    Evaluation there;
    for (int s = 0; s < problem->arm->n_starts; s++) {
        copy_start(problem, seed, s, work->trial);
        int defined = evaluate(problem, work->trial, work->trial_J, &there);
        distances[s] = defined ? there.half_square : INFINITY;
    }
}

static int nearest_start(const double *distances, int count)
{
    int nearest = 0;
    for (int s = 1; s < count; s++) {
        nearest = distances[s] < distances[nearest] ? s : nearest;
    }
    return nearest;
}

int next_start(const Problem *problem, const double *seed, int tried)
{
    const Arm *arm = problem->arm;
    const Workspace *work = problem->work;
    size_t row = arm->n * sizeof(double);
    if (seed && tried == 0) {
        memcpy(work->q, seed, row);
        return 1;
    }
    if (tried == (seed != NULL) && problem->task->n_locked) {
        measure_locked_starts(problem, seed, work->distances);
    } else if (tried == (seed != NULL)) {
        measure_starts(problem, work->distances);
    }
    int next = nearest_start(work->distances, arm->n_starts);
    if (arm->n_starts == 0 || !(work->distances[next] < INFINITY)) {
        return 0;
    }
    work->distances[next] = INFINITY;
    copy_start(problem, seed, next, work->q);
    return 1;
}

int keep_end(const Problem *problem, double half_square, double *errors, int count)
{
    const Workspace *work = problem->work;
    int n = problem->arm->n, rank = count < FINALISTS ? count : FINALISTS - 1;
    size_t row = n * sizeof(double);
    if (!(half_square < INFINITY) || (count == FINALISTS && !(half_square < errors[rank]))) {
        return count;
    }
    for (; rank > 0 && half_square < errors[rank - 1]; rank--) {
        errors[rank] = errors[rank - 1];
        memcpy(work->best + rank * n, work->best + (rank - 1) * n, row);
    }
    errors[rank] = half_square;
    memcpy(work->best + rank * n, work->q, row);
    return count < FINALISTS ? count + 1 : count;
}
