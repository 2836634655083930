/* Nearest, the Python object that implements robot.ik_nearest.
 *
 * C runs the inverse and the compiled selection for calls with poses and seeds only. Python handles
 * options, and poses that need refinement or an error. */
#ifndef CHASLES_NEAREST_CALL_H
#define CHASLES_NEAREST_CALL_H

#include "call/function/function.h"

extern PyTypeObject NearestType;

#endif
