/* The module chasles.velocity._rates: the generalized ufuncs bounds, solve and gradient
 * (rate_loops.h). DAMPING_THRESHOLD is the default singular value below which joint_rates damps. */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <numpy/arrayobject.h>
#include <numpy/ufuncobject.h>

#include "numerics/_tolerances.h"
#include "velocity/native/rate_loops.h"

#define D NPY_DOUBLE
static const char solve_types[] = {D, D, D, D, D, D, D, D, NPY_INTP, D, D, D, D, D, D, NPY_BOOL};
static const char bounds_types[] = {D, D, D, D, D, D, D, D, D};
static const char gradient_types[] = {D, D, D, D, NPY_INTP, D, D};

static PyUFuncGenericFunction solve_loops[] = {solve_loop};
static PyUFuncGenericFunction bounds_loops[] = {bounds_loop};
static PyUFuncGenericFunction gradient_loops[] = {gradient_loop};
static void *const no_data[] = {NULL};

static int add(PyObject *module, PyUFuncGenericFunction *loops, const char *types, int inputs,
               int outputs, const char *name, const char *doc, const char *signature)
{
    PyObject *ufunc = PyUFunc_FromFuncAndDataAndSignature(loops, no_data, types, 1, inputs, outputs,
                                                          PyUFunc_None, name, doc, 0, signature);
    int failed = ufunc ? PyModule_AddObjectRef(module, name, ufunc) : -1;
    Py_XDECREF(ufunc);
    return failed;
}

static struct PyModuleDef module_definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "chasles.velocity._rates",
    .m_doc = "Joint rates of a twist within limits, as generalized ufuncs.",
    .m_size = -1,
};

PyMODINIT_FUNC PyInit__rates(void)
{
    import_array();
    import_umath();
    PyObject *module = PyModule_Create(&module_definition);
    PyObject *threshold = PyFloat_FromDouble(RATES_DAMPING_THRESHOLD);
    if (module && (PyModule_AddObjectRef(module, "DAMPING_THRESHOLD", threshold) < 0 ||
                   add(module, solve_loops, solve_types, 9, 7, "solve",
                       "Joint rates of a twist within bounds, by damped least squares.",
                       "(6,n),(6),(n),(n),(n),(n),(6),(),()->(n),(6),(),(),(6),(),(n)") < 0 ||
                   add(module, bounds_loops, bounds_types, 7, 2, "bounds",
                       "The rates that joint, rate and acceleration limits leave.",
                       "(n),(n),(n),(n),(n),(n),()->(n),(n)") < 0 ||
                   add(module, gradient_loops, gradient_types, 5, 2, "gradient",
                       "The product of the singular values and its gradient.",
                       "(6,n),(6,n,n),(n),(6),()->(),(n)") < 0)) {
        Py_CLEAR(module);
    }
    Py_XDECREF(threshold);
    return module;
}
