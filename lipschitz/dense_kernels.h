/// @file The dense products and factorisations that dominate the interior point method, by BLAS and LAPACK.
///
/// Eigen's own kernels use what the compiler's baseline has (SSE2 on x86-64); OpenBLAS picks the processor's best at
/// run time, three to five times faster at these sizes. Its order of summation is unknown, which is no harm here:
/// nothing that the solver says is trusted.
#pragma once

#include <Eigen/Core>

namespace swarmcert::lipschitz {

/// Keeps OpenBLAS to one thread in this process: callers parallelise over whole problems, and the solver's bits stay
/// the same for any number of them.
void use_one_blas_thread();

/// C += A B.
void add_product(Eigen::Ref<Eigen::MatrixXd> c, const Eigen::Ref<const Eigen::MatrixXd>& a,
                 const Eigen::Ref<const Eigen::MatrixXd>& b);

/// C += A B'.
void add_product_transposed(Eigen::Ref<Eigen::MatrixXd> c, const Eigen::Ref<const Eigen::MatrixXd>& a,
                            const Eigen::Ref<const Eigen::MatrixXd>& b);

/// For a symmetric X = L L' (its lower triangle is read): L^-1, with zeros above the diagonal. Empty if the Cholesky
/// factorisation breaks down, so X is not safely positive definite.
Eigen::MatrixXd inverse_cholesky(const Eigen::MatrixXd& x);

/// L' L for a lower triangular L; with L = inverse_cholesky(X) that is X^-1.
Eigen::MatrixXd lower_gram(const Eigen::MatrixXd& l);

}  // namespace swarmcert::lipschitz
