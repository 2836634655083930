/* chasles._track: follows a path of poses, one step after another; see track.py. */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "velocity/_damped.h"
#include "contract/_kernel.h"
#include "numerics/_turn.h"

#define HALVINGS 40 /* of a step that leads to where forward kinematics is not finite */

enum { RATE_TOUCHED = 1, LIMIT_TOUCHED = 2, SHORTENED = 4 };

typedef struct {
    const chasles_kernel *kernel; /* q -> T (16), J (6 n) */
    int n;
    Py_ssize_t m;
    const double *poses;               /* (m, 16) */
    const double *lower, *upper, *rate; /* (n) */
    const double *unit;                /* (n) metres of a unit of q */
    double length, dt, gain;           /* m, s, share of the error that a step corrects */
    double *q, *qd, *error, *sigma;    /* (m, n), (m - 1, n), (m, 2), (m) */
    unsigned char *touched;            /* (m - 1, n) */
    damped solver;
    double *J, *scaled, *low, *high, *step; /* (6, n), (6, n), (n), (n), (n) */
    double T[16];
    double before, expected; /* squares of the way to the next pose, before and after a step */
} Tracking;

/* The twist times time that leads from pose A to pose B: at the tip, in base axes. */
static void way_between(const double *A, const double *B, double *way)
{
    for (int i = 0; i < 3; i++) {
        way[i] = B[4 * i + 3] - A[4 * i + 3];
    }
    turn_between(A, B, way + 3);
}

/* Forward kinematics; 0 where it is not finite, as where a loop cannot be closed. */
static int evaluate(Tracking *t, const double *q)
{
    t->kernel->call(&q, (double *[]){t->T, t->J});
    double sum = 0;
    for (int i = 0; i < 16; i++) {
        sum += t->T[i];
    }
    for (int i = 0; i < 6 * t->n; i++) {
        sum += t->J[i];
    }
    return isfinite(sum);
}

/* Where the tool is compared with where it should be; the way that is missing. */
static void measure(Tracking *t, Py_ssize_t k, double *missing)
{
    way_between(t->T, t->poses + 16 * k, missing);
    t->error[2 * k] = sqrt(rows_dot(missing, missing, 3));
    t->error[2 * k + 1] = sqrt(rows_dot(missing + 3, missing + 3, 3));
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < t->n; j++) {
            t->scaled[i * t->n + j] =
                t->J[i * t->n + j] * (i < 3 ? 1 : t->length) / t->unit[j];
        }
    }
    double distance = t->error[2 * k], turned = t->length * t->error[2 * k + 1];
    if (k > 0) {
        damped_judge(&t->solver, t->before, t->expected, distance * distance + turned * turned);
    }
    t->sigma[k] = damped_decompose(&t->solver, t->scaled);
}

/* Moves a coordinate; rounding must carry it beyond neither its limits nor its rate. */
static double moved(const Tracking *t, int j, double here, double step)
{
    double most = t->rate[j] * t->dt, way = fmin(fmax(step, -most), most);
    double there = fmin(fmax(here + way, t->lower[j]), t->upper[j]);
    /* By last places of the way: those of a place near zero are too small to tell. */
    while (fabs(there - here) > most || fabs((there - here) / t->dt) > t->rate[j]) {
        way = nextafter(way, 0);
        there = fmin(fmax(here + way, t->lower[j]), t->upper[j]);
    }
    return there;
}

/* The step that leads nearest to the next pose. */
static void choose(Tracking *t, Py_ssize_t k, const double *missing)
{
    double ahead[6], way[6], all[6];
    way_between(t->poses + 16 * k, t->poses + 16 * (k + 1), ahead);
    for (int i = 0; i < 6; i++) {
        way[i] = (ahead[i] + t->gain * missing[i]) * (i < 3 ? 1 : t->length);
        all[i] = (ahead[i] + missing[i]) * (i < 3 ? 1 : t->length);
    }
    const double *q = t->q + k * t->n;
    for (int j = 0; j < t->n; j++) {
        double most = t->rate[j] * t->dt;
        t->low[j] = fmax(-most, t->lower[j] - q[j]) * t->unit[j];
        t->high[j] = fmin(most, t->upper[j] - q[j]) * t->unit[j];
    }
    damped_solve(&t->solver, way);
    damped_box(&t->solver, t->low, t->high);
    t->before = rows_dot(all, all, 6);
    t->expected = damped_remains(&t->solver, all);
    for (int j = 0; j < t->n; j++) {
        int at = t->solver.at[j];
        double to_limit = at < 0 ? q[j] - t->lower[j] : t->upper[j] - q[j];
        t->touched[k * t->n + j] =
            at == 0 ? 0 : to_limit <= t->rate[j] * t->dt ? LIMIT_TOUCHED : RATE_TOUCHED;
        t->step[j] = t->solver.x[j] / t->unit[j];
    }
}

/* Takes it, or as much of it as leads to where forward kinematics is finite. */
static void take(Tracking *t, Py_ssize_t k)
{
    int n = t->n;
    const double *q = t->q + k * n;
    double *next = t->q + (k + 1) * n, share = 1;
    for (int halvings = 0;; halvings++) {
        for (int j = 0; j < n; j++) {
            next[j] = moved(t, j, q[j], share * t->step[j]);
        }
        if (evaluate(t, next) || share == 0) {
            break;
        }
        share = halvings < HALVINGS ? share / 2 : 0;
    }
    for (int j = 0; j < n; j++) {
        t->qd[k * n + j] = (next[j] - q[j]) / t->dt;
        t->touched[k * n + j] |= share < 1 ? SHORTENED : 0;
    }
}

/* 0 if it starts where forward kinematics is not finite. */
static int follow(Tracking *t)
{
    double missing[6];
    if (!evaluate(t, t->q)) {
        return 0;
    }
    measure(t, 0, missing);
    for (Py_ssize_t k = 0; k + 1 < t->m; k++) {
        choose(t, k, missing);
        take(t, k);
        measure(t, k + 1, missing);
    }
    return 1;
}

/* ------------------------------------------------------------------ Python */

enum { POSES, LOWER, UPPER, RATE, UNIT, Q, QD, ERROR, SIGMA, TOUCHED, N_ARRAYS };

/* Whether every array has the size that n and m give it. */
static int fits(const Py_buffer *arrays, Py_ssize_t n, Py_ssize_t m)
{
    const Py_ssize_t sizes[N_ARRAYS] = {m * 16, n, n, n, n, m * n, (m - 1) * n, m * 2, m,
                                        (m - 1) * n};
    for (int i = 0; i < N_ARRAYS; i++) {
        size_t item = i == TOUCHED ? 1 : sizeof(double);
        if (arrays[i].len != sizes[i] * (Py_ssize_t)item) {
            return 0;
        }
    }
    return 1;
}

static PyObject *run(Tracking *t, double smallest, double damping)
{
    size_t n = (size_t)t->n;
    double *block = malloc(15 * n * sizeof(double));
    if (!block) {
        return PyErr_NoMemory();
    }
    if (!damped_new(&t->solver, t->n, smallest, damping)) {
        free(block);
        return PyErr_NoMemory();
    }
    t->J = block;
    t->scaled = t->J + 6 * n;
    t->low = t->scaled + 6 * n;
    t->high = t->low + n;
    t->step = t->high + n;
    int sound;
    Py_BEGIN_ALLOW_THREADS;
    sound = follow(t);
    Py_END_ALLOW_THREADS;
    damped_free(&t->solver);
    free(block);
    return PyBool_FromLong(sound);
}

static PyObject *track_follow(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *capsule, *result = NULL;
    Py_buffer arrays[N_ARRAYS] = {{0}};
    Tracking t = {0};
    double smallest, damping;
    if (!PyArg_ParseTuple(args, "Oy*y*y*y*y*w*w*w*w*w*ddddd:follow", &capsule, &arrays[POSES],
                          &arrays[LOWER], &arrays[UPPER], &arrays[RATE], &arrays[UNIT], &arrays[Q],
                          &arrays[QD], &arrays[ERROR], &arrays[SIGMA], &arrays[TOUCHED], &t.length,
                          &t.dt, &t.gain, &smallest, &damping)) {
        return NULL;
    }
    t.kernel = PyCapsule_GetPointer(capsule, CHASLES_KERNEL_CAPSULE);
    if (t.kernel) {
        const chasles_kernel *kernel = t.kernel;
        t.n = kernel->sizes[0];
        t.m = arrays[SIGMA].len / (Py_ssize_t)sizeof(double);
        if (kernel->n_inputs != 1 || kernel->n_outputs != 2 || kernel->sizes[1] != 16 ||
            kernel->sizes[2] != 6 * t.n || t.m < 1 || !fits(arrays, t.n, t.m)) {
            PyErr_SetString(PyExc_ValueError, "follow: sizes do not go together");
        }
        else {
            t.poses = arrays[POSES].buf;
            t.lower = arrays[LOWER].buf;
            t.upper = arrays[UPPER].buf;
            t.rate = arrays[RATE].buf;
            t.unit = arrays[UNIT].buf;
            t.q = arrays[Q].buf;
            t.qd = arrays[QD].buf;
            t.error = arrays[ERROR].buf;
            t.sigma = arrays[SIGMA].buf;
            t.touched = arrays[TOUCHED].buf;
            result = run(&t, smallest, damping);
        }
    }
    for (int i = 0; i < N_ARRAYS; i++) {
        PyBuffer_Release(&arrays[i]);
    }
    return result;
}

static PyMethodDef module_methods[] = {
    {"follow", track_follow, METH_VARARGS,
     "follow(kernel, poses, lower, upper, rate, unit, q, qd, error, sigma, touched, length, dt,\n"
     "gain, smallest, damping): fills q from its first row on, and what is beside it."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module_definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "chasles.velocity._track",
    .m_doc = "Follows a path of poses, one step after another.",
    .m_size = 0,
    .m_methods = module_methods,
};

PyMODINIT_FUNC PyInit__track(void)
{
    return PyModule_Create(&module_definition);
}
