/// @file The dense products and factorisations that dominate the interior point method, by BLAS and LAPACK.
///
/// Eigen's own kernels use what the compiler's baseline has (SSE2 on x86-64); OpenBLAS picks the processor's best at
/// run time, three to five times faster at these sizes. Its order of summation is unknown, which is no harm here:
/// nothing that the solver says is trusted.
#pragma once

#include <Eigen/Core>

namespace swarmcert::lipschitz {

/// Keeps a threaded OpenBLAS to one thread in this process: callers parallelise over whole problems, and the solver's
/// bits stay the same for any number of them.
void use_one_blas_thread();

/// Lets the process keep what it frees, up to a quarter of a gigabyte: matrices of a few hundred kilobytes that come
/// and go would otherwise be handed back to the system and zeroed again each time. Nothing where the C library has no
/// such switch.
void keep_freed_memory();

/// C += A B.
void add_product(Eigen::Ref<Eigen::MatrixXd> c, const Eigen::Ref<const Eigen::MatrixXd>& a,
                 const Eigen::Ref<const Eigen::MatrixXd>& b);

/// C += A B'.
void add_product_transposed(Eigen::Ref<Eigen::MatrixXd> c, const Eigen::Ref<const Eigen::MatrixXd>& a,
                            const Eigen::Ref<const Eigen::MatrixXd>& b);

/// C += A' B.
void add_transposed_product(Eigen::Ref<Eigen::MatrixXd> c, const Eigen::Ref<const Eigen::MatrixXd>& a,
                            const Eigen::Ref<const Eigen::MatrixXd>& b);

/// C += factor A A', its lower triangle.
void add_lower_gram(Eigen::Ref<Eigen::MatrixXd> c, double factor, const Eigen::Ref<const Eigen::MatrixXd>& a);

/// C += A' B for symmetric C and A' B, of which half is computed.
void add_symmetric_product_transposed(Eigen::Ref<Eigen::MatrixXd> c,
                                      const Eigen::Ref<const Eigen::MatrixXd>& a,
                                      const Eigen::Ref<const Eigen::MatrixXd>& b);

/// L with X = L L' for a symmetric X (its lower triangle is read), zeros above the diagonal. Empty if the
/// factorisation breaks down, so X is not safely positive definite.
Eigen::MatrixXd cholesky(const Eigen::MatrixXd& x);

/// The same in place; what is above the diagonal stays. False if the factorisation breaks down.
bool cholesky_in_place(Eigen::Ref<Eigen::MatrixXd> x);

/// X^-1 for X = L L'. Halves recursively, so that nearly all work is products of matrices.
Eigen::MatrixXd inverse_from_cholesky(const Eigen::MatrixXd& l);
/// The same in place.
void invert_from_cholesky(Eigen::Ref<Eigen::MatrixXd> l);

/// L^-1 D L^-T v, symmetric D (its lower triangle is read).
Eigen::VectorXd congruence_times(const Eigen::MatrixXd& l, const Eigen::MatrixXd& d,
                                 const Eigen::VectorXd& v);

/// B <- L^-1 B, and B <- L^-T B.
void solve_lower(const Eigen::Ref<const Eigen::MatrixXd>& l, Eigen::Ref<Eigen::MatrixXd> b);
void solve_lower_transposed(const Eigen::Ref<const Eigen::MatrixXd>& l, Eigen::Ref<Eigen::MatrixXd> b);

/// X <- X L^-1, and X <- X L^-T, for lower triangular L.
void divide_by_lower(Eigen::Ref<Eigen::MatrixXd> x, const Eigen::Ref<const Eigen::MatrixXd>& l);
void divide_by_lower_transposed(Eigen::Ref<Eigen::MatrixXd> x, const Eigen::Ref<const Eigen::MatrixXd>& l);

/// Solves L L' v = b in place.
void solve_cholesky(const Eigen::MatrixXd& l, Eigen::VectorXd& b);

/// y += factor X v, symmetric X (its lower triangle is read).
void add_symmetric_product(Eigen::VectorXd& y, double factor, const Eigen::MatrixXd& x,
                           const Eigen::VectorXd& v);

/// Largest eigenvalue of a symmetric positive semidefinite matrix (its lower triangle is read), an estimate to about
/// twelve digits; at least 0.
double largest_eigenvalue(const Eigen::MatrixXd& m);

}  // namespace swarmcert::lipschitz
