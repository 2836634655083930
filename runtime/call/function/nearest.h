/* Nearest: the Python object behind robot.ik_nearest.
 *
 * A call with a pose and a seed alone runs here: the inverse, then the selection that was compiled
 * with it. Calls with options, and poses that need more than the kernel, go to Python. */
#ifndef CHASLES_NEAREST_CALL_H
#define CHASLES_NEAREST_CALL_H

#include "call/function/function.h"

extern PyTypeObject NearestType;

#endif
