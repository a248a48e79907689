#include "stability/simulation/ode_algebra.h"

#include <nvector/nvector_serial.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <Eigen/LU>
#include <cmath>

namespace swarmcert::stability {
namespace {

using VectorMap = Eigen::Map<Eigen::ArrayXd>;
using MatrixMap = Eigen::Map<Eigen::MatrixXd>;

VectorMap map(N_Vector v) { return {NV_DATA_S(v), NV_LENGTH_S(v)}; }
MatrixMap map(SUNMatrix m) { return {SM_DATA_D(m), SM_ROWS_D(m), SM_COLUMNS_D(m)}; }

void linear_sum(realtype a, N_Vector x, realtype b, N_Vector y, N_Vector z) {
  if (a == 1 && b == 1) {
    map(z) = map(x) + map(y);
  } else if (a == 1 && b == -1) {
    map(z) = map(x) - map(y);
  } else if (a == 1) {
    map(z) = map(x) + b * map(y);
  } else if (b == 1) {
    map(z) = a * map(x) + map(y);
  } else {
    map(z) = a * map(x) + b * map(y);
  }
}

void set_all(realtype c, N_Vector z) { map(z).setConstant(c); }
void multiply(N_Vector x, N_Vector y, N_Vector z) { map(z) = map(x) * map(y); }
void scale(realtype c, N_Vector x, N_Vector z) { map(z) = c * map(x); }
void absolute_values(N_Vector x, N_Vector z) { map(z) = map(x).abs(); }
void invert(N_Vector x, N_Vector z) { map(z) = map(x).inverse(); }
void add_constant(N_Vector x, realtype b, N_Vector z) { map(z) = map(x) + b; }
/// sqrt(mean (x w)^2)
realtype weighted_norm(N_Vector x, N_Vector w) {
  return std::sqrt((map(x) * map(w)).matrix().squaredNorm() / static_cast<double>(NV_LENGTH_S(x)));
}

int copy_matrix(SUNMatrix from, SUNMatrix to) {
  map(to) = map(from);
  return SUNMAT_SUCCESS;
}

/// A = c A + I
int scale_and_add_identity(realtype c, SUNMatrix A) {
  map(A) *= c;
  map(A).diagonal().array() += 1;
  return SUNMAT_SUCCESS;
}

struct Factors {
  Eigen::PartialPivLU<Eigen::MatrixXd> lu;
  Eigen::MatrixXd inverse;
  bool is_inverted = false;
};

Factors& factors(SUNLinearSolver solver) { return *static_cast<Factors*>(solver->content); }

SUNLinearSolver_Type solver_type(SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; }

int set_up_solver(SUNLinearSolver solver, SUNMatrix A) {
  constexpr Eigen::Index kMostInverted = 48;
  Factors& own = factors(solver);
  own.lu.compute(map(A));
  own.is_inverted = own.lu.rows() <= kMostInverted;
  if (own.is_inverted) own.inverse.noalias() = own.lu.inverse();
  // Reported like a vanishing pivot, to which CVODE responds with a smaller step.
  const double least = own.lu.matrixLU().diagonal().cwiseAbs().minCoeff();
  return least > 0 ? SUNLS_SUCCESS : SUNLS_LUFACT_FAIL;
}

int solve_for(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, realtype) {
  const Factors& own = factors(solver);
  if (own.is_inverted) {
    map(x).matrix().noalias() = own.inverse * map(b).matrix();
  } else {
    map(x) = own.lu.solve(map(b).matrix()).array();
  }
  return SUNLS_SUCCESS;
}

int free_solver(SUNLinearSolver solver) {
  delete static_cast<Factors*>(solver->content);
  solver->content = nullptr;
  SUNLinSolFreeEmpty(solver);
  return SUNLS_SUCCESS;
}

}  // namespace

void compute_with_eigen(N_Vector vector) {
  vector->ops->nvlinearsum = linear_sum;
  vector->ops->nvconst = set_all;
  vector->ops->nvprod = multiply;
  vector->ops->nvscale = scale;
  vector->ops->nvabs = absolute_values;
  vector->ops->nvinv = invert;
  vector->ops->nvaddconst = add_constant;
  vector->ops->nvwrmsnorm = weighted_norm;
}

void compute_with_eigen(SUNMatrix matrix) {
  matrix->ops->copy = copy_matrix;
  matrix->ops->scaleaddi = scale_and_add_identity;
}

SUNLinearSolver eigen_solver(SUNContext context) {
  SUNLinearSolver solver = SUNLinSolNewEmpty(context);
  if (solver == nullptr) return nullptr;
  solver->ops->gettype = solver_type;
  solver->ops->setup = set_up_solver;
  solver->ops->solve = solve_for;
  solver->ops->free = free_solver;
  solver->content = new Factors;
  return solver;
}

}  // namespace swarmcert::stability
