/* Where attempts begin: the seed, then the configurations of a table, the nearest pose first. */
#ifndef CHASLES_STARTS_H
#define CHASLES_STARTS_H

#include "iterative/native/arm.h"

/* Copies the start that follows `tried` others to work->q: the seed (n,) first unless it is
 * NULL, then those of the arm's table by the distance of their poses from the target. Returns 0
 * where none is left. */
int next_start(const Problem *problem, const double *seed, int tried);

/* Inserts work->q with its error among the best ends, work->best[:count], in order of their errors
 * (FINALISTS,). Returns how many there are then. */
int keep_end(const Problem *problem, double half_square, double *errors, int count);

#endif
