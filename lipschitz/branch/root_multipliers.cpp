#include "lipschitz/branch/root_multipliers.h"

#include <cmath>
#include <limits>

#include "lipschitz/branch/descend.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Accuracy to which the program of the whole box is solved.
constexpr double kRootGap = 0.02;
constexpr int kRootSteps = 12;

/// Returns the given multipliers, one per output of a hidden layer of `chain`, in its units.
VectorXd given_multipliers(const LocalChain& chain, const std::vector<double>& start) {
  VectorXd all(chain.neurons());
  Index neuron = 0, given = 0;
  for (std::size_t k = 0; k < chain.hidden.size(); ++k) {
    const Index rows = chain.hidden[k].weights.rows();
    for (Index i = 0; i < rows; ++i, ++neuron)
      all(neuron) = i < rows - chain.without_relu[k]
                        ? chain.scaled_multiplier(start.at(static_cast<std::size_t>(given++)), k)
                        : 0;
  }
  return all;
}

/// Returns a point well inside the feasible set. In a balanced chain the vector of ones is nearly feasible, and earlier
/// layers need larger multipliers. Returns an empty vector if the numbers leave the range of double.
VectorXd interior(const LocalChain& chain, const NodeInequality& inequality) {
  for (double shrink = 0.5; shrink > 1e-60; shrink *= 0.5) {
    VectorXd layers(chain.neurons());
    double level = 2 / shrink;
    Index end = layers.size();
    for (std::size_t k = chain.hidden.size(); k-- > 0; level /= shrink) {
      const Index rows = chain.hidden[k].weights.rows();
      layers.segment(end - rows, rows).setConstant(level);
      end -= rows;
      if (!chain.hidden[k].has_relu) level *= shrink;
    }
    VectorXd y(1 + inequality.neurons());
    y(0) = level;
    for (Index i = 0; i < inequality.neurons(); ++i)
      y(1 + i) = layers(inequality.undecided()[static_cast<std::size_t>(i)]);
    if (inequality.least_rho(y.tail(inequality.neurons())) < 0.9 * y(0)) return y;
  }
  return {};
}

}  // namespace

VectorXd root_multipliers(const LocalChain& chain, const NodeInequality& inequality,
                          const std::vector<double>& start, const Stop& stop) {
  if (!start.empty()) {
    const VectorXd t = given_multipliers(chain, start)(inequality.undecided());
    DescentOptions descent;
    descent.steps = kRootSteps;
    if (std::isfinite(inequality.least_rho(t))) return descend(inequality, t, descent);
  }
  const VectorXd inside = interior(chain, inequality);
  if (inside.size() == 0) return VectorXd::Zero(inequality.neurons());  // proves nothing
  InteriorPointOptions options;
  options.stop = stop;
  options.relative_gap = kRootGap;
  options.infeasibility = std::numeric_limits<double>::infinity();  // every iterate is a bound
  const InteriorPointResult found = minimise(inequality, inside, options);
  if (found.points.empty()) return VectorXd::Zero(inequality.neurons());
  return found.points.back().tail(inequality.neurons());
}

}  // namespace swarmcert::lipschitz
