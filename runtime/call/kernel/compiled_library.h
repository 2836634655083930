/* Library: a compiled robot, opened and checked against its expected content hash. */
#pragma once

#include "call/kernel/python_api.h"
#include "library/_kernel.h"

typedef struct {
    PyObject_HEAD
    void *handle;                  /* of dlopen */
    const chasles_kernel *kernels; /* table of functions, whose last entry has no name */
    PyObject *path;
} Library;

extern PyTypeObject LibraryType;

/* Module function open(path, expected_hash). Returns a new Library, or NULL with an error. */
PyObject *library_open(PyObject *Py_UNUSED(module), PyObject *args);

/* Returns the entry of the function with this name, otherwise NULL. */
const chasles_kernel *library_find(const Library *library, const char *name);
