/* Test program without Python: runs the iterative solver and the damped solver for a robot under
 * compiler sanitizers. Prints the number of checked cases.
 *
 *   `solvers tool`:  Solves the inverse kinematics of the tool, on one and on several threads.
 *   `solvers link`:  Solves the inverse kinematics of the second-to-last link. Standard input
 *                    contains the number of its screws, and 8 numbers for each screw.
 *   `solvers box`:   Tests damped steps within bounds along a path that ends at a singularity.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "iterative/native/batch.h"
#include "iterative/native/evaluate.h"
#include "numerics/_tolerances.h"
#include "velocity/native/damped_box.h"

#define STARTS 64
#define POSES 24 /* number of poses: the last is not finite, and the one before is out of reach */
#define THREADS 3
#define STEPS 400
#define TOLERANCE 1e-9
#define SMALL 0x1p-40 /* scale factor: a power of 2 scales numbers without rounding */

extern const chasles_kernel chasles_kernels[];

static void fail(const char *what, int index)
{
    fprintf(stderr, "%s: %d\n", what, index);
    exit(2);
}

static const chasles_kernel *find(const char *name)
{
    const chasles_kernel *kernel = chasles_kernels;
    while (kernel->name && strcmp(kernel->name, name) != 0) {
        kernel++;
    }
    if (!kernel->name) {
        fail(name, -1);
    }
    return kernel;
}

/* Returns a number in [-1, 1] that depends only on row and k, as repeatable test data. */
static double scattered(int row, int k)
{
    unsigned long value = ((unsigned long)row * 131 + (unsigned long)k * 17 + 7) * 2654435761UL;
    return (double)(value >> 8 & 0xffff) / 0x8000 - 1;
}

static double *new_doubles(size_t count)
{
    double *made = calloc(count ? count : 1, sizeof *made);
    if (!made) {
        fail("no memory", 0);
    }
    return made;
}

/* ------------------------------------------------------------------ inverse kinematics */

static _Atomic long evaluations; /* number of calls of the counted kernel */
static chasles_kernel counting;
static const chasles_kernel *counted;

static void count_call(const double *const *inputs, double *const *outputs)
{
    evaluations++;
    counted->call(inputs, outputs);
}

/* Returns a copy of a kernel that counts its own calls. */
static const chasles_kernel *with_count(const chasles_kernel *kernel)
{
    counted = kernel;
    counting = *kernel;
    counting.call = count_call;
    return &counting;
}

static Arm new_arm(const char *mode)
{
    Arm arm = {.link = -1, .n_starts = STARTS};
    const char *names[MAX_KERNELS] = {"fk_jacobian_mixed", "hessian_mixed"};
    int is_link = strcmp(mode, "link") == 0;
    if (is_link) {
        names[0] = "link_poses";
    }
    arm.n_kernels = is_link ? 1 : 2;
    for (int k = 0; k < arm.n_kernels; k++) {
        arm.kernels[k] = find(names[k]);
    }
    arm.n = arm.kernels[0]->sizes[0];
    arm.kernels[0] = with_count(arm.kernels[0]);
    if (is_link) {
        arm.n_links = arm.kernels[0]->sizes[1] / POSE;
        arm.n_joints = arm.n;
        arm.link = arm.n_links - 2;
        if (scanf("%d", &arm.n_screws) != 1) {
            fail("number of screws is missing", 0);
        }
        arm.screws = malloc((size_t)arm.n_screws * sizeof *arm.screws);
        for (int s = 0; s < arm.n_screws; s++) {
            double row[2 + TWIST];
            for (int i = 0; i < 2 + TWIST; i++) {
                if (scanf("%lf", &row[i]) != 1) {
                    fail("screw is incomplete", s);
                }
            }
            arm.screws[s].link = (int)row[0];
            arm.screws[s].joint = (int)row[1];
            memcpy(arm.screws[s].axis, row + 2, sizeof arm.screws[s].axis);
        }
    }
    return arm;
}

/* Writes the pose of the tip, or of the selected link, at the coordinates x. */
static void pose_at(const Arm *arm, const double *x, double *T)
{
    double *J = new_doubles((size_t)TWIST * arm->n), *scratch = new_doubles(scratch_size(arm));
    if (arm->link < 0) {
        call_kernel(arm->kernels[0], x, T, J);
    } else {
        call_kernel(arm->kernels[0], x, scratch, NULL);
        memcpy(T, scratch + POSE * arm->link, POSE * sizeof(double));
    }
    free(J);
    free(scratch);
}

static void configuration(const Arm *arm, int row, double reach, double *x)
{
    for (int k = 0; k < arm->n; k++) {
        x[k] = reach * scattered(row, k);
    }
}

static void fill(Arm *arm, double reach)
{
    double *lower = new_doubles(arm->n), *upper = new_doubles(arm->n);
    double *starts = new_doubles((size_t)STARTS * arm->n), *poses = new_doubles(12 * STARTS);
    for (int k = 0; k < arm->n; k++) {
        lower[k] = -reach;
        upper[k] = reach;
    }
    for (int s = 0; s < STARTS; s++) {
        double T[POSE];
        configuration(arm, 1000 + s, reach, starts + (size_t)s * arm->n);
        pose_at(arm, starts + (size_t)s * arm->n, T);
        for (int i = 0; i < 12; i++) {
            poses[i * STARTS + s] = T[i];
        }
    }
    arm->lower = lower;
    arm->upper = upper;
    arm->starts = starts;
    arm->start_poses = poses;
}

static void empty(Arm *arm)
{
    free(arm->screws);
    free((void *)arm->lower);
    free((void *)arm->upper);
    free((void *)arm->starts);
    free((void *)arm->start_poses);
}

static Results new_results(int n)
{
    return (Results){new_doubles((size_t)POSES * n),
                     new_doubles(POSES),
                     calloc(POSES, 1),
                     calloc(POSES, 1),
                     calloc(POSES, sizeof(int)),
                     calloc(POSES, sizeof(int))};
}

static void free_results(Results *results)
{
    free(results->q);
    free(results->residual);
    free(results->success);
    free(results->ending);
    free(results->iterations);
    free(results->restarts);
}

/* Checks that the solver finds solutions within the limits for all poses except the last two. Also
 * checks that several threads return the same results as one thread. */
static void check_batch(const Arm *arm, const Task *task, const double *poses, const double *seeds)
{
    Results alone = new_results(arm->n), together = new_results(arm->n);
    PoseBatch one = {
        .arm = arm, .task = task, .poses = poses, .seeds = seeds, .results = alone, .count = POSES};
    PoseBatch many = {.arm = arm,
                      .task = task,
                      .poses = poses,
                      .seeds = seeds,
                      .results = together,
                      .count = POSES};
    long before = evaluations, reported = 0;
    solve_batch(&one, 1);
    for (int k = 0; k < POSES; k++) {
        reported += alone.iterations[k];
    }
    /* With locked coordinates, the ranking of start values also calls the kernel, so the reported
     * number of calls is not checked. */
    if (!task->n_locked && evaluations - before != reported) {
        fail("evaluations beyond the reported number", (int)(evaluations - before - reported));
    }
    solve_batch(&many, THREADS);
    if (one.out_of_memory || many.out_of_memory) {
        fail("no memory", 0);
    }
    for (int k = 0; k < POSES; k++) {
        if (alone.success[k] != (k < POSES - 2)) {
            fail("success is not as expected for pose", k);
        }
        for (int i = 0; i < arm->n; i++) {
            double q = alone.q[k * arm->n + i];
            if (task->n_locked && task->locked[i] && k < POSES - 1 && q != seeds[k * arm->n + i]) {
                fail("a locked coordinate has moved", k);
            }
            if (k < POSES - 1 && !(q >= arm->lower[i] && q <= arm->upper[i])) {
                fail("a coordinate violates its limits", k);
            }
        }
    }
    if (memcmp(alone.q, together.q, (size_t)POSES * arm->n * sizeof(double)) != 0) {
        fail("results depend on the threads", 0);
    }
    free_results(&alone);
    free_results(&together);
}

static int check_inverse(const char *mode)
{
    static const double whole[] = {1, 1, 1, 1, 1, 1}, position[] = {2, 2, 2, 0, 0, 0};
    Arm arm = new_arm(mode);
    const double reach = 1.5;
    fill(&arm, reach);
    double *poses = new_doubles(POSES * POSE);
    double *seeds = new_doubles((size_t)POSES * arm.n);
    for (int k = 0; k < POSES; k++) {
        configuration(&arm, k, reach, seeds + (size_t)k * arm.n);
        pose_at(&arm, seeds + (size_t)k * arm.n, poses + k * POSE);
        configuration(&arm, k + POSES, reach, seeds + (size_t)k * arm.n);
    }
    poses[(POSES - 2) * POSE + 3] += 1e3;
    poses[(POSES - 1) * POSE] = NAN;
    unsigned char *locked = calloc(arm.n, 1);
    if (!locked) {
        fail("no memory", 0);
    }
    locked[0] = 1;
    const Task tasks[] = {{whole, 1.0, TOLERANCE, 0, 1, 20000, NULL, 0},
                          {position, 1.0, TOLERANCE, 1, 0, 20000, NULL, 0},
                          {whole, 1.0, TOLERANCE, 0, 1, 20000, locked, 1}};
    for (int t = 0; t < 2; t++) {
        check_batch(&arm, &tasks[t], poses, NULL);
        check_batch(&arm, &tasks[t], poses, seeds);
    }
    /* The first coordinate of each seed is fixed at its value for the pose. All other seed
     * coordinates come from another configuration. */
    for (int k = 0; k < POSES; k++) {
        double *seed = seeds + (size_t)k * arm.n;
        configuration(&arm, k, reach, seed);
        double first = seed[0];
        configuration(&arm, k + POSES, reach, seed);
        seed[0] = first;
    }
    check_batch(&arm, &tasks[2], poses, seeds);
    free(locked);
    free(poses);
    free(seeds);
    empty(&arm);
    return 5 * POSES;
}

/* ------------------------------------------------------------ damped steps within bounds */

static void expect_damping(const DampedBox *box, double expected, const char *what)
{
    if (!(fabs(box->damping - expected) <= 1e-12 * expected)) {
        fail(what, (int)(1e6 * box->damping));
    }
}

/* Checks that a poor step doubles the damping, and that a good step lowers the damping slowly. */
static void check_damping(void)
{
    DampedBox box = {.damping = 0.1, .least_damping = TRACK_DAMPING};
    damped_box_adapt(&box, 1, 0, 0.5);
    expect_damping(&box, 0.1, "damping after a fair step");
    damped_box_adapt(&box, 1, 1, 2);
    expect_damping(&box, 0.1, "damping without a predicted decrease");
    damped_box_adapt(&box, 1, 0, 0.9);
    expect_damping(&box, TRACK_RAISE_DAMPING * 0.1, "damping after a poor step");
    damped_box_adapt(&box, 1, 0, 0.1);
    expect_damping(&box, TRACK_RAISE_DAMPING * 0.1 / TRACK_LOWER_DAMPING,
                   "damping after a good step");
    for (int step = 0; step < STEPS; step++) {
        damped_box_adapt(&box, 1, 0, 1);
    }
    expect_damping(&box, TRACK_GREATEST_DAMPING, "maximum damping");
    for (int step = 0; step < STEPS; step++) {
        damped_box_adapt(&box, 1, 0, 0);
    }
    expect_damping(&box, TRACK_DAMPING, "minimum damping");
}

/* Checks that the damped step is multiplied by SMALL if the twist and the bounds are multiplied by
 * SMALL. Also checks that the step is finite if some bounds are infinite. Modifies the arrays `low`
 * and `high`. */
static void check_other_bounds(DampedBox *solver, const double *y, double *low, double *high)
{
    int n = solver->n;
    double *x = new_doubles(n), small[TWIST];
    memcpy(x, solver->x, n * sizeof *x);
    for (int i = 0; i < TWIST; i++) {
        small[i] = SMALL * y[i];
    }
    for (int k = 0; k < n; k++) {
        low[k] *= SMALL;
        high[k] *= SMALL;
    }
    damped_box_solve(solver, small);
    damped_box_bound(solver, low, high);
    for (int k = 0; k < n; k++) {
        if (solver->x[k] != SMALL * x[k]) {
            fail("the step does not scale", k);
        }
        if (k % 2) {
            low[k] = -INFINITY;
            high[k] = INFINITY;
        }
    }
    damped_box_solve(solver, small);
    damped_box_bound(solver, low, high);
    for (int k = 0; k < n; k++) {
        if (!isfinite(solver->x[k])) {
            fail("the step without some bounds is not finite", k);
        }
    }
    free(x);
}

static int check_box(void)
{
    const chasles_kernel *kernel = find("fk_jacobian_mixed");
    int n = kernel->sizes[0], held = 0;
    double T[POSE], y[TWIST], *q = new_doubles(n), *J = new_doubles((size_t)TWIST * n);
    double *low = new_doubles(n), *high = new_doubles(n);
    DampedBox solver;
    if (!damped_box_new(&solver, n)) {
        fail("no memory", 0);
    }
    damped_box_start(&solver, TRACK_BORDER, TRACK_DAMPING);
    for (int step = 0; step < STEPS; step++) {
        /* The joints move towards 0, where some axes of most arms are aligned. */
        for (int k = 0; k < n; k++) {
            q[k] = scattered(0, k) * (1 - (double)step / (STEPS - 1));
            low[k] = -0.02 * (1 + scattered(step, k));
            high[k] = 0.02 * (1 + scattered(step, k + n));
        }
        for (int i = 0; i < TWIST; i++) {
            y[i] = 0.02 * scattered(step, i);
        }
        call_kernel(kernel, q, T, J);
        double smallest = damped_box_decompose(&solver, J), before = dot(y, y, TWIST);
        damped_box_solve(&solver, y);
        damped_box_bound(&solver, low, high);
        double after = damped_box_residual(&solver, y);
        damped_box_adapt(&solver, before, after, step % 7 ? after : before);
        if (!(smallest >= 0 && isfinite(after))) {
            fail("not finite", step);
        }
        for (int k = 0; k < n; k++) {
            if (!(solver.x[k] >= low[k] && solver.x[k] <= high[k])) {
                fail("a step violates its bounds", step);
            }
            held += solver.at[k] != 0;
        }
        check_other_bounds(&solver, y, low, high);
    }
    check_damping();
    damped_box_free(&solver);
    free(q);
    free(J);
    free(low);
    free(high);
    if (held < STEPS / 2) {
        fail("few bounds are active", held);
    }
    return STEPS;
}

int main(int count, char **words)
{
    const char *mode = count == 2 ? words[1] : "";
    printf("%d\n", strcmp(mode, "box") == 0 ? check_box() : check_inverse(mode));
    return 0;
}
