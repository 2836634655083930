#include "iterative/native/evaluate.h"

#include <math.h>
#include <string.h>

int scratch_size(const Arm *arm)
{
    int n = arm->n, for_link = POSE * arm->n_links + arm->n_joints * n;
    return for_link + TWIST * n * n + 2 * TWIST * n;
}

void call_kernel(const chasles_kernel *kernel, const double *x, double *first, double *second)
{
    const double *const inputs[] = {x};
    double *const outputs[] = {first, second};
    kernel->call(inputs, outputs);
}

/* Writes the pose T of a link and the mixed Jacobian J (6, n) of its origin. A screw (v, w) moves
 * the link origin by v + w x lever. The lever leads from the screw frame to the link origin. */
static void evaluate_link(const Arm *arm, const double *q, double *T, double *J, double *scratch)
{
    double *poses = scratch, *rates = poses + POSE * arm->n_links;
    int n = arm->n, has_loops = arm->n_kernels > 1;
    call_kernel(arm->kernels[0], q, poses, NULL);
    memcpy(T, poses + POSE * arm->link, POSE * sizeof(double));
    if (has_loops) {
        call_kernel(arm->kernels[1], q, rates, NULL);
    }
    memset(J, 0, TWIST * n * sizeof(double));
    for (int s = 0; s < arm->n_screws; s++) {
        const Screw *screw = &arm->screws[s];
        const double *frame = poses + POSE * screw->link;
        const double lever[] = {T[3] - frame[3], T[7] - frame[7], T[11] - frame[11]};
        double v[3], w[3], by_rotation[3];
        rotate(frame, screw->axis, v);
        rotate(frame, screw->axis + 3, w);
        cross(w, lever, by_rotation);
        for (int k = 0; k < n; k++) {
            double rate = has_loops ? rates[screw->joint * n + k] : screw->joint == k;
            for (int i = 0; i < 3; i++) {
                J[i * n + k] += rate * (v[i] + by_rotation[i]);
                J[(i + 3) * n + k] += rate * w[i];
            }
        }
    }
}

/* Writes the Jacobian of the weighted error, (n, 6), from the mixed Jacobian J (6, n). */
static void error_jacobian(const Problem *problem, const double *T, const double *J,
                           const double *p, const double *w, double *columns)
{
    int n = problem->arm->n;
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < TWIST; i++) {
            columns[k * TWIST + i] = J[i * n + k];
        }
    }
    to_task_axes(problem->task, T, columns, n);
    if (!problem->task->whole) {
        differentiate_displacement(problem->task, p, w, columns, n);
    }
    apply_weights(problem->task, columns, n);
}

int evaluate(const Problem *problem, const double *x, double *columns, Evaluation *out)
{
    const Arm *arm = problem->arm;
    double *J = problem->work->scratch, *scratch = J + TWIST * arm->n, p[3];
    if (arm->link < 0) {
        call_kernel(arm->kernels[0], x, out->T, J);
    } else {
        evaluate_link(arm, x, out->T, J, scratch);
    }
    pose_error(problem->task, out->T, problem->target, out->e, p);
    error_jacobian(problem, out->T, J, p, out->e + 3, columns);
    measure_error(problem->task, p, out);
    return isfinite(out->residual);
}
