/* Starts of attempts: the seed, then the configurations of a table, the nearest pose first. */
#ifndef CHASLES_STARTS_H
#define CHASLES_STARTS_H

#include "iterative/native/arm.h"

/* Copies start number `tried` to work->q: first the seed (n,) unless it is NULL, then the table
 * sorted by the distance from the target. Returns 0 at the end of the table. */
int next_start(const Problem *problem, const double *seed, int tried);

/* Inserts work->q into the best results work->best[:count], sorted by error; returns the new count.
 */
int keep_end(const Problem *problem, double half_square, double *errors, int count);

#endif
