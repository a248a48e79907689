/// @file Vector and matrix arithmetic for SUNDIALS by Eigen. Not for users.
///
/// Distributions ship the serial vectors and dense matrices of SUNDIALS without optimisation: with a few dozen states
/// they took four fifths of an integration. The data stay those of SUNDIALS, only the functions that touch them differ.
#pragma once

#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nvector.h>

namespace swarmcert::stability {

/// Makes `vector` and all its clones compute with Eigen. @param vector serial.
void compute_with_eigen(N_Vector vector);

/// The same for a matrix and its clones. @param matrix dense.
void compute_with_eigen(SUNMatrix matrix);

/// Direct solver for dense matrices: LU with partial pivoting; up to 48 unknowns the inverse is kept, which Newton's
/// method, correct to its own tolerance whatever the solver's rounding, takes as well and applies faster.
/// @return nullptr if memory is short.
SUNLinearSolver eigen_solver(SUNContext context);

}  // namespace swarmcert::stability
