#pragma once

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_nvector.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

// Version 7 names the communicator of a program without MPI; earlier ones take a null pointer.
#ifndef SUN_COMM_NULL
#define SUN_COMM_NULL nullptr
#endif
