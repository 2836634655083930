/* Start configurations: the seed, then a table, sorted by pose distance from the target. */
#pragma once

#include "iterative/native/arm.h"

/* Copies start configuration number `tried` to work->q. The seed (n,) is first unless it is
 * NULL, then the table follows, sorted by pose distance. Returns 0 if the table has no further
 * start configuration. */
int next_start(const Problem *problem, const double *seed, int tried);

/* Inserts work->q into the best results work->best[:count], sorted by error. Returns the new number
 * of results. */
int keep_end(const Problem *problem, double half_square, double *errors, int count);
