#include "lipschitz/dense_kernels.h"

#include <cblas.h>

extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dtrtri_(const char* uplo, const char* diag, const int* n, double* a, const int* lda, int* info);
void dlauum_(const char* uplo, const int* n, double* a, const int* lda, int* info);
}

namespace swarmcert::lipschitz {
namespace {

using Eigen::MatrixXd;

void multiply(CBLAS_TRANSPOSE transpose_b, Eigen::Ref<MatrixXd> c, const Eigen::Ref<const MatrixXd>& a,
              const Eigen::Ref<const MatrixXd>& b) {
  if (c.size() == 0 || a.cols() == 0) return;
  cblas_dgemm(CblasColMajor, CblasNoTrans, transpose_b, static_cast<int>(c.rows()),
              static_cast<int>(c.cols()), static_cast<int>(a.cols()), 1.0, a.data(),
              static_cast<int>(a.outerStride()), b.data(), static_cast<int>(b.outerStride()), 1.0, c.data(),
              static_cast<int>(c.outerStride()));
}

}  // namespace

void use_one_blas_thread() { openblas_set_num_threads(1); }

void add_product(Eigen::Ref<MatrixXd> c, const Eigen::Ref<const MatrixXd>& a,
                 const Eigen::Ref<const MatrixXd>& b) {
  multiply(CblasNoTrans, c, a, b);
}

void add_product_transposed(Eigen::Ref<MatrixXd> c, const Eigen::Ref<const MatrixXd>& a,
                            const Eigen::Ref<const MatrixXd>& b) {
  multiply(CblasTrans, c, a, b);
}

MatrixXd inverse_cholesky(const MatrixXd& x) {
  const int n = static_cast<int>(x.rows());
  int info = 0;
  MatrixXd l = x.triangularView<Eigen::Lower>();
  dpotrf_("L", &n, l.data(), &n, &info);
  if (info != 0) return {};
  dtrtri_("L", "N", &n, l.data(), &n, &info);
  if (info != 0 || !l.allFinite()) return {};
  return l;
}

MatrixXd lower_gram(const MatrixXd& l) {
  const int n = static_cast<int>(l.rows());
  int info = 0;
  MatrixXd product = l;
  dlauum_("L", &n, product.data(), &n, &info);
  product.triangularView<Eigen::StrictlyUpper>() = product.transpose();
  return product;
}

}  // namespace swarmcert::lipschitz
