/* The module chasles.call._call, which calls compiled functions from Python. The code in the folder
 * kernel/ opens libraries, runs their kernels, and manages the memory of large results. The folder
 * function/ defines the Python type Function. */
#define IMPORT_NUMPY
#include "call/function/function.h"
#include "call/function/nearest.h"
#include "call/function/nearest_rows.h"
#include "call/kernel/compiled_library.h"
#include "call/kernel/buffer_pool.h"
#include "call/kernel/python_api.h"
#include "numerics/_rigid.h"

PyObject *ShapeError, *InputError, *MismatchError;
PyObject *str_out, *str_threads, *str_fixed, *str_name, *str_shape, *str_array_ufunc;
PyObject *ndarray_array_ufunc;

static PyMethodDef library_methods[] = {
    {"function", (PyCFunction)(void (*)(void))function_new, METH_VARARGS | METH_KEYWORDS,
     "The function with this name; inputs and outputs describe it and must agree with the C."},
    {NULL},
};

/* Returns the maximum residuals (N,) for matrices (N, 4, 4), nonzero only for rounded poses. */
static PyObject *rounded_residuals(PyObject *Py_UNUSED(module), PyObject *matrices)
{
    PyObject *poses = PyArray_FROMANY(matrices, NPY_DOUBLE, 3, 3, NPY_ARRAY_IN_ARRAY);
    if (!poses) {
        return NULL;
    }
    npy_intp count = PyArray_DIM((PyArrayObject *)poses, 0);
    PyObject *found = PyArray_SimpleNew(1, &count, NPY_DOUBLE);
    if (found) {
        const double *T = PyArray_DATA((PyArrayObject *)poses);
        double *residual = PyArray_DATA((PyArrayObject *)found);
        for (npy_intp k = 0; k < count; k++, T += 16) {
            Rigidity kind = rigidity(T);
            residual[k] = kind == NEAR_RIGID ? reached_by_rounding(T)
                          : kind == RIGID    ? placed_by_rounding(T)
                                             : 0;
        }
    }
    Py_DECREF(poses);
    return found;
}

static PyMethodDef module_methods[] = {
    {"rounded_residuals", rounded_residuals, METH_O,
     "rounded_residuals(T): the residuals (N,) up to which solutions reach matrices (N, 4, 4) "
     "that\n"
     "rounding has moved."},
    {"nearest_rows", nearest_rows, METH_VARARGS,
     "nearest_rows(inverse, inputs, q_seed, moves, results): writes the nearest solutions for "
     "dense\n"
     "rows of inputs to results, (q, residual, margin, slot)."},
    {"nearest_of_slots", nearest_of_slots, METH_VARARGS,
     "nearest_of_slots(inverse, slots, q_seed, moves, results): writes the nearest of slots\n"
     "(q, residual, margin) to results, (q, residual, margin, slot)."},
    {"open", library_open, METH_VARARGS,
     "open(path, expected_hash): the library; refused unless it was compiled for that hash."},
    {"release_memory", release_memory, METH_NOARGS,
     "release_memory(): releases the memory that chasles keeps for large results, and returns its\n"
     "size in bytes. chasles keeps up to 256 MB from calls with results of at least 32 MB."},
    {NULL},
};

static struct PyModuleDef module_definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "chasles.call._call",
    .m_doc = "Calls compiled functions on NumPy arrays.",
    .m_size = -1,
    .m_methods = module_methods,
};

/* Imports the exceptions and interns the names. Returns -1 on error. */
static int import_names(void)
{
    PyObject *errors = PyImport_ImportModule("chasles.errors");
    if (!errors) {
        return -1;
    }
    ShapeError = PyObject_GetAttrString(errors, "ShapeError");
    InputError = PyObject_GetAttrString(errors, "InputTypeError");
    MismatchError = PyObject_GetAttrString(errors, "MismatchError");
    Py_DECREF(errors);
    str_out = PyUnicode_InternFromString("out");
    str_threads = PyUnicode_InternFromString("threads");
    str_fixed = PyUnicode_InternFromString("fixed");
    str_name = PyUnicode_InternFromString("name");
    str_shape = PyUnicode_InternFromString("shape");
    str_array_ufunc = PyUnicode_InternFromString("__array_ufunc__");
    if (!ShapeError || !InputError || !MismatchError || !str_out || !str_threads || !str_fixed ||
        !str_name || !str_shape || !str_array_ufunc) {
        return -1;
    }
    ndarray_array_ufunc = PyObject_GetAttr((PyObject *)&PyArray_Type, str_array_ufunc);
    return ndarray_array_ufunc ? 0 : -1;
}

PyMODINIT_FUNC PyInit__call(void)
{
    import_array();
    import_umath();
    LibraryType.tp_methods = library_methods;
    if (buffer_pool_init() < 0 || import_names() < 0 || PyType_Ready(&LibraryType) < 0 ||
        PyType_Ready(&FunctionType) < 0 || PyType_Ready(&NearestType) < 0) {
        return NULL;
    }
    PyObject *module = PyModule_Create(&module_definition);
    PyObject *nearly_rigid = PyFloat_FromDouble(NEARLY_RIGID);
    PyObject *rigid = PyFloat_FromDouble(RIGID_TO_ROUNDING);
    if (module && (PyModule_AddObjectRef(module, "Library", (PyObject *)&LibraryType) < 0 ||
                   PyModule_AddObjectRef(module, "Function", (PyObject *)&FunctionType) < 0 ||
                   PyModule_AddObjectRef(module, "Nearest", (PyObject *)&NearestType) < 0 ||
                   PyModule_AddObjectRef(module, "NEARLY_RIGID", nearly_rigid) < 0 ||
                   PyModule_AddObjectRef(module, "RIGID_TO_ROUNDING", rigid) < 0)) {
        Py_CLEAR(module);
    }
    Py_XDECREF(nearly_rigid);
    Py_XDECREF(rigid);
    return module;
}
