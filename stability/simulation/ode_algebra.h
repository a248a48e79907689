/// @file Vector and matrix arithmetic for SUNDIALS by Eigen. Not for users.
///
/// Distributions ship the serial vectors and dense matrices of SUNDIALS compiled without optimisation: with a few dozen
/// states they took four fifths of the integration time. The data stay in SUNDIALS objects; only the functions that
/// operate on them are replaced.
#pragma once

#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nvector.h>

namespace swarmcert::stability {

/// Makes `vector` and all its clones compute with Eigen. @param vector a serial vector.
void compute_with_eigen(N_Vector vector);

/// Makes `matrix` and all its clones compute with Eigen. @param matrix a dense matrix.
void compute_with_eigen(SUNMatrix matrix);

/// Returns a direct solver for dense matrices by LU with partial pivoting. Up to 48 unknowns it keeps the inverse,
/// which is faster to apply; its round-off error does not matter, since Newton's method iterates to its own tolerance.
/// @return nullptr if out of memory.
SUNLinearSolver eigen_solver(SUNContext context);

}  // namespace swarmcert::stability
