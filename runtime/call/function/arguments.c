#include "call/function/arguments.h"

#include <string.h>

/* Returns the name of an argument (an input, out, threads, fixed), or NULL if it has no keyword. */
static PyObject *slot_name(const Kernel *kernel, int takes_fixed, int slot)
{
    if (slot < kernel->n_inputs) {
        return slot && takes_fixed ? NULL : kernel->operands[slot].name;
    }
    PyObject *options[] = {str_out, str_threads, takes_fixed ? str_fixed : NULL};
    return options[slot - kernel->n_inputs];
}

static int set_count_error(const Kernel *kernel, int takes_fixed, Py_ssize_t n_given)
{
    int wanted = takes_fixed ? 1 : kernel->n_inputs;
    PyObject *names = PyUnicode_FromString("");
    for (int i = 0; names && i < wanted; i++) {
        Py_SETREF(names,
                  PyUnicode_FromFormat("%U%s%U", names, i ? ", " : "", kernel->operands[i].name));
    }
    if (names) {
        PyErr_Format(InputError, "%U: takes %d input%s (%U), got %zd%s", kernel->label, wanted,
                     wanted == 1 ? "" : "s", names, n_given,
                     takes_fixed && n_given > 1 ? "; fixed= takes the values of joints by name"
                                                : "");
        Py_DECREF(names);
    }
    return -1;
}

/* Sets the error for an unknown keyword, with a hint. Returns -1. */
static int set_keyword_error(const Kernel *kernel, int takes_fixed, PyObject *keyword)
{
    PyObject *names = PyList_New(0), *hints = PyImport_ImportModule("chasles.call.hints");
    for (int i = 0; names && hints && i < kernel->n_inputs + N_OPTIONS; i++) {
        PyObject *name = slot_name(kernel, takes_fixed, i);
        if (name && PyList_Append(names, name) < 0) {
            Py_CLEAR(names);
        }
    }
    PyObject *text = names && hints ? PyObject_CallMethod(hints, "unknown_keyword", "OOO",
                                                          kernel->label, keyword, names)
                                    : NULL;
    if (text) {
        PyErr_SetObject(InputError, text);
    }
    Py_XDECREF(text);
    Py_XDECREF(names);
    Py_XDECREF(hints);
    return -1;
}

/* Returns the argument index of a keyword, or -1 on error. */
static int find_keyword(const Kernel *kernel, int takes_fixed, PyObject *keyword)
{
    for (int i = 0; i < kernel->n_inputs + N_OPTIONS; i++) {
        PyObject *name = slot_name(kernel, takes_fixed, i);
        int equal = name ? PyObject_RichCompareBool(keyword, name, Py_EQ) : 0;
        if (equal != 0) {
            return equal < 0 ? -1 : i;
        }
    }
    return set_keyword_error(kernel, takes_fixed, keyword);
}

int bind_arguments(const Kernel *kernel, int takes_fixed, PyObject *const *args, Py_ssize_t n_args,
                   PyObject *keywords, PyObject **slots)
{
    Py_ssize_t n_keywords = keywords ? PyTuple_GET_SIZE(keywords) : 0, n_given = n_args;
    int wanted = takes_fixed ? 1 : kernel->n_inputs;
    if (n_args > wanted) {
        return set_count_error(kernel, takes_fixed, n_args);
    }
    memcpy(slots, args, n_args * sizeof(PyObject *));
    memset(slots + n_args, 0, (kernel->n_inputs + N_OPTIONS - n_args) * sizeof(PyObject *));
    for (Py_ssize_t k = 0; k < n_keywords; k++) {
        int slot = find_keyword(kernel, takes_fixed, PyTuple_GET_ITEM(keywords, k));
        if (slot < 0) {
            return -1;
        }
        if (slots[slot]) {
            PyErr_Format(InputError, "%U: %U is given twice", kernel->label,
                         PyTuple_GET_ITEM(keywords, k));
            return -1;
        }
        slots[slot] = args[n_args + k];
        n_given += slot < kernel->n_inputs;
    }
    return n_given == wanted ? 0 : set_count_error(kernel, takes_fixed, n_given);
}

int spread_fixed(const Kernel *kernel, PyObject *parameters, PyObject *fixed, PyObject **slots)
{
    int n_more = kernel->n_inputs - 1, is_tuple = fixed && PyTuple_CheckExact(fixed);
    if (is_tuple ? PyTuple_GET_SIZE(fixed) != n_more
                 : !fixed || !PyDict_CheckExact(fixed) || PyDict_GET_SIZE(fixed) != n_more ||
                       PyTuple_GET_SIZE(parameters) != n_more) {
        return 0;
    }
    for (int i = 0; i < n_more; i++) {
        PyObject *value = is_tuple
                              ? PyTuple_GET_ITEM(fixed, i)
                              : PyDict_GetItemWithError(fixed, PyTuple_GET_ITEM(parameters, i));
        if (!value) {
            while (i-- > 0) {
                Py_DECREF(slots[1 + i]);
            }
            return PyErr_Occurred() ? -1 : 0;
        }
        slots[1 + i] = Py_NewRef(value);
    }
    return 1;
}

int read_out(const Kernel *kernel, PyObject **out, PyObject *const **outs)
{
    *outs = NULL;
    if (!*out || *out == Py_None) {
        return 0;
    }
    if (PyTuple_CheckExact(*out)) {
        if (PyTuple_GET_SIZE(*out) == kernel->n_outputs) {
            *outs = ((PyTupleObject *)*out)->ob_item;
            return 0;
        }
    } else if (kernel->n_outputs == 1) {
        *outs = out;
        return 0;
    }
    PyErr_Format(InputError, "%U: out must be %s of %d, one for each output", kernel->label,
                 kernel->n_outputs == 1 ? "an array, or a tuple" : "a tuple", kernel->n_outputs);
    return -1;
}

long read_threads(const Kernel *kernel, PyObject *given)
{
    if (!given || given == Py_None) {
        return 1;
    }
    if (PyUnicode_Check(given) && PyUnicode_CompareWithASCIIString(given, "all") == 0) {
        return ALL_THREADS;
    }
    if (PyIndex_Check(given) && !PyBool_Check(given)) {
        Py_ssize_t threads = PyNumber_AsSsize_t(given, NULL); /* NULL: clips */
        if (threads >= 1) {
            return threads;
        }
        if (PyErr_Occurred()) {
            if (!PyErr_ExceptionMatches(PyExc_TypeError)) {
                return -1;
            }
            PyErr_Clear(); /* Reports an argument that is an array of several integers. */
        }
    }
    PyErr_Format(InputError, "%U: threads must be a positive integer or 'all', got %R",
                 kernel->label, given);
    return -1;
}

int has_override(PyObject *object)
{
    if (PyArray_CheckExact(object) || PyList_CheckExact(object) || PyTuple_CheckExact(object) ||
        PyFloat_CheckExact(object) || PyLong_CheckExact(object) ||
        PyArray_IsScalar(object, Generic)) {
        return 0;
    }
    PyObject *method = PyObject_GetAttr((PyObject *)Py_TYPE(object), str_array_ufunc);
    if (!method) {
        if (!PyErr_ExceptionMatches(PyExc_AttributeError)) {
            return -1;
        }
        PyErr_Clear();
        return 0;
    }
    int own = method != ndarray_array_ufunc;
    Py_DECREF(method);
    return own;
}

/* Returns a shape as "6" or "4 x 4", for messages. */
static PyObject *sizes_text(int ndim, const npy_intp *dims, const char *between)
{
    PyObject *text = PyUnicode_FromString("");
    for (int i = 0; text && i < ndim; i++) {
        Py_SETREF(text,
                  PyUnicode_FromFormat("%U%s%zd", text, i ? between : "", (Py_ssize_t)dims[i]));
    }
    return text;
}

/* Returns "(5,)" or "(2, 6)": the shape as Python prints it. */
static PyObject *shape_text(int ndim, const npy_intp *dims)
{
    PyObject *shape = PyArray_IntTupleFromIntp(ndim, dims);
    PyObject *text = shape ? PyObject_Repr(shape) : NULL;
    Py_XDECREF(shape);
    return text;
}

/* Tests whether the last dimensions of an input array match the operand. Returns -1 on error. */
static int check_core_shape(const Kernel *kernel, const Operand *operand, PyArrayObject *array)
{
    int extra = PyArray_NDIM(array) - operand->ndim;
    int agree = extra >= 0;
    for (int i = 0; agree && i < operand->ndim; i++) {
        agree = PyArray_DIM(array, extra + i) == operand->dims[i];
    }
    if (agree) {
        return 0;
    }
    PyObject *values = sizes_text(operand->ndim, operand->dims, " x ");
    PyObject *core = sizes_text(operand->ndim, operand->dims, ", ");
    PyObject *got = shape_text(PyArray_NDIM(array), PyArray_DIMS(array));
    if (values && core && got) {
        PyErr_Format(ShapeError, "%U: %U must end in %U value%s (shape (..., %U)), got shape %U",
                     kernel->label, operand->name, values, operand->size == 1 ? "" : "s", core,
                     got);
    }
    Py_XDECREF(values);
    Py_XDECREF(core);
    Py_XDECREF(got);
    return -1;
}

/* Replaces a NumPy error with an InputError that names the argument and has the NumPy error as its
 * cause. */
static void set_input_error(const Kernel *kernel, const Operand *operand)
{
    if (!PyErr_ExceptionMatches(PyExc_ValueError) && !PyErr_ExceptionMatches(PyExc_TypeError)) {
        return;
    }
    PyObject *type, *cause, *traceback;
    PyErr_Fetch(&type, &cause, &traceback);
    PyErr_NormalizeException(&type, &cause, &traceback);
    PyErr_Format(InputError, "%U: %U cannot be read as an array of numbers: %S", kernel->label,
                 operand->name, cause);
    PyObject *type2, *error, *traceback2;
    PyErr_Fetch(&type2, &error, &traceback2);
    PyErr_NormalizeException(&type2, &error, &traceback2);
    PyException_SetCause(error, cause); /* steals cause */
    PyErr_Restore(type2, error, traceback2);
    Py_XDECREF(type);
    Py_XDECREF(traceback);
}

PyObject *read_input(const Kernel *kernel, const Operand *operand, PyObject *object)
{
    PyArrayObject *array =
        (PyArrayObject *)PyArray_FromAny(object, NULL, 0, 0, NPY_ARRAY_ENSUREARRAY, NULL);
    if (!array) {
        set_input_error(kernel, operand);
        return NULL;
    }
    /* The type is tested first, because the conversion would accept "1", True and 1j. */
    if (!PyTypeNum_ISINTEGER(PyArray_TYPE(array)) && !PyTypeNum_ISFLOAT(PyArray_TYPE(array))) {
        PyErr_Format(InputError, "%U: %U must hold real numbers, got dtype %S", kernel->label,
                     operand->name, PyArray_DESCR(array));
        Py_DECREF(array);
        return NULL;
    }
    if (check_core_shape(kernel, operand, array) < 0) {
        Py_DECREF(array);
        return NULL;
    }
    PyObject *result =
        PyArray_FromArray(array, PyArray_DescrFromType(NPY_DOUBLE),
                          NPY_ARRAY_ALIGNED | NPY_ARRAY_NOTSWAPPED | NPY_ARRAY_FORCECAST);
    Py_DECREF(array);
    return result;
}

/* Tests whether leading dimensions broadcast with the leading dimensions of earlier inputs. Returns
 * -1 on error. */
static int check_leading(const Kernel *kernel, const Operand *operand, PyArrayObject *array,
                         const LeadingShape *batch)
{
    int ndim = PyArray_NDIM(array) - operand->ndim;
    for (int i = 1; i <= ndim && i <= batch->ndim; i++) {
        npy_intp own = PyArray_DIM(array, ndim - i), other = batch->dims[batch->ndim - i];
        if (own != other && own != 1 && other != 1) {
            PyObject *shape = shape_text(ndim, PyArray_DIMS(array));
            PyObject *before = shape_text(batch->ndim, batch->dims);
            if (shape && before) {
                PyErr_Format(
                    ShapeError,
                    "%U: leading dimensions do not broadcast: %U has %U, the inputs before "
                    "it have %U",
                    kernel->label, operand->name, shape, before);
            }
            Py_XDECREF(shape);
            Py_XDECREF(before);
            return -1;
        }
    }
    return 0;
}

int broadcast_inputs(const Kernel *kernel, PyObject *const *inputs, LeadingShape *batch)
{
    batch->ndim = 0;
    for (int i = 0; i < kernel->n_inputs; i++) {
        PyArrayObject *array = (PyArrayObject *)inputs[i];
        if (check_leading(kernel, &kernel->operands[i], array, batch) < 0) {
            return -1;
        }
        int ndim = PyArray_NDIM(array) - kernel->operands[i].ndim;
        if (ndim > batch->ndim) {
            int more = ndim - batch->ndim;
            memmove(batch->dims + more, batch->dims, batch->ndim * sizeof(npy_intp));
            for (int j = 0; j < more; j++) {
                batch->dims[j] = 1;
            }
            batch->ndim = ndim;
        }
        npy_intp *dims = batch->dims + (batch->ndim - ndim);
        for (int j = 0; j < ndim; j++) {
            dims[j] = dims[j] == 1 ? PyArray_DIM(array, j) : dims[j];
        }
    }
    return 0;
}

int check_out(const Kernel *kernel, const Operand *operand, const LeadingShape *batch,
              PyObject *object)
{
    if (!PyArray_Check(object)) {
        PyErr_Format(InputError, "%U: out for %U must be a NumPy array, got %s", kernel->label,
                     operand->name, Py_TYPE(object)->tp_name);
        return -1;
    }
    PyArrayObject *out = (PyArrayObject *)object;
    if (PyArray_TYPE(out) != NPY_DOUBLE || !PyArray_ISNOTSWAPPED(out)) {
        PyErr_Format(InputError, "%U: out for %U must have dtype float64, got %S", kernel->label,
                     operand->name, PyArray_DESCR(out));
        return -1;
    }
    if (!PyArray_ISWRITEABLE(out)) {
        PyErr_Format(InputError, "%U: out for %U is read-only", kernel->label, operand->name);
        return -1;
    }
    npy_intp dims[NPY_MAXDIMS + MAX_CORE_NDIM];
    int ndim = batch->ndim + operand->ndim;
    memcpy(dims, batch->dims, batch->ndim * sizeof(npy_intp));
    memcpy(dims + batch->ndim, operand->dims, operand->ndim * sizeof(npy_intp));
    if (ndim == PyArray_NDIM(out) && PyArray_CompareLists(dims, PyArray_DIMS(out), ndim)) {
        return 0;
    }
    PyObject *expected = shape_text(ndim, dims);
    PyObject *got = shape_text(PyArray_NDIM(out), PyArray_DIMS(out));
    if (expected && got) {
        PyErr_Format(ShapeError, "%U: out for %U must have shape %U, got shape %U", kernel->label,
                     operand->name, expected, got);
    }
    Py_XDECREF(expected);
    Py_XDECREF(got);
    return -1;
}
