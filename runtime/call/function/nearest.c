#include "call/function/nearest.h"

#include <string.h>
#include <structmember.h>

#include <numpy/arrayscalars.h>

#include "call/function/nearest_rows.h"

#define MAX_PARAMETERS 8
#define N_FIELDS 4

enum { FIELD_Q, FIELD_RESIDUAL, FIELD_MARGIN, FIELD_VALID };

typedef struct {
    PyObject_HEAD
    vectorcallfunc vectorcall;
    PyObject *inverse;    /* a Function */
    PyObject *general;    /* the Python function for calls that C does not handle */
    PyTypeObject *result; /* the class of the results, a subclass of tuple */
    PyObject *moves;      /* a tuple of four arrays, for calls without options */
    PyObject *parameters; /* redundancy parameters: their indices in the seed, or a Function */
    PyObject *name, *doc, *signature, *reduced;
    const double *by[N_MOVES];
    int is_fast; /* whether C handles calls without options */
} Nearest;

/* Writes the values of the redundancy parameters at a seed. The inverse kinematics function takes
 * these values as inputs after the pose. */
static void write_parameters(const Nearest *self, const double *q_seed, double *values)
{
    if (PyTuple_CheckExact(self->parameters)) {
        for (Py_ssize_t i = 0; i < PyTuple_GET_SIZE(self->parameters); i++) {
            values[i] = q_seed[PyLong_AsLong(PyTuple_GET_ITEM(self->parameters, i))];
        }
    } else {
        const Kernel *kernel = ((const Function *)self->parameters)->kernel;
        kernel->call(&q_seed, &values);
    }
}

static PyObject *pack_nearest(const Nearest *self, PyObject *q, const double *residual_and_margin,
                              int slot)
{
    PyObject *residual = PyArrayScalar_New(Double), *margin = PyArrayScalar_New(Double);
    PyObject *result = self->result->tp_alloc(self->result, N_FIELDS);
    if (!residual || !margin || !result) {
        Py_XDECREF(residual);
        Py_XDECREF(margin);
        Py_XDECREF(result);
        Py_DECREF(q);
        return NULL;
    }
    PyArrayScalar_ASSIGN(residual, Double, residual_and_margin[0]);
    PyArrayScalar_ASSIGN(margin, Double, residual_and_margin[1]);
    PyTuple_SET_ITEM(result, FIELD_Q, q);
    PyTuple_SET_ITEM(result, FIELD_RESIDUAL, residual);
    PyTuple_SET_ITEM(result, FIELD_MARGIN, margin);
    PyTuple_SET_ITEM(result, FIELD_VALID,
                     Py_NewRef(slot >= 0 ? PyArrayScalar_True : PyArrayScalar_False));
    return result;
}

static PyObject *nearest_single(const Nearest *self, PyObject *const *args)
{
    const Function *inverse = (const Function *)self->inverse;
    const Kernel *kernel = inverse->kernel;
    npy_intp n = coordinates_of(kernel);
    const double *q_seed = PyArray_DATA((PyArrayObject *)args[1]);
    double parameters[MAX_PARAMETERS], found[2];
    PyObject *q = PyArray_SimpleNew(1, &n, NPY_DOUBLE);
    if (!q) {
        return NULL;
    }
    npy_int8 slot;
    Rows rows = {.inputs = {PyArray_DATA((PyArrayObject *)args[0])},
                 .q_seed = q_seed,
                 .results = {PyArray_DATA((PyArrayObject *)q), found, found + 1},
                 .slot = &slot};
    memcpy(rows.moves, self->by, sizeof rows.moves);
    if (kernel->n_inputs > 1) {
        write_parameters(self, q_seed, parameters);
        for (int i = 1; i < kernel->n_inputs; i++) {
            rows.inputs[i] = &parameters[i - 1];
        }
    }
    run_nearest(inverse, 1, &rows);
    if (slot < 0 && is_unsettled(inverse, slot, found[0])) {
        Py_DECREF(q);
        return PyObject_Vectorcall(self->general, args, 2, NULL);
    }
    return pack_nearest(self, q, found, slot);
}

/* Solves a dense batch of poses, with one seed or a seed for each pose. Returns NULL on error. */
static PyObject *nearest_batch(const Nearest *self, PyObject *const *args, ptrdiff_t seed_step)
{
    const Function *inverse = (const Function *)self->inverse;
    PyArrayObject *T = (PyArrayObject *)args[0];
    const int ndim = PyArray_NDIM(T) - inverse->kernel->operands[0].ndim;
    npy_intp dims[NPY_MAXDIMS + 1], n = PyArray_MultiplyList(PyArray_DIMS(T), ndim);
    PyObject *fields[N_FIELDS], *result = NULL;
    int unsettled = 0;
    memcpy(dims, PyArray_DIMS(T), ndim * sizeof(npy_intp));
    dims[ndim] = coordinates_of(inverse->kernel);
    for (int i = 0; i < N_FIELDS; i++) {
        fields[i] = PyArray_SimpleNew(ndim + (i == FIELD_Q), dims,
                                      i == FIELD_VALID ? NPY_BOOL : NPY_DOUBLE);
    }
    if (fields[0] && fields[1] && fields[2] && fields[3]) {
        npy_bool *valid = PyArray_DATA((PyArrayObject *)fields[FIELD_VALID]);
        const double *residual = PyArray_DATA((PyArrayObject *)fields[FIELD_RESIDUAL]);
        Rows rows = {.inputs = {PyArray_DATA(T)},
                     .steps = {inverse->kernel->operands[0].size},
                     .q_seed = PyArray_DATA((PyArrayObject *)args[1]),
                     .seed_step = seed_step,
                     .slot = (npy_int8 *)valid};
        memcpy(rows.moves, self->by, sizeof rows.moves);
        for (int i = 0; i < 3; i++) {
            rows.results[i] = PyArray_DATA((PyArrayObject *)fields[i]);
        }
        NPY_BEGIN_THREADS_DEF
        NPY_BEGIN_THREADS_THRESHOLDED(n)
        run_nearest(inverse, n, &rows);
        for (npy_intp i = 0; i < n; i++) {
            unsettled |= is_unsettled(inverse, rows.slot[i], residual[i]);
            valid[i] = rows.slot[i] >= 0;
        }
        NPY_END_THREADS
        result = unsettled ? PyObject_Vectorcall(self->general, args, 2, NULL)
                           : self->result->tp_alloc(self->result, N_FIELDS);
    }
    for (int i = 0; i < N_FIELDS; i++) {
        if (result && !unsettled) {
            PyTuple_SET_ITEM(result, i, fields[i]);
        } else {
            Py_XDECREF(fields[i]);
        }
    }
    return result;
}

static int is_dense_batch(PyObject *object, const Operand *operand)
{
    if (!PyArray_CheckExact(object)) {
        return 0;
    }
    PyArrayObject *array = (PyArrayObject *)object;
    const int leading = PyArray_NDIM(array) - operand->ndim;
    return PyArray_TYPE(array) == NPY_DOUBLE && PyArray_ISCARRAY_RO(array) && leading > 0 &&
           PyArray_CompareLists(PyArray_DIMS(array) + leading, operand->dims, operand->ndim);
}

static PyObject *nearest_vectorcall(PyObject *object, PyObject *const *args, size_t n_flagged,
                                    PyObject *keywords)
{
    const Nearest *self = (const Nearest *)object;
    if (keywords || PyVectorcall_NARGS(n_flagged) != 2 || !self->is_fast) {
        return PyObject_Vectorcall(self->general, args, n_flagged, keywords);
    }
    const Kernel *kernel = ((const Function *)self->inverse)->kernel;
    const npy_intp n = coordinates_of(kernel);
    const Operand seed = {.ndim = 1, .dims = {n}, .size = n};
    const int one_seed = is_core_array(args[1], &seed);
    if (one_seed && is_core_array(args[0], &kernel->operands[0])) {
        return nearest_single(self, args);
    }
    if (kernel->n_inputs == 1 && is_dense_batch(args[0], &kernel->operands[0])) {
        if (one_seed) {
            return nearest_batch(self, args, 0);
        }
        PyArrayObject *T = (PyArrayObject *)args[0], *seeds = (PyArrayObject *)args[1];
        if (is_dense_batch(args[1], &seed) && PyArray_NDIM(seeds) == PyArray_NDIM(T) - 1 &&
            PyArray_CompareLists(PyArray_DIMS(seeds), PyArray_DIMS(T), PyArray_NDIM(T) - 2)) {
            return nearest_batch(self, args, n);
        }
    }
    return PyObject_Vectorcall(self->general, args, n_flagged, keywords);
}

/* Members of Nearest that hold references to Python objects. */
static const size_t OWNED[] = {
    offsetof(Nearest, inverse), offsetof(Nearest, general),    offsetof(Nearest, result),
    offsetof(Nearest, moves),   offsetof(Nearest, parameters), offsetof(Nearest, name),
    offsetof(Nearest, doc),     offsetof(Nearest, signature),  offsetof(Nearest, reduced)};

static int nearest_traverse(Nearest *self, visitproc visit, void *arg)
{
    for (size_t i = 0; i < sizeof OWNED / sizeof *OWNED; i++) {
        Py_VISIT(*(PyObject **)((char *)self + OWNED[i]));
    }
    return 0;
}

static void nearest_dealloc(Nearest *self)
{
    PyObject_GC_UnTrack(self);
    for (size_t i = 0; i < sizeof OWNED / sizeof *OWNED; i++) {
        Py_XDECREF(*(PyObject **)((char *)self + OWNED[i]));
    }
    Py_TYPE(self)->tp_free((PyObject *)self);
}

static PyObject *nearest_repr(Nearest *self)
{
    return PyUnicode_FromFormat("<chasles function %U%S>", self->name, self->signature);
}

static PyObject *nearest_reduce(Nearest *self, PyObject *Py_UNUSED(ignored))
{
    return Py_NewRef(self->reduced);
}

/* Tests whether the redundancy parameters can be computed from a seed. */
static int parameters_fit(const Nearest *self)
{
    const Kernel *kernel = ((const Function *)self->inverse)->kernel;
    const int needed = kernel->n_inputs - 1;
    if (PyTuple_CheckExact(self->parameters)) {
        for (Py_ssize_t i = 0; i < PyTuple_GET_SIZE(self->parameters); i++) {
            long index = PyLong_AsLong(PyTuple_GET_ITEM(self->parameters, i));
            if (index < 0 || index >= coordinates_of(kernel)) {
                PyErr_Clear();
                return 0;
            }
        }
        return PyTuple_GET_SIZE(self->parameters) == needed && needed <= MAX_PARAMETERS;
    }
    if (!PyObject_TypeCheck(self->parameters, &FunctionType) || needed != 1) {
        return 0;
    }
    const Kernel *of_seed = ((const Function *)self->parameters)->kernel;
    return of_seed->n_inputs == 1 && of_seed->n_outputs == 1 && of_seed->operands[1].size == 1 &&
           of_seed->operands[0].size == coordinates_of(kernel);
}

static PyObject *nearest_new(PyTypeObject *type, PyObject *args, PyObject *kwargs)
{
    static char *keywords[] = {"inverse", "general", "result",    "moves",   "parameters",
                               "name",    "doc",     "signature", "reduced", NULL};
    PyObject *inverse, *general, *result, *moves, *parameters, *name, *doc, *signature, *reduced;
    if (!PyArg_ParseTupleAndKeywords(args, kwargs, "O!OO!O!OUUOO!:Nearest", keywords, &FunctionType,
                                     &inverse, &general, &PyType_Type, &result, &PyTuple_Type,
                                     &moves, &parameters, &name, &doc, &signature, &PyTuple_Type,
                                     &reduced)) {
        return NULL;
    }
    if (!((const Function *)inverse)->solutions || PyTuple_GET_SIZE(moves) != N_MOVES ||
        !PyType_IsSubtype((PyTypeObject *)result, &PyTuple_Type)) {
        PyErr_Format(PyExc_TypeError, "%U: expected an inverse, four moves and a named tuple",
                     name);
        return NULL;
    }
    Nearest *self = (Nearest *)type->tp_alloc(type, 0);
    if (!self) {
        return NULL;
    }
    self->vectorcall = nearest_vectorcall;
    self->inverse = Py_NewRef(inverse);
    self->general = Py_NewRef(general);
    self->result = (PyTypeObject *)Py_NewRef(result);
    self->moves = Py_NewRef(moves);
    self->parameters = Py_NewRef(parameters);
    self->name = Py_NewRef(name);
    self->doc = Py_NewRef(doc);
    self->signature = Py_NewRef(signature);
    self->reduced = Py_NewRef(reduced);
    const Function *function = (const Function *)inverse;
    if (read_moves(moves, coordinates_of(function->kernel), self->by) < 0) {
        Py_DECREF(self);
        return NULL;
    }
    self->is_fast = can_select(function) && parameters_fit(self);
    return (PyObject *)self;
}

static PyMemberDef nearest_members[] = {
    {"__name__", T_OBJECT_EX, offsetof(Nearest, name), READONLY, NULL},
    {"__qualname__", T_OBJECT_EX, offsetof(Nearest, name), READONLY, NULL},
    {"__doc__", T_OBJECT_EX, offsetof(Nearest, doc), READONLY, NULL},
    {"__signature__", T_OBJECT_EX, offsetof(Nearest, signature), READONLY, NULL},
    {NULL},
};

static PyMethodDef nearest_methods[] = {
    {"__reduce__", (PyCFunction)nearest_reduce, METH_NOARGS, NULL},
    {NULL},
};

PyTypeObject NearestType = {
    PyVarObject_HEAD_INIT(NULL, 0).tp_name = "chasles.call._call.Nearest",
    .tp_doc = "The nearest solution of a robot's inverse; see its own help.",
    .tp_basicsize = sizeof(Nearest),
    .tp_flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC | Py_TPFLAGS_HAVE_VECTORCALL,
    .tp_vectorcall_offset = offsetof(Nearest, vectorcall),
    .tp_call = PyVectorcall_Call,
    .tp_new = nearest_new,
    .tp_dealloc = (destructor)nearest_dealloc,
    .tp_traverse = (traverseproc)nearest_traverse,
    .tp_repr = (reprfunc)nearest_repr,
    .tp_members = nearest_members,
    .tp_methods = nearest_methods,
};
