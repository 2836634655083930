#include "chasles_general.h"
#include "ik_arm_0.h"
void f(const double*T,double*q,double*r,double*m){chasles_general_ik(&arm_0_ik_tables,T,q,r,m);}
