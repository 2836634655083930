#include "call/function/results.h"

#include <float.h>
#include <math.h>

PyObject *new_tuple(int n, PyObject *const *items)
{
    PyObject *tuple = PyTuple_New(n);
    for (int i = 0; tuple && i < n; i++) {
        PyTuple_SET_ITEM(tuple, i, Py_NewRef(items[i]));
    }
    return tuple;
}

/* Indices of the results of a function that returns all branches; `valid` comes last. */
enum { BRANCH_Q, BRANCH_RESIDUAL, BRANCH_MARGIN, BRANCH_VALID, N_BRANCH_FIELDS };

/* Reasons why poses in a batch have no valid branch. */
typedef struct {
    int refine;  /* some residual is at most `near`, so that refinement is useful */
    int no_pose; /* some residual is infinite: not a pose, or a pose of another assembly mode */
} Unsettled;

/* Examines n poses with k branches each, and finds the reasons why poses have no valid branch. */
static Unsettled find_unsettled(npy_intp n, npy_intp k, const double *residual,
                                const npy_bool *valid, double near)
{
    Unsettled found = {0, 0};
    for (; n-- > 0; residual += k, valid += k) {
        npy_intp slot = 0;
        while (slot < k && !valid[slot]) {
            slot++;
        }
        int solved = slot < k;
        for (slot = 0; !solved && slot < k; slot++) {
            found.refine |= residual[slot] <= near;
            found.no_pose |= residual[slot] > DBL_MAX;
        }
    }
    return found;
}

/* Returns residual <= tolerance as a new array of booleans, false where the residual is NaN. */
static PyObject *valid_branches(const Function *self, PyArrayObject *residual, Unsettled *unsettled)
{
    int ndim = PyArray_NDIM(residual);
    PyArrayObject *valid =
        (PyArrayObject *)PyArray_SimpleNew(ndim, PyArray_DIMS(residual), NPY_BOOL);
    PyArrayObject *dense = PyArray_ISCARRAY_RO(residual)
                               ? (PyArrayObject *)Py_NewRef(residual)
                               : (PyArrayObject *)PyArray_FROM_OTF((PyObject *)residual, NPY_DOUBLE,
                                                                   NPY_ARRAY_IN_ARRAY);
    if (!valid || !dense) {
        Py_XDECREF(valid);
        Py_XDECREF(dense);
        return NULL;
    }
    npy_intp n = PyArray_SIZE(dense), k = PyArray_DIM(dense, ndim - 1);
    const double *from = PyArray_DATA(dense), tolerance = self->tolerance;
    npy_bool *to = PyArray_DATA(valid);
    NPY_BEGIN_THREADS_DEF
    NPY_BEGIN_THREADS_THRESHOLDED(n)
    for (npy_intp i = 0; i < n; i++) {
        to[i] = from[i] <= tolerance;
    }
    if (self->refinement || self->kernel->poses) {
        *unsettled = find_unsettled(n / k, k, from, to, self->near);
    }
    NPY_END_THREADS
    Py_DECREF(dense);
    return (PyObject *)valid;
}

/* Raises an error for matrices that are not poses. Returns -1 if an error is set. */
static int refuse_poses(const Function *self, PyObject *T)
{
    PyObject *module = PyImport_ImportModule("chasles.se3");
    PyObject *answer = module ? PyObject_CallMethod(module, "refuse", "OO", self->label, T) : NULL;
    Py_XDECREF(module);
    Py_XDECREF(answer);
    return answer ? 0 : -1;
}

/* Refines the arrays `results` and `valid` in place. Returns -1 on error. */
static int refine_branches(const Function *self, PyObject *const *inputs, PyObject **results,
                           PyObject *valid)
{
    PyObject *given = new_tuple(self->kernel->n_inputs, inputs);
    PyObject *answer =
        given ? PyObject_CallFunctionObjArgs(self->refinement, given, results[BRANCH_Q],
                                             results[BRANCH_RESIDUAL], valid, NULL)
              : NULL;
    Py_XDECREF(given);
    Py_XDECREF(answer);
    return answer ? 0 : -1;
}

PyObject *pack_branches(const Function *self, PyObject *const *inputs, PyObject **results)
{
    Unsettled unsettled = {0, 0};
    PyObject *valid = valid_branches(self, (PyArrayObject *)results[BRANCH_RESIDUAL], &unsettled);
    if (valid && unsettled.no_pose && self->kernel->poses && refuse_poses(self, inputs[0]) < 0) {
        Py_CLEAR(valid);
    }
    if (valid && unsettled.refine && self->refinement &&
        refine_branches(self, inputs, results, valid) < 0) {
        Py_CLEAR(valid);
    }
    PyObject *solutions =
        valid ? self->solutions->tp_alloc(self->solutions, N_BRANCH_FIELDS) : NULL;
    if (!solutions) {
        Py_XDECREF(valid);
        for (int i = 0; i < BRANCH_VALID; i++) {
            Py_DECREF(results[i]);
        }
        return NULL;
    }
    for (int i = 0; i < BRANCH_VALID; i++) {
        PyTuple_SET_ITEM(solutions, i, results[i]);
    }
    PyTuple_SET_ITEM(solutions, BRANCH_VALID, valid);
    return solutions;
}

PyObject *branches_of_ufunc(const Function *self, PyObject *const *inputs, PyObject *result)
{
    if (!self->solutions || !result) {
        return result;
    }
    PyObject *results[BRANCH_VALID];
    for (int i = 0; i < BRANCH_VALID; i++) {
        results[i] = Py_NewRef(PyTuple_GET_ITEM(result, i));
    }
    Py_DECREF(result);
    return pack_branches(self, inputs, results);
}

int set_solutions(Function *self, PyObject *type)
{
    if (type == Py_None) {
        return 0;
    }
    if (!PyType_Check(type) || !PyType_IsSubtype((PyTypeObject *)type, &PyTuple_Type) ||
        ((PyTypeObject *)type)->tp_basicsize != PyTuple_Type.tp_basicsize ||
        self->kernel->n_outputs != BRANCH_VALID) {
        PyErr_Format(PyExc_TypeError,
                     "%U: solutions must be a subclass of tuple without members of its own, "
                     "for a function of %d outputs, got %R",
                     self->label, BRANCH_VALID, type);
        return -1;
    }
    PyObject *tolerance = PyObject_GetAttrString(type, "tolerance");
    self->tolerance = tolerance ? PyFloat_AsDouble(tolerance) : -1.0;
    Py_XDECREF(tolerance);
    if (PyErr_Occurred()) {
        return -1;
    }
    self->solutions = (PyTypeObject *)Py_NewRef(type);
    return 0;
}

int set_refinement(Function *self, PyObject *refinement)
{
    if (refinement == Py_None) {
        return 0;
    }
    PyObject *near = PyObject_GetAttrString(refinement, "near");
    self->near = near ? PyFloat_AsDouble(near) : -1.0;
    Py_XDECREF(near);
    if (PyErr_Occurred()) {
        return -1;
    }
    self->refinement = Py_NewRef(refinement);
    return 0;
}

static int values_are_finite(const double *values, npy_intp size)
{
    int not_finite = 0;
    for (npy_intp k = 0; k < size; k++) {
        not_finite |= !(fabs(values[k]) <= DBL_MAX); /* no branches: vectorized */
    }
    return !not_finite;
}

static int outputs_are_finite(const Kernel *kernel, double *const *outputs)
{
    for (int i = 0; i < kernel->n_outputs; i++) {
        if (!values_are_finite(outputs[i], kernel->operands[kernel->n_inputs + i].size)) {
            return 0;
        }
    }
    return 1;
}

/* Calls the guard function for a result that is not finite. Returns -1 on error. */
static int call_guard(Function *self, PyObject *const *inputs)
{
    PyObject *given = new_tuple(self->kernel->n_inputs, inputs);
    PyObject *answer = given ? PyObject_CallOneArg(self->guard, given) : NULL;
    Py_XDECREF(given);
    Py_XDECREF(answer);
    return answer ? 0 : -1;
}

PyObject *pack_guarded(Function *self, PyObject *const *inputs, double *const *memory,
                       PyObject **results, PyObject *const *outs)
{
    const Kernel *kernel = self->kernel;
    if (!outputs_are_finite(kernel, memory) && call_guard(self, inputs) < 0) {
        for (int i = 0; i < kernel->n_outputs; i++) {
            Py_DECREF(results[i]);
        }
        return NULL;
    }
    return pack(self, inputs, results, outs);
}

PyObject *guard_ufunc_result(Function *self, PyObject *const *inputs, PyObject *result)
{
    const Kernel *kernel = self->kernel;
    int finite = 1;
    for (int i = 0; result && finite && i < kernel->n_outputs; i++) {
        PyObject *item = kernel->n_outputs == 1 ? result : PyTuple_GET_ITEM(result, i);
        PyObject *array = PyArray_FROM_OTF(item, NPY_DOUBLE, NPY_ARRAY_IN_ARRAY);
        if (!array) {
            Py_CLEAR(result);
            break;
        }
        finite = values_are_finite(PyArray_DATA((PyArrayObject *)array),
                                   kernel->operands[kernel->n_inputs + i].size);
        Py_DECREF(array);
    }
    if (!finite && call_guard(self, inputs) < 0) {
        Py_CLEAR(result);
    }
    return result;
}
