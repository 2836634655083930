/* Python's and NumPy's interfaces, and the Python objects that all files of chasles.call._call use.
 *
 * NumPy's tables of functions are imported once, by the file that defines IMPORT_NUMPY. */
#pragma once

#define PY_SSIZE_T_CLEAN
#define PY_ARRAY_UNIQUE_SYMBOL chasles_call_array_api
#define PY_UFUNC_UNIQUE_SYMBOL chasles_call_ufunc_api
#ifndef IMPORT_NUMPY
#define NO_IMPORT_ARRAY
#define NO_IMPORT_UFUNC
#endif

#include <Python.h>

#include <numpy/arrayobject.h>
#include <numpy/ufuncobject.h>

/* Exceptions of chasles.errors. */
extern PyObject *ShapeError, *InputError, *MismatchError;

/* Interned strings. */
extern PyObject *str_out, *str_threads, *str_fixed, *str_name, *str_shape, *str_array_ufunc;

/* __array_ufunc__ of NumPy's own arrays. */
extern PyObject *ndarray_array_ufunc;
