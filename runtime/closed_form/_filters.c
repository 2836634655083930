/* The module chasles.closed_form._filters: compiled filters of Solutions (solutions.py).
 *
 * All arrays are C-contiguous, for N poses with k solution slots of n coordinates each. */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <numpy/arrayobject.h>

#include "chasles_distance.h"
#include "closed_form/_cells.h"

#define TURN CHASLES_FULL_TURN

/* Returns the data of a C-order array of this type and size, or NULL on error. */
static void *dense(PyObject *object, int type, npy_intp size)
{
    PyArrayObject *array = (PyArrayObject *)object;
    if (!PyArray_Check(object) || PyArray_TYPE(array) != type || !PyArray_ISCARRAY_RO(array) ||
        PyArray_SIZE(array) != size) {
        PyErr_SetString(PyExc_TypeError, "_filters: expected dense arrays of one batch");
        return NULL;
    }
    return PyArray_DATA(array);
}

/* The solution slots of a call. */
typedef struct {
    npy_intp poses, k, n;
    const double *q;
    const npy_bool *valid;
} Slots;

/* Reads q (..., k, n) and valid (..., k). Returns -1 on error. */
static int read_slots(PyObject *q, PyObject *valid, Slots *slots)
{
    PyArrayObject *array = (PyArrayObject *)q;
    if (!PyArray_Check(q) || PyArray_NDIM(array) < 2) {
        PyErr_SetString(PyExc_TypeError, "_filters: expected coordinates (..., k, n)");
        return -1;
    }
    const int ndim = PyArray_NDIM(array);
    slots->k = PyArray_DIM(array, ndim - 2);
    slots->n = PyArray_DIM(array, ndim - 1);
    slots->poses = PyArray_MultiplyList(PyArray_DIMS(array), ndim - 2);
    if (slots->n > MAX_JOINTS) {
        PyErr_SetString(PyExc_TypeError, "_filters: expected at most 64 coordinates");
        return -1;
    }
    slots->q = dense(q, NPY_DOUBLE, slots->poses * slots->k * slots->n);
    slots->valid = dense(valid, NPY_BOOL, slots->poses * slots->k);
    return slots->q && slots->valid ? 0 : -1;
}

/* Returns a new array with the leading dimensions of q and `more` further dimensions. */
static PyObject *new_like(PyObject *q, int type, int more, npy_intp first, npy_intp second)
{
    npy_intp dims[NPY_MAXDIMS];
    const int leading = PyArray_NDIM((PyArrayObject *)q) - 2;
    memcpy(dims, PyArray_DIMS((PyArrayObject *)q), leading * sizeof *dims);
    dims[leading] = first;
    dims[leading + 1] = second;
    return PyArray_SimpleNew(leading + more, dims, type);
}

/* Returns `result`, or NULL if a signal such as Ctrl-C must end the loop over poses. */
static PyObject *unless_stopped(PyObject *result, npy_intp pose)
{
    if (pose % 1024 == 1023 && PyErr_CheckSignals() < 0) {
        Py_CLEAR(result);
    }
    return result;
}

/* Limits of the coordinates. For each coordinate, `windings` is the maximum number of values within
 * the limits that differ from each other by full turns. */
typedef struct {
    const double *low, *high, *turn, *rounding;
    const npy_intp *windings;
    npy_intp count;
} Limits;

/* Returns the number k of full turns in the first value q + 2 pi k that write_turns writes. */
static double first_turn(const Limits *limits, npy_intp j, double q)
{
    if (limits->turn[j] == 0) {
        return 0;
    }
    const double last = floor((limits->high[j] - q + limits->rounding[j]) / TURN);
    const double least = ceil((limits->low[j] - q - limits->rounding[j]) / TURN);
    if (limits->windings[j] > 1) {
        return last - (double)limits->windings[j] + 1;
    }
    const double not_below = least > 0 ? least : 0;
    return not_below < last ? not_below : last;
}

/* Writes the equivalent values of each coordinate, and whether each value is within the limits.
 * Equivalent values differ by full turns. A value that exceeds a limit by rounding is set to the
 * limit. */
static void write_turns(const Limits *limits, npy_intp n, const double *slot, double *value,
                        npy_bool *inside)
{
    for (npy_intp j = 0; j < n; j++) {
        const double low = limits->low[j], high = limits->high[j];
        const double first = first_turn(limits, j, slot[j]);
        for (npy_intp turn = 0; turn < limits->windings[j]; turn++, value++, inside++) {
            const double q = slot[j] + TURN * (first + (double)turn);
            *inside = q >= low - limits->rounding[j] && q <= high + limits->rounding[j];
            *value = *inside && q < low ? low : *inside && q > high ? high : q;
        }
    }
}

/* Lists all windings of a solution. */
static void write_windings(const Limits *limits, npy_intp n, const double *value,
                           const npy_bool *inside, npy_bool valid, double *q, npy_bool *all)
{
    npy_intp block = 1;
    all[0] = valid;
    for (npy_intp j = n - 1; j >= 0; block *= limits->windings[j--]) {
        for (npy_intp turn = limits->windings[j] - 1; turn >= 0; turn--) {
            double *const to = turn ? memcpy(q + turn * block * n, q, block * n * sizeof *q) : q;
            value--, inside--;
            for (npy_intp w = 0; w < block; w++) {
                to[w * n + j] = *value;
                all[turn * block + w] = all[w] & *inside;
            }
        }
    }
}

/* Reads (low, high, turn, rounding, windings) of n coordinates. Returns -1 on error. */
static int read_limits(PyObject *given, npy_intp n, Limits *limits)
{
    const double **to[] = {&limits->low, &limits->high, &limits->turn, &limits->rounding};
    for (int i = 0; i < 4; i++) {
        if (!(*to[i] = dense(PyTuple_GET_ITEM(given, i), NPY_DOUBLE, n))) {
            return -1;
        }
    }
    if (!(limits->windings = dense(PyTuple_GET_ITEM(given, 4), NPY_INTP, n))) {
        return -1;
    }
    limits->count = PyArray_MultiplyList(limits->windings, (int)n);
    return 0;
}

/* windings(q, valid, limits) of the module: returns q and valid with one slot for each winding. */
static PyObject *windings(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *given_q, *given_valid, *given, *q, *valid;
    Slots slots;
    Limits limits;
    if (!PyArg_ParseTuple(args, "OOO!", &given_q, &given_valid, &PyTuple_Type, &given) ||
        read_slots(given_q, given_valid, &slots) < 0 || read_limits(given, slots.n, &limits) < 0) {
        return NULL;
    }
    npy_intp listed = 0;
    for (npy_intp j = 0; j < slots.n; j++) {
        listed += limits.windings[j];
    }
    double *value = PyMem_Malloc((size_t)listed * (sizeof *value + 1));
    q = value ? new_like(given_q, NPY_DOUBLE, 2, slots.k * limits.count, slots.n)
              : PyErr_NoMemory();
    valid = q ? new_like(given_q, NPY_BOOL, 1, slots.k * limits.count, 0) : NULL;
    for (npy_intp i = 0; valid && i < slots.poses * slots.k; valid = unless_stopped(valid, i++)) {
        npy_bool *inside = (npy_bool *)(value + listed), *to = PyArray_DATA((PyArrayObject *)valid);
        double *rows = PyArray_DATA((PyArrayObject *)q);
        write_turns(&limits, slots.n, slots.q + i * slots.n, value, inside);
        write_windings(&limits, slots.n, value + listed, inside + listed, slots.valid[i],
                       rows + i * limits.count * slots.n, to + i * limits.count);
    }
    PyMem_Free(value);
    if (!valid) {
        Py_XDECREF(q);
        return NULL;
    }
    return Py_BuildValue("NN", q, valid);
}

/* One seed for all poses or one seed for each pose, and the distance metric. */
typedef struct {
    const double *q;
    npy_intp step;
    const double *turn;
    double scale[MAX_JOINTS]; /* the weight of each displacement */
} Seeds;

/* Reads seeds (n,) or (..., n), then turns (n,) and units (n,). Returns -1 on error. */
static int read_seeds(PyObject *seed, PyObject *turn, PyObject *unit, const Slots *slots,
                      Seeds *seeds)
{
    const int one = PyArray_Check(seed) && PyArray_NDIM((PyArrayObject *)seed) == 1;
    seeds->step = one ? 0 : slots->n;
    seeds->q = dense(seed, NPY_DOUBLE, one ? slots->n : slots->poses * slots->n);
    seeds->turn = seeds->q ? dense(turn, NPY_DOUBLE, slots->n) : NULL;
    const double *units = seeds->turn ? dense(unit, NPY_DOUBLE, slots->n) : NULL;
    for (npy_intp j = 0; units && j < slots->n; j++) {
        seeds->scale[j] = 1 / units[j];
    }
    return units ? 0 : -1;
}

/* A solution and its rounded distance from the seed, infinite for an invalid solution. */
typedef struct {
    uint64_t distance;
    npy_intp slot;
} Ranked;

/* Returns a solution with its distance from the seed. If the distance is greater than `enough`, the
 * result may be a lower bound of the distance. */
static Ranked ranked(const Slots *slots, const Seeds *seeds, npy_intp pose, npy_intp slot,
                     uint64_t enough)
{
    const npy_intp row = pose * slots->k + slot;
    const double *q = slots->q + row * slots->n, *q_seed = seeds->q + pose * seeds->step;
    double largest = slots->valid[row] ? 0 : INFINITY;
    for (npy_intp j = 0; j < slots->n && chasles_rounded(largest) <= enough; j++) {
        const double move = chasles_move(q[j] - q_seed[j], seeds->turn[j]) * seeds->scale[j];
        largest = move <= largest ? largest : move;
    }
    return (Ranked){chasles_rounded(largest), slot};
}

static double sum_of_moves(const Slots *slots, const Seeds *seeds, npy_intp pose, npy_intp slot)
{
    return chasles_sum_of_moves((int)slots->n, seeds->q + pose * seeds->step,
                                slots->q + (pose * slots->k + slot) * slots->n, seeds->turn,
                                seeds->scale);
}

/* Tests whether two solution slots are windings of the same solution. */
static int differ_by_turns(npy_intp n, const double *a, const double *b)
{
    for (npy_intp j = 0; j < n; j++) {
        if (chasles_move(a[j] - b[j], TURN) > SAME_TURNS) {
            return 0;
        }
    }
    return 1;
}

/* Returns the slot of the nearest valid solution, otherwise -1; see chasles_distance.h. */
static npy_intp nearest_slot(const Slots *slots, const Seeds *seeds, npy_intp pose)
{
    const npy_intp n = slots->n;
    const double *q = slots->q + pose * slots->k * n;
    Ranked best = {chasles_rounded(INFINITY), -1};
    for (npy_intp slot = 0; slot < slots->k; slot++) {
        const Ranked own = ranked(slots, seeds, pose, slot, best.distance);
        if (own.distance < best.distance || (own.distance == best.distance && best.slot >= 0 &&
                                             differ_by_turns(n, q + best.slot * n, q + slot * n) &&
                                             sum_of_moves(slots, seeds, pose, slot) <
                                                 sum_of_moves(slots, seeds, pose, best.slot))) {
            best = own;
        }
    }
    return best.slot;
}

/* Reads q, valid, seed, turn and unit. Returns 0 on error. */
static int read_query(PyObject *args, PyObject **q, Slots *slots, Seeds *seeds)
{
    PyObject *valid, *seed, *turn, *unit;
    return PyArg_ParseTuple(args, "OOOOO", q, &valid, &seed, &turn, &unit) &&
           read_slots(*q, valid, slots) == 0 && read_seeds(seed, turn, unit, slots, seeds) == 0;
}

/* nearest(q, valid, seed, turn, unit): returns the nearest valid solutions (..., n), or NaN. */
static PyObject *nearest(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *q;
    Slots slots;
    Seeds seeds;
    if (!read_query(args, &q, &slots, &seeds)) {
        return NULL;
    }
    PyObject *found = new_like(q, NPY_DOUBLE, 1, slots.n, 0);
    for (npy_intp pose = 0; found && pose < slots.poses; found = unless_stopped(found, pose++)) {
        double *to = (double *)PyArray_DATA((PyArrayObject *)found) + pose * slots.n;
        const npy_intp best = nearest_slot(&slots, &seeds, pose);
        for (npy_intp j = 0; j < slots.n; j++) {
            to[j] = best < 0 ? NAN : slots.q[(pose * slots.k + best) * slots.n + j];
        }
    }
    return found;
}

/* Compares two solutions by distance, then by slot. */
static int compare_ranked(const void *left, const void *right)
{
    const Ranked *a = left, *b = right;
    const int by_distance = (a->distance > b->distance) - (a->distance < b->distance);
    return by_distance ? by_distance : (a->slot > b->slot) - (a->slot < b->slot);
}

/* order(q, valid, seed, turn, unit) of the module: indices (..., k), the nearest solution first. */
static PyObject *order(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *q;
    Slots slots;
    Seeds seeds;
    if (!read_query(args, &q, &slots, &seeds)) {
        return NULL;
    }
    Ranked *order_of = PyMem_Malloc((size_t)(slots.k + 1) * sizeof *order_of);
    PyObject *found = order_of ? new_like(q, NPY_INTP, 1, slots.k, 0) : PyErr_NoMemory();
    for (npy_intp pose = 0; found && pose < slots.poses; found = unless_stopped(found, pose++)) {
        npy_intp *to = (npy_intp *)PyArray_DATA((PyArrayObject *)found) + pose * slots.k;
        for (npy_intp slot = 0; slot < slots.k; slot++) {
            order_of[slot] = ranked(&slots, &seeds, pose, slot, UINT64_MAX);
        }
        qsort(order_of, (size_t)slots.k, sizeof *order_of, compare_ranked);
        for (npy_intp i = 0; i < slots.k; i++) {
            to[i] = order_of[i].slot;
        }
    }
    PyMem_Free(order_of);
    return found;
}

#define MAX_GROUPS 16

/* Tests whether two solutions are equal up to the tolerances. */
static int are_equal(npy_intp n, const double *a, const double *b, const double *turn,
                     const double *tolerance)
{
    for (npy_intp j = 0; j < n; j++) {
        if (!(chasles_move(a[j] - b[j], turn[j]) <= tolerance[j])) {
            return 0;
        }
    }
    return 1;
}

/* Marks the solutions of a pose that repeat an earlier valid solution as invalid. */
static void clear_repetitions(const Slots *slots, npy_intp pose, Cells *cells, const double *turn,
                              const double *tolerance, npy_bool *valid)
{
    const npy_intp n = slots->n;
    const double *q = slots->q + pose * slots->k * n;
    for (npy_intp i = 0; i < cells->size; i++) {
        cells->head[i] = -1;
    }
    for (npy_intp slot = 0; slot < slots->k; slot++) {
        if (!valid[slot]) {
            continue;
        }
        const double cell = cell_of(cells, n, q + slot * n);
        for (int step = -1; step <= 1 && valid[slot]; step++) {
            npy_intp other = cells->head[cell_at(cells, cell + step)];
            while (other >= 0 && !are_equal(n, q + other * n, q + slot * n, turn, tolerance)) {
                other = cells->next[other];
            }
            valid[slot] = other < 0;
        }
        if (valid[slot]) {
            const npy_intp at = cell_at(cells, cell);
            cells->next[slot] = cells->head[at];
            cells->head[at] = slot;
        }
    }
}

/* Tests whether all branches have different solutions. The slots of a branch differ only by full
 * turns. If there are more than MAX_GROUPS groups, the function compares nothing and
 * returns 0. */
static int are_groups_distinct(const Slots *slots, npy_intp pose, npy_intp group,
                               const double *whole, const double *tolerance)
{
    const npy_intp n = slots->n;
    npy_intp first[MAX_GROUPS], count = 0;
    if (slots->k > group * MAX_GROUPS) {
        return 0;
    }
    for (npy_intp from = 0; from < slots->k; from += group) {
        npy_intp slot = pose * slots->k + from, end = slot + group;
        while (slot < end && !slots->valid[slot]) {
            slot++;
        }
        if (slot == end) {
            continue;
        }
        for (npy_intp i = 0; i < count; i++) {
            if (are_equal(n, slots->q + first[i] * n, slots->q + slot * n, whole, tolerance)) {
                return 0;
            }
        }
        first[count++] = slot;
    }
    return 1;
}

/* distinct(q, valid, turn, tolerance, whole, group): marks the first of equal valid slots. */
static PyObject *distinct(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *q, *valid, *turn, *tolerance, *whole;
    Slots slots;
    Cells cells = {0};
    npy_intp group;
    if (!PyArg_ParseTuple(args, "OOOOOn", &q, &valid, &turn, &tolerance, &whole, &group) ||
        read_slots(q, valid, &slots) < 0) {
        return NULL;
    }
    const double *of_turn = dense(turn, NPY_DOUBLE, slots.n);
    const double *most = of_turn ? dense(tolerance, NPY_DOUBLE, slots.n) : NULL;
    const double *of_whole = most ? dense(whole, NPY_DOUBLE, slots.n) : NULL;
    PyObject *found = of_whole ? PyArray_NewCopy((PyArrayObject *)valid, NPY_CORDER) : NULL;
    for (npy_intp pose = 0; found && pose < slots.poses; found = unless_stopped(found, pose++)) {
        if (are_groups_distinct(&slots, pose, group, of_whole, most)) {
            continue;
        }
        if (!cells.head && cells_new(&cells, slots.k, slots.n, of_turn, most) < 0) {
            Py_CLEAR(found);
            break;
        }
        clear_repetitions(&slots, pose, &cells, of_turn, most,
                          (npy_bool *)PyArray_DATA((PyArrayObject *)found) + pose * slots.k);
    }
    PyMem_Free(cells.head);
    return found;
}

static PyMethodDef methods[] = {
    {"windings", windings, METH_VARARGS, "The slots at all turns within limits."},
    {"order", order, METH_VARARGS, "The order of the slots by their distances from a seed."},
    {"nearest", nearest, METH_VARARGS, "The valid slot nearest to a seed."},
    {"distinct", distinct, METH_VARARGS, "Which valid slots repeat no earlier one."},
    {NULL},
};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "chasles.closed_form._filters",
    .m_doc = "The loops of the filters of Solutions.",
    .m_size = -1,
    .m_methods = methods,
};

PyMODINIT_FUNC PyInit__filters(void)
{
    import_array();
    return PyModule_Create(&definition);
}
