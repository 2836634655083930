#include "call/kernel/compiled_library.h"

#ifdef __x86_64__
#include <cpuid.h>
#endif
#include <string.h>

#include "call/kernel/posix.h"

static void library_dealloc(Library *self)
{
    if (self->handle) {
        dlclose(self->handle);
    }
    Py_XDECREF(self->path);
    Py_TYPE(self)->tp_free((PyObject *)self);
}

/* Returns the address of the symbol, or NULL with an error that names the file. */
static const void *find_symbol(Library *self, const char *symbol)
{
    const void *found = dlsym(self->handle, symbol);
    if (!found) {
        PyErr_Format(MismatchError, "%U: not a library of chasles (it has no %s)", self->path,
                     symbol);
    }
    return found;
}

#ifdef __x86_64__
/* Tests whether the processor has FMA and the features `bits` of cpuid leaf 7. Also tests whether
 * the operating system saves the registers `saved`. Wheels are built by Zig. In the runtime library
 * of Zig, the function __builtin_cpu_supports is always false. */
static int has_features(unsigned bits, unsigned saved)
{
    unsigned a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_FMA) || !(c & bit_OSXSAVE)) {
        return 0;
    }
    __asm__("xgetbv" : "=a"(a), "=d"(d) : "c"(0));
    return (a & saved) == saved && __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & bits) == bits;
}
#endif

/* Returns the symbol name of the kernels for this processor's instruction set. */
static const char *kernels_of_processor(void)
{
#ifdef __x86_64__
    const unsigned avx512 = bit_AVX512F | bit_AVX512DQ | bit_AVX512VL | bit_AVX512BW | bit_AVX512CD;
    const int v3 = has_features(bit_AVX2 | bit_BMI | bit_BMI2, 0x6); /* xmm, ymm registers */
    const int v4 = v3 && has_features(avx512, 0xe6);                 /* zmm and mask registers */
    return v4 ? "chasles_kernels_v4" : v3 ? "chasles_kernels_v3" : "chasles_kernels";
#else
    return "chasles_kernels";
#endif
}

/* Opens the library and checks its hash. Returns -1 on error. */
static int library_load(Library *self, const char *path, const char *expected_hash)
{
    self->handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!self->handle) {
        PyErr_Format(MismatchError, "%U: cannot be opened as a library (%s)", self->path,
                     dlerror());
        return -1;
    }
    const char *hash = find_symbol(self, "chasles_hash");
    if (!hash) {
        return -1;
    }
    if (strcmp(hash, expected_hash) != 0) {
        PyErr_Format(MismatchError, "%U: compiled for content %.16s..., but %.16s... is expected",
                     self->path, hash, expected_hash);
        return -1;
    }
    self->kernels = dlsym(self->handle, kernels_of_processor());
    if (!self->kernels) {
        self->kernels = find_symbol(self, "chasles_kernels");
    }
    return self->kernels ? 0 : -1;
}

PyObject *library_open(PyObject *Py_UNUSED(module), PyObject *args)
{
    PyObject *path_bytes;
    const char *expected_hash;
    if (!PyArg_ParseTuple(args, "O&s:open", PyUnicode_FSConverter, &path_bytes, &expected_hash)) {
        return NULL;
    }
    const char *path = PyBytes_AS_STRING(path_bytes);
    Library *self = (Library *)LibraryType.tp_alloc(&LibraryType, 0);
    if (self) {
        self->path = PyUnicode_DecodeFSDefault(path);
        if (!self->path || library_load(self, path, expected_hash) < 0) {
            Py_CLEAR(self);
        }
    }
    Py_DECREF(path_bytes);
    return (PyObject *)self;
}

const chasles_kernel *library_find(const Library *library, const char *name)
{
    for (const chasles_kernel *entry = library->kernels; entry->name; entry++) {
        if (strcmp(entry->name, name) == 0) {
            return entry;
        }
    }
    return NULL;
}

PyTypeObject LibraryType = {
    PyVarObject_HEAD_INIT(NULL, 0).tp_name = "chasles.call._call.Library",
    .tp_doc = "A compiled robot, open for as long as any of its functions lives.",
    .tp_basicsize = sizeof(Library),
    .tp_flags = Py_TPFLAGS_DEFAULT,
    .tp_dealloc = (destructor)library_dealloc,
};
