/* The module chasles.velocity._track, path tracking by joint rates for track.py. */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "library/_kernel.h"
#include "numerics/_tolerances.h"
#include "velocity/native/path_tracking.h"

enum { POSES, LOWER, UPPER, RATE, UNIT, Q, QD, ERROR, SIGMA, TOUCHED, N_ARRAYS };

static int has_sizes(const Py_buffer *arrays, Py_ssize_t n, Py_ssize_t m)
{
    const Py_ssize_t sizes[N_ARRAYS] = {m * POSE, n,           n,     n, n,
                                        m * n,    (m - 1) * n, m * 2, m, (m - 1) * n};
    for (int i = 0; i < N_ARRAYS; i++) {
        size_t item = i == TOUCHED ? 1 : sizeof(double);
        if (arrays[i].len != sizes[i] * (Py_ssize_t)item) {
            return 0;
        }
    }
    return 1;
}

/* Reads the array sizes. Returns -1 and sets an error if a size is wrong. */
static int read_arrays(Tracking *t, const Py_buffer *arrays)
{
    const chasles_kernel *kernel = t->kernel;
    t->n = kernel->sizes[0];
    t->m = arrays[SIGMA].len / (Py_ssize_t)sizeof(double);
    if (kernel->n_inputs != 1 || kernel->n_outputs != 2 || kernel->sizes[1] != POSE ||
        kernel->sizes[2] != TWIST * t->n || t->m < 1 || !has_sizes(arrays, t->n, t->m)) {
        PyErr_SetString(PyExc_ValueError, "follow: sizes of arrays and function do not agree");
        return -1;
    }
    t->poses = arrays[POSES].buf;
    t->lower = arrays[LOWER].buf;
    t->upper = arrays[UPPER].buf;
    t->rate = arrays[RATE].buf;
    t->unit = arrays[UNIT].buf;
    t->q = arrays[Q].buf;
    t->qd = arrays[QD].buf;
    t->error = arrays[ERROR].buf;
    t->sigma = arrays[SIGMA].buf;
    t->touched = arrays[TOUCHED].buf;
    return 0;
}

static PyObject *run(Tracking *t, double border, double damping)
{
    int defined = 1;
    if (!tracking_new(t, border, damping)) {
        return PyErr_NoMemory();
    }
    for (ptrdiff_t k = 0; defined && k < t->m && PyErr_CheckSignals() == 0; k += 1024) {
        Py_BEGIN_ALLOW_THREADS;
        defined = track_path(t, k, k + 1024);
        Py_END_ALLOW_THREADS;
    }
    tracking_free(t);
    return PyErr_Occurred() ? NULL : PyBool_FromLong(defined);
}

static PyObject *track_follow(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *capsule, *result = NULL;
    Py_buffer arrays[N_ARRAYS] = {{0}};
    Tracking t = {0};
    double border, damping;
    if (!PyArg_ParseTuple(args, "Oy*y*y*y*y*w*w*w*w*w*ddddd:follow", &capsule, &arrays[POSES],
                          &arrays[LOWER], &arrays[UPPER], &arrays[RATE], &arrays[UNIT], &arrays[Q],
                          &arrays[QD], &arrays[ERROR], &arrays[SIGMA], &arrays[TOUCHED], &t.length,
                          &t.dt, &t.gain, &border, &damping)) {
        return NULL;
    }
    t.kernel = PyCapsule_GetPointer(capsule, CHASLES_KERNEL_CAPSULE);
    if (t.kernel && read_arrays(&t, arrays) == 0) {
        result = run(&t, border, damping);
    }
    for (int i = 0; i < N_ARRAYS; i++) {
        PyBuffer_Release(&arrays[i]);
    }
    return result;
}

static PyMethodDef module_methods[] = {
    {"follow", track_follow, METH_VARARGS,
     "follow(kernel, poses, lower, upper, rate, unit, q, qd, error, sigma, touched, length, dt,\n"
     "gain, border, damping): fills q after its first row, and the other results. Returns False\n"
     "where forward kinematics is not finite at that row."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module_definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "chasles.velocity._track",
    .m_doc = "Tracks a path of poses by joint rates.",
    .m_size = 0,
    .m_methods = module_methods,
};

PyMODINIT_FUNC PyInit__track(void)
{
    PyObject *module = PyModule_Create(&module_definition);
    PyObject *border = PyFloat_FromDouble(TRACK_BORDER);
    PyObject *damping = PyFloat_FromDouble(TRACK_DAMPING);
    if (module && (PyModule_AddObjectRef(module, "BORDER", border) < 0 ||
                   PyModule_AddObjectRef(module, "DAMPING", damping) < 0)) {
        Py_CLEAR(module);
    }
    Py_XDECREF(border);
    Py_XDECREF(damping);
    return module;
}
