/* Start configurations: the seed, then a table sorted by the distance of its poses to the target.
 */
#pragma once

#include "iterative/native/arm.h"

/* Copies start configuration number `tried` to work->q. The seed (n,) is the first start
 * configuration unless it is NULL. The configurations of the sorted table follow. Returns 0 if the
 * table has no further start configuration. */
int next_start(const Problem *problem, const double *seed, int tried);

/* Inserts work->q into the list work->best, sorted by error. Returns the new length. */
int keep_end(const Problem *problem, double half_square, double *errors, int count);
