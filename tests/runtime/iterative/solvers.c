/* Calls the solvers of _numeric.h and _damped.h on a robot without Python, for the compiler's
 * sanitizers to watch. Prints how many cases were checked.
 *
 *   solvers tool       inverse kinematics of the tool, over one thread and several
 *   solvers link       of the last link but one, whose screws are read: how many, then 8 numbers each
 *   solvers platform   of the tool of a robot whose chain follows its actuators
 *   solvers box        steps along a path within a box, which ends at singularities
 */
#include <stdio.h>

#include "velocity/_damped.h"
#include "iterative/_numeric.h"

#define STARTS 64
#define POSES 24 /* of these the last is not finite, and the one before is out of reach */
#define THREADS 3
#define STEPS 400
#define TOLERANCE 1e-9

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

/* Rows of numbers in [-1, 1], that do not repeat. */
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

static Arm new_arm(const char *mode)
{
    Arm arm = {.kind = OF_TOOL, .n_starts = STARTS};
    const char *names[KERNELS] = {"fk_jacobian_mixed", "hessian_mixed"};
    arm.n_kernels = 2;
    if (strcmp(mode, "link") == 0) {
        arm.kind = OF_LINK;
        names[0] = "link_poses";
        arm.n_kernels = 1;
    } else if (strcmp(mode, "platform") == 0) {
        static const char *const of_platform[] = {"chain_fk", "chain_jacobian_mixed", "actuators",
                                                  "actuators_D_chain"};
        arm.kind = OF_PLATFORM;
        memcpy(names, of_platform, sizeof of_platform);
        arm.n_kernels = 4;
    }
    for (int k = 0; k < arm.n_kernels; k++) {
        arm.kernels[k] = find(names[k]);
    }
    arm.n = arm.kernels[0]->sizes[0];
    arm.n_all = arm.kind == OF_PLATFORM ? 2 * arm.n : arm.n;
    if (arm.kind == OF_LINK) {
        arm.n_links = arm.kernels[0]->sizes[1] / POSE;
        arm.n_joints = arm.n;
        arm.link = arm.n_links - 2;
        if (scanf("%d", &arm.n_screws) != 1) {
            fail("no screws", 0);
        }
        arm.screws = malloc((size_t)arm.n_screws * sizeof *arm.screws);
        for (int s = 0; s < arm.n_screws; s++) {
            double row[2 + SPACE];
            for (int i = 0; i < 2 + SPACE; i++) {
                if (scanf("%lf", &row[i]) != 1) {
                    fail("a screw is cut off", s);
                }
            }
            arm.screws[s].frame = (int)row[0];
            arm.screws[s].joint = (int)row[1];
            memcpy(arm.screws[s].axis, row + 2, sizeof arm.screws[s].axis);
        }
    }
    return arm;
}

/* The pose of what is at the tip. */
static void pose_at(const Arm *arm, const double *x, double *T)
{
    double *J = new_doubles((size_t)SPACE * arm->n), *scratch = new_doubles(scratch_size(arm));
    if (arm->kind == OF_TOOL) {
        call_kernel(arm->kernels[0], x, T, J);
    } else if (arm->kind == OF_LINK) {
        call_kernel(arm->kernels[0], x, scratch, NULL);
        memcpy(T, scratch + POSE * arm->link, POSE * sizeof(double));
    } else {
        call_kernel(arm->kernels[0], x + arm->n, T, NULL);
    }
    free(J);
    free(scratch);
}

/* Coordinates, and of a platform the chain's joints before them: these give the coordinates. */
static void configuration(const Arm *arm, int row, double reach, double *x)
{
    for (int k = 0; k < arm->n; k++) {
        x[arm->n_all - arm->n + k] = reach * scattered(row, k);
    }
    if (arm->kind == OF_PLATFORM) {
        x[arm->n + 2] += 1; /* the platform is above its base */
        call_kernel(arm->kernels[2], x + arm->n, x, NULL);
    }
}

static void fill(Arm *arm, double reach)
{
    arm->lower = new_doubles(arm->n);
    arm->upper = new_doubles(arm->n);
    for (int k = 0; k < arm->n; k++) {
        arm->lower[k] = arm->kind == OF_PLATFORM ? -INFINITY : -reach;
        arm->upper[k] = arm->kind == OF_PLATFORM ? INFINITY : reach;
    }
    arm->starts = new_doubles((size_t)STARTS * arm->n_all);
    arm->start_poses = new_doubles((size_t)12 * STARTS);
    for (int s = 0; s < STARTS; s++) {
        double T[POSE];
        configuration(arm, 1000 + s, reach, arm->starts + (size_t)s * arm->n_all);
        pose_at(arm, arm->starts + (size_t)s * arm->n_all, T);
        for (int i = 0; i < 12; i++) {
            arm->start_poses[i * STARTS + s] = T[i];
        }
    }
}

static void empty(Arm *arm)
{
    free(arm->screws);
    free(arm->lower);
    free(arm->upper);
    free(arm->starts);
    free(arm->start_poses);
}

static Found new_found(int n)
{
    return (Found){new_doubles((size_t)POSES * n), new_doubles(POSES), calloc(POSES, 1),
                   calloc(POSES, 1), calloc(POSES, sizeof(int)), calloc(POSES, sizeof(int))};
}

static void free_found(Found *found)
{
    free(found->q);
    free(found->residual);
    free(found->success);
    free(found->ending);
    free(found->iterations);
    free(found->restarts);
}

/* What is within reach is found, the others are not; all threads find the same. */
static void check_batch(const Arm *arm, const Task *task, const double *poses, const double *seeds)
{
    Found alone = new_found(arm->n), together = new_found(arm->n);
    Batch one = {.arm = arm, .task = task, .poses = poses, .seeds = seeds, .found = alone,
                 .count = POSES};
    Batch many = {.arm = arm, .task = task, .poses = poses, .seeds = seeds, .found = together,
                  .count = POSES};
    solve_all(&one, 1);
    solve_all(&many, THREADS);
    if (one.short_of_memory || many.short_of_memory) {
        fail("no memory", 0);
    }
    for (int k = 0; k < POSES; k++) {
        if (alone.success[k] != (k < POSES - 2)) {
            fail("a pose is reached or not against expectation", k);
        }
        for (int i = 0; i < arm->n; i++) {
            double q = alone.q[k * arm->n + i];
            if (k < POSES - 1 && !(q >= arm->lower[i] && q <= arm->upper[i])) {
                fail("beyond a limit", k);
            }
        }
    }
    if (memcmp(alone.q, together.q, (size_t)POSES * arm->n * sizeof(double)) != 0) {
        fail("threads find something else", 0);
    }
    free_found(&alone);
    free_found(&together);
}

static int check_inverse(const char *mode)
{
    static const double whole[] = {1, 1, 1, 1, 1, 1}, place[] = {2, 2, 2, 0, 0, 0};
    Arm arm = new_arm(mode);
    double reach = arm.kind == OF_PLATFORM ? 0.2 : 1.5;
    fill(&arm, reach);
    double *poses = new_doubles(POSES * POSE);
    double *seeds = new_doubles((size_t)POSES * arm.n_all);
    for (int k = 0; k < POSES; k++) {
        configuration(&arm, k, reach, seeds + (size_t)k * arm.n_all);
        pose_at(&arm, seeds + (size_t)k * arm.n_all, poses + k * POSE);
        configuration(&arm, k + POSES, reach, seeds + (size_t)k * arm.n_all);
    }
    poses[(POSES - 2) * POSE + 3] += 1e3;
    poses[(POSES - 1) * POSE] = NAN;
    const Task tasks[] = {{whole, TOLERANCE, 0, 1, 20000}, {place, TOLERANCE, 1, 0, 20000}};
    for (int t = 0; t < 2; t++) {
        check_batch(&arm, &tasks[t], poses, NULL);
        check_batch(&arm, &tasks[t], poses, seeds);
    }
    free(poses);
    free(seeds);
    empty(&arm);
    return 4 * POSES;
}

/* ------------------------------------------------------------------ within a box */

static int check_box(void)
{
    const chasles_kernel *kernel = find("fk_jacobian_mixed");
    int n = kernel->sizes[0], held = 0;
    double T[POSE], y[SPACE], *q = new_doubles(n), *J = new_doubles((size_t)SPACE * n);
    double *low = new_doubles(n), *high = new_doubles(n);
    damped solver;
    if (!damped_new(&solver, n, 0.02, 0.02)) {
        fail("no memory", 0);
    }
    for (int step = 0; step < STEPS; step++) {
        /* Towards 0, where axes of most arms are in line. */
        for (int k = 0; k < n; k++) {
            q[k] = scattered(0, k) * (1 - (double)step / (STEPS - 1));
            low[k] = -0.02 * (1 + scattered(step, k));
            high[k] = 0.02 * (1 + scattered(step, k + n));
        }
        for (int i = 0; i < SPACE; i++) {
            y[i] = 0.02 * scattered(step, i);
        }
        call_kernel(kernel, q, T, J);
        double smallest = damped_decompose(&solver, J), before = rows_dot(y, y, SPACE);
        damped_solve(&solver, y);
        damped_box(&solver, low, high);
        double after = damped_remains(&solver, y);
        damped_judge(&solver, before, after, step % 7 ? after : before);
        if (!(smallest >= 0 && isfinite(after))) {
            fail("not finite", step);
        }
        for (int k = 0; k < n; k++) {
            if (!(solver.x[k] >= low[k] && solver.x[k] <= high[k])) {
                fail("outside of the box", step);
            }
            held += solver.at[k] != 0;
        }
    }
    damped_free(&solver);
    free(q);
    free(J);
    free(low);
    free(high);
    if (held < STEPS / 2) {
        fail("the box is hardly met", held);
    }
    return STEPS;
}

int main(int count, char **words)
{
    const char *mode = count == 2 ? words[1] : "";
    printf("%d\n", strcmp(mode, "box") == 0 ? check_box() : check_inverse(mode));
    return 0;
}
