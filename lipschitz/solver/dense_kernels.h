/// @file The dense products and factorisations that dominate the interior-point method, by BLAS and LAPACK.
///
/// Eigen's kernels use the compiler's baseline instruction set (SSE2 on x86-64); OpenBLAS selects the best kernels of
/// the processor at run time and is three to five times faster at these sizes. Its order of summation is unknown, which
/// is acceptable because no result of the solver is trusted.
#pragma once

#include <Eigen/Core>

namespace swarmcert::lipschitz {

/// Restricts a threaded OpenBLAS to one thread in this process. Callers parallelise over whole problems, and the
/// solver's results are then bit-identical for any number of threads.
void use_one_blas_thread();

/// Lets the allocator keep freed memory, up to a quarter of a gigabyte. Otherwise temporary matrices of a few hundred
/// kilobytes would be returned to the system and zeroed again each time. No effect if the C library has no such option.
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

/// C += factor A A', lower triangle only.
void add_lower_gram(Eigen::Ref<Eigen::MatrixXd> c, double factor, const Eigen::Ref<const Eigen::MatrixXd>& a);

/// C += A' B for symmetric C and A' B; computes only half of the product.
void add_symmetric_product_transposed(Eigen::Ref<Eigen::MatrixXd> c,
                                      const Eigen::Ref<const Eigen::MatrixXd>& a,
                                      const Eigen::Ref<const Eigen::MatrixXd>& b);

/// Returns L with X = L L' for a symmetric X (its lower triangle is read), with zeros above the diagonal; an empty
/// matrix if the factorisation breaks down, which means that X is not safely positive definite.
Eigen::MatrixXd cholesky(const Eigen::MatrixXd& x);

/// The same in place; entries above the diagonal are unchanged. Returns false if the factorisation breaks down.
bool cholesky_in_place(Eigen::Ref<Eigen::MatrixXd> x);

/// Returns X^-1 for X = L L'. Recursive bisection, so that nearly all work is matrix products.
Eigen::MatrixXd inverse_from_cholesky(const Eigen::MatrixXd& l);
/// The same in place.
void invert_from_cholesky(Eigen::Ref<Eigen::MatrixXd> l);

/// Returns L^-1 D L^-T v for symmetric D (its lower triangle is read).
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

/// y += factor X v for symmetric X (its lower triangle is read).
void add_symmetric_product(Eigen::VectorXd& y, double factor, const Eigen::MatrixXd& x,
                           const Eigen::VectorXd& v);

/// Returns an estimate of the largest eigenvalue of a symmetric positive semidefinite matrix (its lower triangle is
/// read), to about twelve digits; at least 0.
double largest_eigenvalue(const Eigen::MatrixXd& m);

}  // namespace swarmcert::lipschitz
