/* The module chasles.iterative._numeric: iterative inverse kinematics, called from Python.
 *
 * A Solver owns an Arm (native/arm.h), which contains the tip frame, the limits, and the start
 * configurations with their poses. The solver keeps the compiled robot functions loaded. */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <numpy/arrayobject.h>

#include "iterative/native/arm.h"
#include "iterative/native/batch.h"

enum { N_TABLES = 4 };

typedef struct {
    PyObject_HEAD
    Arm arm;
    PyObject *capsules;              /* the compiled functions, which keep their library loaded */
    PyArrayObject *tables[N_TABLES]; /* limits, start configurations and start poses */
} Solver;

/* Converts to a dense array of doubles with this shape (-1 for any size). Returns NULL on error. */
static PyArrayObject *doubles(PyObject *object, const char *name, int ndim, const npy_intp *shape)
{
    PyArrayObject *array =
        (PyArrayObject *)PyArray_FROM_OTF(object, NPY_DOUBLE, NPY_ARRAY_IN_ARRAY);
    int fits = array && PyArray_NDIM(array) == ndim;
    for (int i = 0; fits && i < ndim; i++) {
        fits = shape[i] < 0 || PyArray_DIM(array, i) == shape[i];
    }
    if (array && !fits) {
        PyErr_Format(PyExc_ValueError, "%s: wrong shape", name);
        Py_CLEAR(array);
    }
    return array;
}

static void solver_dealloc(Solver *self)
{
    Py_XDECREF(self->capsules);
    for (int i = 0; i < N_TABLES; i++) {
        Py_XDECREF(self->tables[i]);
    }
    free(self->arm.screws);
    Py_TYPE(self)->tp_free((PyObject *)self);
}

/* Tests that the function has one input and n_outputs outputs of these sizes (-1: any size).
 * Returns 0 on error. */
static int has_sizes(const chasles_kernel *kernel, int n_outputs, int input, int first, int second)
{
    const int sizes[] = {input, first, second};
    int fits = kernel->n_inputs == 1 && kernel->n_outputs == n_outputs;
    for (int i = 0; fits && i <= n_outputs; i++) {
        fits = sizes[i] < 0 || kernel->sizes[i] == sizes[i];
    }
    if (!fits) {
        PyErr_Format(PyExc_ValueError, "%s: its sizes do not match the other functions",
                     kernel->name);
    }
    return fits;
}

/* Reads the array sizes of the arm's functions. Returns 0 if a size is wrong. */
static int read_sizes(Arm *self)
{
    const chasles_kernel *const *kernels = self->kernels;
    int n = self->n = kernels[0]->sizes[0];
    if (self->link < 0) {
        return has_sizes(kernels[0], 2, n, POSE, TWIST * n) &&
               has_sizes(kernels[1], 1, n, TWIST * n * n, 0);
    }
    self->n_links = kernels[0]->sizes[1] / POSE;
    self->n_joints = self->n_kernels > 1 ? kernels[1]->sizes[1] / n : n;
    return has_sizes(kernels[0], 1, n, -1, 0) &&
           (self->n_kernels == 1 || has_sizes(kernels[1], 1, n, self->n_joints * n, 0));
}

/* Reads the compiled functions for the tip. Returns -1 on error. */
static int read_kernels(Solver *self, PyObject *capsules)
{
    Py_ssize_t count = PyTuple_GET_SIZE(capsules);
    if (count < (self->arm.link < 0 ? MAX_KERNELS : 1) || count > MAX_KERNELS) {
        PyErr_Format(PyExc_ValueError,
                     "kernels: got %zd, expected two for the tool, one or two for a link", count);
        return -1;
    }
    self->arm.n_kernels = (int)count;
    self->capsules = Py_NewRef(capsules);
    for (int k = 0; k < self->arm.n_kernels; k++) {
        PyObject *capsule = PyTuple_GET_ITEM(capsules, k);
        self->arm.kernels[k] = PyCapsule_GetPointer(capsule, CHASLES_KERNEL_CAPSULE);
        if (!self->arm.kernels[k]) {
            return -1;
        }
    }
    return 0;
}

/* Reads the screws of the joints between base and link, as rows of (link, joint, axis). */
static int read_screws(Arm *self, PyObject *rows)
{
    const npy_intp shape[] = {-1, 2 + TWIST};
    PyArrayObject *array = doubles(rows, "screws", 2, shape);
    if (!array) {
        return -1;
    }
    const double *row = PyArray_DATA(array);
    self->n_screws = (int)PyArray_DIM(array, 0);
    self->screws = malloc((self->n_screws + 1) * sizeof(Screw));
    int fit = self->link < self->n_links;
    for (int k = 0; self->screws && fit && k < self->n_screws; k++, row += 2 + TWIST) {
        Screw *screw = &self->screws[k];
        screw->link = (int)row[0];
        screw->joint = (int)row[1];
        memcpy(screw->axis, row + 2, sizeof screw->axis);
        fit = screw->link >= 0 && screw->link < self->n_links && screw->joint >= 0 &&
              screw->joint < self->n_joints;
    }
    Py_DECREF(array);
    if (!self->screws) {
        PyErr_NoMemory();
    } else if (!fit) {
        PyErr_SetString(PyExc_ValueError, "link or screws: an index is out of range");
    }
    return self->screws && fit ? 0 : -1;
}

/* Reads the limits, the start configurations and the start poses. Returns -1 on error. */
static int read_tables(Solver *self, PyObject *lower, PyObject *upper, PyObject *starts,
                       PyObject *poses)
{
    const npy_intp n[] = {self->arm.n}, rows[] = {-1, self->arm.n};
    PyArrayObject **tables = self->tables;
    if (!(tables[0] = doubles(lower, "lower", 1, n)) ||
        !(tables[1] = doubles(upper, "upper", 1, n)) ||
        !(tables[2] = doubles(starts, "starts", 2, rows))) {
        return -1;
    }
    const npy_intp entries[] = {12, PyArray_DIM(tables[2], 0)};
    self->arm.n_starts = (int)entries[1];
    if (!(tables[3] = doubles(poses, "poses of starts", 2, entries))) {
        return -1;
    }
    const double **const members[] = {&self->arm.lower, &self->arm.upper, &self->arm.starts,
                                      &self->arm.start_poses};
    for (int i = 0; i < N_TABLES; i++) {
        *members[i] = PyArray_DATA(tables[i]);
    }
    return 0;
}

static PyObject *solver_new(PyTypeObject *type, PyObject *args, PyObject *kwargs)
{
    static char *names[] = {"kernels", "lower", "upper", "starts", "poses", "link", "screws", NULL};
    PyObject *capsules, *lower, *upper, *starts, *poses, *screws = NULL;
    int link = -1;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, "O!OOOO|iO:Solver", names, &PyTuple_Type,
                                     &capsules, &lower, &upper, &starts, &poses, &link, &screws)) {
        return NULL;
    }
    if (link >= 0 && !screws) {
        PyErr_SetString(PyExc_ValueError, "screws: expected for a link");
        return NULL;
    }
    Solver *self = (Solver *)type->tp_alloc(type, 0);
    if (!self) {
        return NULL;
    }
    self->arm.link = link;
    if (read_kernels(self, capsules) < 0 || !read_sizes(&self->arm) ||
        (link >= 0 && read_screws(&self->arm, screws) < 0) ||
        read_tables(self, lower, upper, starts, poses) < 0) {
        Py_CLEAR(self);
    }
    return (PyObject *)self;
}

/* Converts to a dense array of poses (..., 4, 4). Returns NULL on error. */
static PyArrayObject *read_poses(PyObject *object)
{
    PyArrayObject *array =
        (PyArrayObject *)PyArray_FROM_OTF(object, NPY_DOUBLE, NPY_ARRAY_IN_ARRAY);
    int ndim = array ? PyArray_NDIM(array) : 0;
    if (array &&
        (ndim < 2 || PyArray_DIM(array, ndim - 1) != 4 || PyArray_DIM(array, ndim - 2) != 4)) {
        PyErr_SetString(PyExc_ValueError, "T: expected shape (..., 4, 4)");
        Py_CLEAR(array);
    }
    return array;
}

/* The results, in the order of the struct Results. */
enum { N_RESULTS = 6, MAX_NDIM = 32 };
static const int RESULT_TYPES[N_RESULTS] = {NPY_DOUBLE, NPY_DOUBLE, NPY_BOOL,
                                            NPY_INT8,   NPY_INT32,  NPY_INT32};

/* Creates the result arrays for the batch of T. Returns -1 on error. */
static int new_results(const Solver *self, PyArrayObject *T, PyObject **results)
{
    npy_intp shape[MAX_NDIM];
    int ndim = PyArray_NDIM(T) - 2;
    if (ndim + 1 > MAX_NDIM) {
        PyErr_SetString(PyExc_ValueError, "T: too many dimensions");
        return -1;
    }
    memcpy(shape, PyArray_DIMS(T), ndim * sizeof(npy_intp));
    shape[ndim] = self->arm.n;
    for (int i = 0; i < N_RESULTS; i++) {
        results[i] = PyArray_EMPTY(i == 0 ? ndim + 1 : ndim, shape, RESULT_TYPES[i], 0);
        if (!results[i]) {
            return -1;
        }
    }
    return 0;
}

/* Handles signals; returns nonzero with an error if a signal such as Ctrl-C ends the work. */
static int is_interrupted(void)
{
    PyGILState_STATE state = PyGILState_Ensure();
    int stops = PyErr_CheckSignals() < 0;
    PyGILState_Release(state);
    return stops;
}

/* Solves all poses without holding the interpreter lock (GIL). Returns -1 on error. */
static int run(const Solver *self, Task *task, PyArrayObject *T, PyArrayObject *seeds,
               PyObject *const *results, long threads)
{
    void *to[N_RESULTS];
    for (int i = 0; i < N_RESULTS; i++) {
        to[i] = PyArray_DATA((PyArrayObject *)results[i]);
    }
    npy_intp count = PyArray_SIZE(T) / POSE;
    task->whole = 1;
    for (int i = 0; i < TWIST; i++) {
        task->whole &= task->weights[i] > 0;
    }
    PoseBatch batch = {.arm = &self->arm,
                       .task = task,
                       .poses = PyArray_DATA(T),
                       .seeds = seeds ? PyArray_DATA(seeds) : NULL,
                       .results = {to[0], to[1], to[2], to[3], to[4], to[5]},
                       .count = count,
                       .is_stopped = is_interrupted};
    threads = threads < 1 ? 1 : threads > MAX_THREADS ? MAX_THREADS : threads;
    threads = threads > 1 + count / POSES_AT_A_TIME ? 1 + count / POSES_AT_A_TIME : threads;
    Py_BEGIN_ALLOW_THREADS
    solve_batch(&batch, (int)threads);
    Py_END_ALLOW_THREADS
    if (atomic_load(&batch.out_of_memory)) {
        PyErr_NoMemory();
        return -1;
    }
    return PyErr_Occurred() ? -1 : 0;
}

/* Reads the mask (n,) of locked coordinates. Locking requires seeds. Returns NULL on error. */
static PyArrayObject *read_locked(const Solver *self, PyObject *object, PyObject *seeds, Task *task)
{
    PyArrayObject *array = (PyArrayObject *)PyArray_FROM_OTF(object, NPY_BOOL, NPY_ARRAY_IN_ARRAY);
    if (array && (PyArray_NDIM(array) != 1 || PyArray_DIM(array, 0) != self->arm.n)) {
        PyErr_SetString(PyExc_ValueError, "locked: wrong shape");
        Py_CLEAR(array);
    }
    task->locked = array ? PyArray_DATA(array) : NULL;
    for (int k = 0; array && k < self->arm.n; k++) {
        task->n_locked += task->locked[k] != 0;
    }
    if (task->n_locked && seeds == Py_None) {
        PyErr_SetString(PyExc_ValueError, "locked: expected seeds as well");
        Py_CLEAR(array);
    }
    return array;
}

/* The method solve, with the arguments of _numeric.pyi. */
static PyObject *solver_solve(Solver *self, PyObject *const *args, Py_ssize_t n_args)
{
    if (n_args != 9) {
        return PyErr_Format(PyExc_TypeError, "solve: expected 9 arguments, got %zd", n_args);
    }
    double unit = PyFloat_AsDouble(args[5]), per_unit[TWIST];
    Task task = {.in_tool_axes = PyObject_IsTrue(args[3]),
                 .weights = per_unit,
                 .unit = unit,
                 .tolerance = PyFloat_AsDouble(args[4]) / unit,
                 .budget = (int)PyLong_AsLong(args[6])};
    long threads = PyLong_AsLong(args[7]);
    if (PyErr_Occurred()) {
        return NULL;
    }
    const npy_intp six[] = {TWIST};
    PyObject *results[N_RESULTS] = {NULL}, *result = NULL;
    PyArrayObject *T = read_poses(args[0]), *seeds = NULL;
    PyArrayObject *weights = T ? doubles(args[2], "weights", 1, six) : NULL;
    PyArrayObject *locked = weights ? read_locked(self, args[8], args[1], &task) : NULL;
    int fits = locked != NULL;
    if (fits && args[1] != Py_None) {
        const npy_intp rows[] = {PyArray_SIZE(T) / POSE, self->arm.n};
        seeds = doubles(args[1], "seeds", 2, rows);
        fits = seeds != NULL;
    }
    if (fits && new_results(self, T, results) == 0) {
        const double *given = PyArray_DATA(weights);
        for (int i = 0; i < TWIST; i++) {
            per_unit[i] = i < 3 ? given[i] / unit : given[i];
        }
        if (run(self, &task, T, seeds, results, threads) == 0) {
            result = PyTuple_New(N_RESULTS);
        }
    }
    for (int i = 0; i < N_RESULTS; i++) {
        if (result) {
            PyTuple_SET_ITEM(result, i, PyArray_Return((PyArrayObject *)results[i]));
        } else {
            Py_XDECREF(results[i]);
        }
    }
    Py_XDECREF(T);
    Py_XDECREF(seeds);
    Py_XDECREF(weights);
    Py_XDECREF(locked);
    return result;
}

static PyMethodDef solver_methods[] = {
    {"solve", (PyCFunction)(void (*)(void))solver_solve, METH_FASTCALL,
     "solve(T, seeds, weights, in_tool_axes, tolerance, unit, budget, threads, locked): inverse\n"
     "kinematics of poses (..., 4, 4). Returns coordinates, residual, success, ending, iterations, "
     "restarts."},
    {NULL},
};

static PyTypeObject SolverType = {
    PyVarObject_HEAD_INIT(NULL, 0).tp_name = "chasles.iterative._numeric.Solver",
    .tp_doc = "A robot with a frame of it as the tip, its limits and its table of starts.",
    .tp_basicsize = sizeof(Solver),
    .tp_flags = Py_TPFLAGS_DEFAULT,
    .tp_new = solver_new,
    .tp_dealloc = (destructor)solver_dealloc,
    .tp_methods = solver_methods,
};

static struct PyModuleDef module_definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "chasles.iterative._numeric",
    .m_doc = "Levenberg-Marquardt on compiled forward kinematics.",
    .m_size = -1,
};

PyMODINIT_FUNC PyInit__numeric(void)
{
    import_array();
    PyObject *module = PyModule_Create(&module_definition);
    if (module && PyModule_AddType(module, &SolverType) < 0) {
        Py_CLEAR(module);
    }
    return module;
}
