#include "lipschitz/solver/dense_kernels.h"

#include <cblas.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <mutex>
#include <optional>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "nn/base/random.h"

extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dtrtri_(const char* uplo, const char* diag, const int* n, double* a, const int* lda, int* info);
void dlauum_(const char* uplo, const int* n, double* a, const int* lda, int* info);
}

namespace swarmcert::lipschitz {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Below this size LAPACK's unblocked inversion is fastest.
constexpr int kSmallTriangle = 32;

/// Returns a lock to be held during calls of OpenBLAS. Builds of OpenBLAS without threads may not protect their buffers
/// (Debian's does not), so that concurrent calls give wrong results; there the calls are serialised.
std::unique_lock<std::mutex> blas_turn() {
  static std::mutex mutex;
  std::unique_lock<std::mutex> turn(mutex, std::defer_lock);
  if (openblas_get_parallel() == OPENBLAS_SEQUENTIAL) turn.lock();
  return turn;
}

void multiply(CBLAS_TRANSPOSE transpose_a, CBLAS_TRANSPOSE transpose_b, Eigen::Ref<MatrixXd> c,
              const Eigen::Ref<const MatrixXd>& a, const Eigen::Ref<const MatrixXd>& b) {
  const Eigen::Index inner = transpose_a == CblasNoTrans ? a.cols() : a.rows();
  if (c.size() == 0 || inner == 0) return;
  const auto turn = blas_turn();
  cblas_dgemm(CblasColMajor, transpose_a, transpose_b, static_cast<int>(c.rows()), static_cast<int>(c.cols()),
              static_cast<int>(inner), 1.0, a.data(), static_cast<int>(a.outerStride()), b.data(),
              static_cast<int>(b.outerStride()), 1.0, c.data(), static_cast<int>(c.outerStride()));
}

/// Replaces a lower triangular L = [A 0; B C] by its inverse [A^-1 0; -C^-1 B A^-1 C^-1].
void invert_lower(Eigen::Ref<MatrixXd> l) {
  const int n = static_cast<int>(l.rows());
  const int stride = static_cast<int>(l.outerStride());
  if (n <= kSmallTriangle) {
    int info = 0;
    dtrtri_("L", "N", &n, l.data(), &stride, &info);
    return;
  }
  const int half = n / 2;
  Eigen::Ref<MatrixXd> a = l.topLeftCorner(half, half);
  Eigen::Ref<MatrixXd> b = l.bottomLeftCorner(n - half, half);
  Eigen::Ref<MatrixXd> c = l.bottomRightCorner(n - half, n - half);
  cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, n - half, half, -1.0,
              c.data(), stride, b.data(), stride);
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasNoTrans, CblasNonUnit, n - half, half, 1.0,
              a.data(), stride, b.data(), stride);
  invert_lower(a);
  invert_lower(c);
}

}  // namespace

void use_one_blas_thread() { openblas_set_num_threads(1); }

void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_TRIM_THRESHOLD, 1 << 28);
  mallopt(M_MMAP_THRESHOLD, 1 << 25);
#endif
}

void add_product(Eigen::Ref<MatrixXd> c, const Eigen::Ref<const MatrixXd>& a,
                 const Eigen::Ref<const MatrixXd>& b) {
  multiply(CblasNoTrans, CblasNoTrans, c, a, b);
}

void add_product_transposed(Eigen::Ref<MatrixXd> c, const Eigen::Ref<const MatrixXd>& a,
                            const Eigen::Ref<const MatrixXd>& b) {
  multiply(CblasNoTrans, CblasTrans, c, a, b);
}

void add_transposed_product(Eigen::Ref<MatrixXd> c, const Eigen::Ref<const MatrixXd>& a,
                            const Eigen::Ref<const MatrixXd>& b) {
  multiply(CblasTrans, CblasNoTrans, c, a, b);
}

void add_lower_gram(Eigen::Ref<MatrixXd> c, double factor, const Eigen::Ref<const MatrixXd>& a) {
  if (c.size() == 0 || a.cols() == 0) return;
  const auto turn = blas_turn();
  cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, static_cast<int>(a.rows()), static_cast<int>(a.cols()),
              factor, a.data(), static_cast<int>(a.outerStride()), 1.0, c.data(),
              static_cast<int>(c.outerStride()));
}

void add_symmetric_product_transposed(Eigen::Ref<MatrixXd> c, const Eigen::Ref<const MatrixXd>& a,
                                      const Eigen::Ref<const MatrixXd>& b) {
  constexpr Eigen::Index kPanel = 96;
  for (Eigen::Index from = 0; from < c.cols(); from += kPanel) {
    const Eigen::Index width = std::min(kPanel, c.cols() - from), below = c.rows() - from;
    add_transposed_product(c.block(from, from, below, width), a.rightCols(below), b.middleCols(from, width));
  }
  c.triangularView<Eigen::StrictlyUpper>() = c.transpose();
}

bool cholesky_in_place(Eigen::Ref<MatrixXd> x) {
  const int n = static_cast<int>(x.rows()), stride = static_cast<int>(x.outerStride());
  int info = 0;
  const auto turn = blas_turn();
  dpotrf_("L", &n, x.data(), &stride, &info);
  return info == 0 && x.diagonal().allFinite();
}

MatrixXd cholesky(const MatrixXd& x) {
  MatrixXd l = x.triangularView<Eigen::Lower>();
  if (!cholesky_in_place(l) || !l.allFinite()) return {};
  return l;
}

void invert_from_cholesky(Eigen::Ref<MatrixXd> l) {
  const auto turn = blas_turn();
  invert_lower(l);
  const int n = static_cast<int>(l.rows()), stride = static_cast<int>(l.outerStride());
  int info = 0;
  dlauum_("L", &n, l.data(), &stride, &info);
  l.triangularView<Eigen::StrictlyUpper>() = l.transpose();
}

MatrixXd inverse_from_cholesky(const MatrixXd& l) {
  MatrixXd product = l;
  invert_from_cholesky(product);
  return product;
}

VectorXd congruence_times(const MatrixXd& l, const MatrixXd& d, const VectorXd& v) {
  const int n = static_cast<int>(l.rows());
  VectorXd u = v;
  VectorXd w = VectorXd::Zero(n);
  const auto turn = blas_turn();
  cblas_dtrsv(CblasColMajor, CblasLower, CblasTrans, CblasNonUnit, n, l.data(), n, u.data(), 1);
  cblas_dsymv(CblasColMajor, CblasLower, n, 1.0, d.data(), n, u.data(), 1, 0.0, w.data(), 1);
  cblas_dtrsv(CblasColMajor, CblasLower, CblasNoTrans, CblasNonUnit, n, l.data(), n, w.data(), 1);
  return w;
}

void solve_lower(const Eigen::Ref<const MatrixXd>& l, Eigen::Ref<MatrixXd> b) {
  const int n = static_cast<int>(l.rows()), stride = static_cast<int>(l.outerStride());
  const auto turn = blas_turn();
  cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, n, static_cast<int>(b.cols()),
              1.0, l.data(), stride, b.data(), static_cast<int>(b.outerStride()));
}

void solve_lower_transposed(const Eigen::Ref<const MatrixXd>& l, Eigen::Ref<MatrixXd> b) {
  const int n = static_cast<int>(l.rows()), stride = static_cast<int>(l.outerStride());
  const auto turn = blas_turn();
  cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasTrans, CblasNonUnit, n, static_cast<int>(b.cols()),
              1.0, l.data(), stride, b.data(), static_cast<int>(b.outerStride()));
}

namespace {

void divide(CBLAS_TRANSPOSE transpose, Eigen::Ref<MatrixXd> x, const Eigen::Ref<const MatrixXd>& l) {
  const auto turn = blas_turn();
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, transpose, CblasNonUnit, static_cast<int>(x.rows()),
              static_cast<int>(x.cols()), 1.0, l.data(), static_cast<int>(l.outerStride()), x.data(),
              static_cast<int>(x.outerStride()));
}

}  // namespace

void divide_by_lower(Eigen::Ref<MatrixXd> x, const Eigen::Ref<const MatrixXd>& l) {
  divide(CblasNoTrans, x, l);
}

void divide_by_lower_transposed(Eigen::Ref<MatrixXd> x, const Eigen::Ref<const MatrixXd>& l) {
  divide(CblasTrans, x, l);
}

void solve_cholesky(const MatrixXd& l, VectorXd& b) {
  const int n = static_cast<int>(l.rows());
  const auto turn = blas_turn();
  cblas_dtrsv(CblasColMajor, CblasLower, CblasNoTrans, CblasNonUnit, n, l.data(), n, b.data(), 1);
  cblas_dtrsv(CblasColMajor, CblasLower, CblasTrans, CblasNonUnit, n, l.data(), n, b.data(), 1);
}

void add_symmetric_product(VectorXd& y, double factor, const MatrixXd& x, const VectorXd& v) {
  const int n = static_cast<int>(x.rows());
  const auto turn = blas_turn();
  cblas_dsymv(CblasColMajor, CblasLower, n, factor, x.data(), n, v.data(), 1, 1.0, y.data(), 1);
}

namespace {

/// Lanczos method with full reorthogonalisation; returns nothing if it does not converge.
std::optional<double> largest_by_lanczos(const MatrixXd& m) {
  constexpr Eigen::Index kSteps = 200, kBetweenLooks = 10;
  constexpr double kResidual = 1e-8;  // the error of the eigenvalue is of the order of its square
  const Eigen::Index n = m.rows(), steps = std::min(n, kSteps);
  MatrixXd basis(n, steps + 1);
  VectorXd alpha(steps), beta(steps);
  files::Random random(1);
  for (double& x : basis.col(0)) x = random.symmetric();
  basis.col(0).normalize();
  for (Eigen::Index k = 0; k < steps; ++k) {
    VectorXd w = VectorXd::Zero(n);
    add_symmetric_product(w, 1, m, basis.col(k));
    alpha(k) = basis.col(k).dot(w);
    for (int again = 0; again < 2; ++again)
      w -= basis.leftCols(k + 1) * (basis.leftCols(k + 1).transpose() * w);
    beta(k) = w.norm();
    if (k % kBetweenLooks == kBetweenLooks - 1 || k + 1 == steps) {
      Eigen::SelfAdjointEigenSolver<MatrixXd> eigen;
      eigen.computeFromTridiagonal(alpha.head(k + 1), beta.head(k), Eigen::ComputeEigenvectors);
      const double value = eigen.eigenvalues()(k);
      if (beta(k) * std::abs(eigen.eigenvectors()(k, k)) <= kResidual * value) return value;
    }
    if (!(beta(k) > 0)) break;
    basis.col(k + 1) = w / beta(k);
  }
  return std::nullopt;
}

}  // namespace

double largest_eigenvalue(const MatrixXd& m) {
  constexpr Eigen::Index kMostDirect = 64;  // for larger matrices, iterations are cheaper
  if (m.rows() > kMostDirect) {
    const std::optional<double> found = largest_by_lanczos(m);
    if (found) return std::max(0.0, *found);
  }
  return std::max(
      0.0, Eigen::SelfAdjointEigenSolver<MatrixXd>(m, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff());
}

}  // namespace swarmcert::lipschitz
