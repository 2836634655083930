#include "call/function/nearest_rows.h"

#include <string.h>

#include "numerics/_rigid.h"

#define MAX_SLOTS 64 /* maximum number of solution slots per pose that C can select from */

/* Solves for a block of rows. */
static void solve_block(const Function *inverse, npy_intp first, npy_intp count, const Rows *rows)
{
    const Kernel *kernel = inverse->kernel;
    const npy_intp k = slots_of(kernel), n = coordinates_of(kernel);
    const double *inputs[MAX_OPERANDS], *q_seed = rows->q_seed + first * rows->seed_step;
    double scratch[SCRATCH];
    double *const slots[] = {scratch, scratch + count * k * n, scratch + count * k * (n + 1)};
    double *const to[] = {rows->results[0] + first * n, rows->results[1] + first,
                          rows->results[2] + first};
    npy_int8 *slot = rows->slot + first;
    for (int i = 0; i < kernel->n_inputs; i++) {
        inputs[i] = rows->inputs[i] + first * rows->steps[i];
    }
    if (kernel->poses != POSES_JUDGED && !kernel->fk &&
        (!kernel->poses || rigidity(inputs[0]) == RIGID)) {
        npy_intp row = kernel->poses ? 0 : count;
        kernel->entry->nearest_rows((size_t)count, inputs, rows->steps, inverse->tolerance,
                                    rows->moves, q_seed, rows->seed_step, to, slot);
        while (row < count && slot[row] >= 0 &&
               is_settled(inputs[0] + row * rows->steps[0], to[1] + row, 1)) {
            row++;
        }
        if (row == count) {
            return;
        }
    }
    run_kernel_rows(kernel, count, inputs, rows->steps, slots, (const ptrdiff_t[]){k * n, k, k});
    kernel->entry->nearest((size_t)count, (int)n, (int)k, (const double *const *)slots,
                           inverse->tolerance, rows->moves, q_seed, rows->seed_step, to, slot);
}

void run_nearest(const Function *inverse, npy_intp n, const Rows *rows)
{
    const npy_intp k = slots_of(inverse->kernel), width = coordinates_of(inverse->kernel) + 2;
    const npy_intp size = MAX_BLOCK * k * width > SCRATCH ? SCRATCH / (k * width) : MAX_BLOCK;
    for (npy_intp first = 0; first < n; first += size) {
        solve_block(inverse, first, n - first < size ? n - first : size, rows);
    }
}

/* Reads an array of (n, ...) or (1, ...) dense rows. Returns -1 on error. */
static int read_rows(PyObject *object, int type, npy_intp n, npy_intp size, void *data,
                     ptrdiff_t *step)
{
    PyArrayObject *array = (PyArrayObject *)object;
    if (!PyArray_Check(object) || PyArray_TYPE(array) != type || !PyArray_ISCARRAY_RO(array) ||
        PyArray_NDIM(array) < 1 ||
        (PyArray_DIM(array, 0) != n && (PyArray_DIM(array, 0) != 1 || !step)) ||
        PyArray_SIZE(array) != PyArray_DIM(array, 0) * size) {
        PyErr_SetString(PyExc_TypeError, "nearest_rows: expected dense rows of numbers");
        return -1;
    }
    void *memory = PyArray_DATA(array);
    memcpy(data, &memory, sizeof memory);
    if (step) {
        *step = PyArray_DIM(array, 0) == n ? size : 0;
    }
    return 0;
}

int read_moves(PyObject *moves, npy_intp n, const double **to)
{
    for (int i = 0; i < N_MOVES; i++) {
        /* The limits of coupled joints come after the limits of the coordinates. */
        PyObject *given = PyTuple_GET_ITEM(moves, i);
        const npy_intp size =
            i < 2 && PyArray_Check(given) ? PyArray_SIZE((PyArrayObject *)given) : n;
        if (read_rows(given, NPY_DOUBLE, size < n ? n : size, 1, &to[i], NULL) < 0) {
            return -1;
        }
    }
    return 0;
}

int can_select(const Function *inverse)
{
    return inverse->solutions && inverse->kernel->entry->nearest_rows &&
           slots_of(inverse->kernel) * (coordinates_of(inverse->kernel) + 2) <= SCRATCH;
}

/* Reads the results, and sets n to the number of their rows. Returns -1 on error. */
static int read_results(const Kernel *kernel, PyObject *results, npy_intp *n, Rows *rows)
{
    const npy_intp sizes[] = {coordinates_of(kernel), 1, 1};
    PyObject *slot = PyTuple_GET_SIZE(results) == 4 ? PyTuple_GET_ITEM(results, 3) : NULL;
    if (!slot || !PyArray_Check(slot) || PyArray_NDIM((PyArrayObject *)slot) != 1) {
        PyErr_SetString(PyExc_TypeError, "nearest_rows: expected four results, slots (n,) last");
        return -1;
    }
    *n = PyArray_DIM((PyArrayObject *)slot, 0);
    for (int i = 0; i < 3; i++) {
        if (read_rows(PyTuple_GET_ITEM(results, i), NPY_DOUBLE, *n, sizes[i], &rows->results[i],
                      NULL) < 0) {
            return -1;
        }
    }
    return read_rows(slot, NPY_INT8, *n, 1, &rows->slot, NULL);
}

/* Reads the arguments of a function of the module; `given` contains the input arrays, or the arrays
 * of all solution slots. Returns the inverse kinematics function, or NULL on error. */
static const Function *read_call(PyObject *args, PyObject **given, npy_intp *n, Rows *rows)
{
    PyObject *inverse, *seed, *moves, *results;
    if (!PyArg_ParseTuple(args, "O!O!OO!O!", &FunctionType, &inverse, &PyTuple_Type, given, &seed,
                          &PyTuple_Type, &moves, &PyTuple_Type, &results)) {
        return NULL;
    }
    const Function *function = (const Function *)inverse;
    if (!can_select(function) || PyTuple_GET_SIZE(moves) != N_MOVES) {
        PyErr_SetString(PyExc_TypeError, "nearest_rows: expected an inverse and four moves");
        return NULL;
    }
    const npy_intp width = coordinates_of(function->kernel);
    if (read_results(function->kernel, results, n, rows) < 0 ||
        read_rows(seed, NPY_DOUBLE, *n, width, &rows->q_seed, &rows->seed_step) < 0 ||
        read_moves(moves, width, rows->moves) < 0) {
        return NULL;
    }
    return function;
}

PyObject *nearest_rows(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *inputs;
    npy_intp n;
    Rows rows;
    const Function *inverse = read_call(args, &inputs, &n, &rows);
    if (!inverse) {
        return NULL;
    }
    const Kernel *kernel = inverse->kernel;
    if (PyTuple_GET_SIZE(inputs) != kernel->n_inputs) {
        PyErr_SetString(PyExc_TypeError, "nearest_rows: expected every input of the inverse");
        return NULL;
    }
    for (int i = 0; i < kernel->n_inputs; i++) {
        if (read_rows(PyTuple_GET_ITEM(inputs, i), NPY_DOUBLE, n, kernel->operands[i].size,
                      &rows.inputs[i], &rows.steps[i]) < 0) {
            return NULL;
        }
    }
    Py_BEGIN_ALLOW_THREADS;
    run_nearest(inverse, n, &rows);
    Py_END_ALLOW_THREADS;
    Py_RETURN_NONE;
}

PyObject *nearest_of_slots(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *given;
    npy_intp n;
    Rows rows;
    const Function *inverse = read_call(args, &given, &n, &rows);
    if (!inverse) {
        return NULL;
    }
    const npy_intp width = coordinates_of(inverse->kernel);
    PyObject *residual = PyTuple_GET_SIZE(given) == 3 ? PyTuple_GET_ITEM(given, 1) : NULL;
    if (!residual || !PyArray_Check(residual) || PyArray_NDIM((PyArrayObject *)residual) != 2 ||
        PyArray_DIM((PyArrayObject *)residual, 1) > MAX_SLOTS) {
        PyErr_SetString(PyExc_TypeError, "nearest_of_slots: expected at most 64 slots (n, k)");
        return NULL;
    }
    const npy_intp k = PyArray_DIM((PyArrayObject *)residual, 1), sizes[] = {k * width, k, k};
    const double *slots[3];
    for (int i = 0; i < 3; i++) {
        if (read_rows(PyTuple_GET_ITEM(given, i), NPY_DOUBLE, n, sizes[i], &slots[i], NULL) < 0) {
            return NULL;
        }
    }
    inverse->kernel->entry->nearest((size_t)n, (int)width, (int)k, slots, inverse->tolerance,
                                    rows.moves, rows.q_seed, rows.seed_step, rows.results,
                                    rows.slot);
    Py_RETURN_NONE;
}
