/* Nearest, the Python object that implements robot.ik_nearest.
 *
 * C runs the inverse and the compiled selection for calls with poses and seeds only. Python handles
 * options, and poses that need refinement or an error. */
#pragma once

#include "call/function/function.h"

extern PyTypeObject NearestType;
