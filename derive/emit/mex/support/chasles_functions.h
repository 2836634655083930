/* Table of the functions of a robot, for MATLAB, Octave and Simulink. The file is the same for
 * every robot of chasles.
 */
#ifndef CHASLES_FUNCTIONS_H
#define CHASLES_FUNCTIONS_H

#include <stddef.h>

#define CHASLES_MAX_ARRAYS 8 /* largest number of inputs, and of outputs */
#define CHASLES_SOLVED 1e-9  /* largest residual of a solution (m or rad), as in the generated C */

/* An input or output of a function in the table. The array is row-major in C and column-major in
 * MATLAB. */
typedef struct {
    const char *name;
    int shape[3];     /* sizes in MATLAB, with 1 for each missing dimension */
    int has_columns;  /* whether a solution is a row in C and a column in MATLAB */
    int is_condition; /* whether each entry is 0 or 1 */
} chasles_array;

typedef struct {
    const char *name;
    int inputs, required, outputs; /* inputs beyond the first `required` inputs may be NULL */
    chasles_array in[CHASLES_MAX_ARRAYS], out[CHASLES_MAX_ARRAYS];
    void (*call)(const double *const *in, double *const *out);
} chasles_function;

static size_t chasles_size(const chasles_array *array)
{
    return (size_t)array->shape[0] * (size_t)array->shape[1] * (size_t)array->shape[2];
}

/* Converts the C offset `index` of an array entry to its MATLAB offset. */
static size_t chasles_offset(const chasles_array *array, size_t index)
{
    const size_t rows = (size_t)array->shape[0], columns = (size_t)array->shape[1];
    const size_t pages = (size_t)array->shape[2];
    const size_t page = index % pages, column = index / pages % columns;
    if (array->has_columns) {
        return index;
    }
    return index / (pages * columns) + rows * (column + columns * page);
}

static void chasles_to_c(const chasles_array *array, const double *matlab, double *c)
{
    for (size_t k = 0; k < chasles_size(array); k++) {
        c[k] = matlab[chasles_offset(array, k)];
    }
}

#endif
