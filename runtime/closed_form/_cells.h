/* A hash table of cells that finds solutions with equal coordinates. */
#pragma once

#include <Python.h>

#include <math.h>
#include <stdint.h>
#include <string.h>

#include <numpy/arrayobject.h>

#include "numerics/_tolerances.h"

#define MAX_JOINTS 64

/* The weighted sum of the coordinates selects the cell of a solution. Equal solutions are in the
 * same cell or in adjacent cells. */
typedef struct {
    npy_intp size; /* number of cells, a power of 2 */
    npy_intp *head,
        *next;    /* last solution in each cell; previous solution in the same cell; -1 for none */
    double width; /* width of a cell */
    double scale[MAX_JOINTS];
} Cells;

/* Allocates a hash table for k solutions with n coordinates. Returns -1 on error. */
static inline int cells_new(Cells *cells, npy_intp k, npy_intp n, const double *turn,
                            const double *tolerance)
{
    cells->width = 0;
    for (npy_intp j = 0; j < n; j++) {
        /* Irrational weights make the weighted sums of different solutions differ. */
        cells->scale[j] = turn[j] > 0 ? 0 : sqrt((double)(6 * j + 5));
        cells->width += 2 * cells->scale[j] * tolerance[j];
    }
    cells->width = cells->width > SAME_TURNS ? cells->width : SAME_TURNS;
    for (cells->size = 8; cells->size < 2 * k; cells->size *= 2) {
    }
    cells->head = PyMem_Malloc((size_t)(cells->size + k) * sizeof *cells->head);
    cells->next = cells->head + cells->size;
    if (!cells->head) {
        PyErr_NoMemory();
        return -1;
    }
    return 0;
}

static inline npy_intp cell_at(const Cells *cells, double cell)
{
    uint64_t bits;
    memcpy(&bits, &cell, sizeof bits);
    return (npy_intp)((bits * UINT64_C(0x9E3779B97F4A7C15)) >> 32) & (cells->size - 1);
}

static inline double cell_of(const Cells *cells, npy_intp n, const double *q)
{
    double sum = 0;
    for (npy_intp j = 0; j < n; j++) {
        sum += cells->scale[j] * q[j];
    }
    return floor(sum / cells->width) + 0.0;
}
