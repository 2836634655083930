/* Nearest, the Python object that implements robot.ik_nearest.
 *
 * If a call has only poses and seeds, C runs both the inverse and the compiled selection. Python
 * handles options, and poses that need refinement or an error. */
#pragma once

#include "call/function/function.h"

extern PyTypeObject NearestType;
