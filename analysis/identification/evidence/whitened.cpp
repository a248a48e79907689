#include "analysis/identification/evidence/whitened.h"

#include <stdexcept>

namespace swarmcert::evidence {

Whitened::Whitened(Eigen::MatrixXf columns, Eigen::VectorXf data)
    : columns_(std::move(columns)),
      data_(std::move(data)),
      with_data_((columns_.transpose() * data_).cast<double>()),
      data_square_(data_.cast<double>().squaredNorm()) {
  // Any comparison with NaN is false, so that a search would find nothing.
  if (!columns_.allFinite() || !data_.allFinite())
    throw std::domain_error("evidence: a column of an explanation, or the residual, is not finite");
}

void Whitened::append(const Eigen::MatrixXf& columns) {
  const Eigen::Index before = columns_.cols();
  columns_.conservativeResize(Eigen::NoChange, before + columns.cols());
  columns_.rightCols(columns.cols()) = columns;
  with_data_.conservativeResize(columns_.cols());
  with_data_.tail(columns.cols()) = (columns.transpose() * data_).cast<double>();
  with_all_.clear();
}

const Eigen::MatrixXd& Whitened::with_all(int first, int size) const {
  const auto [place, is_new] = with_all_.try_emplace(first);
  if (is_new) place->second = (columns_.transpose() * columns_.middleCols(first, size)).cast<double>();
  return place->second;
}

const Eigen::MatrixXd& Whitened::within(int first, int size) const {
  const auto [place, is_new] = within_.try_emplace(first);
  if (is_new) {
    const auto columns = columns_.middleCols(first, size);
    place->second = (columns.transpose() * columns).cast<double>();
  }
  return place->second;
}

}  // namespace swarmcert::evidence
