#include "benchmarks/sdpa_export.h"

#include <iomanip>

namespace swarmcert::benchmarks {

using Eigen::Index;

void write_sdpa(const lipschitz::ReluChain& chain, std::ostream& out) {
  std::vector<Index> begin = {0, chain.front().cols()};  // first indices of x, z_1, ...
  for (std::size_t k = 0; k + 1 < chain.size(); ++k) begin.push_back(begin.back() + chain[k].rows());
  const Index size = begin.back();
  const Index inputs = begin[1];
  const Index variables = 1 + size - inputs;
  out << std::setprecision(17) << variables << "\n1\n" << size << "\n1";
  for (Index i = 1; i < variables; ++i) out << " 0";
  out << "\n";
  const auto entry = [&out](Index matrix, Index i, Index j, double value) {
    if (value != 0)
      out << matrix << " 1 " << std::min(i, j) + 1 << " " << std::max(i, j) + 1 << " " << value << "\n";
  };
  const Eigen::MatrixXd last = chain.back().transpose() * chain.back();
  const Index last_begin = size - last.rows();
  for (Index i = 0; i < last.rows(); ++i) {
    for (Index j = i; j < last.cols(); ++j) entry(0, last_begin + i, last_begin + j, last(i, j));
  }
  for (Index i = 0; i < inputs; ++i) entry(1, i, i, 1);
  Index variable = 2;
  for (std::size_t k = 0; k + 1 < chain.size(); ++k) {
    for (Index i = 0; i < chain[k].rows(); ++i, ++variable) {
      const Index neuron = begin[k + 1] + i;
      entry(variable, neuron, neuron, 2);
      for (Index j = 0; j < chain[k].cols(); ++j) entry(variable, begin[k] + j, neuron, -chain[k](i, j));
    }
  }
}

}  // namespace swarmcert::benchmarks
