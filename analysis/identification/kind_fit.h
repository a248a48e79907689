/// @file Joint fit of effects and their shapes to all flights of one kind of vehicle, with an offset for each vehicle.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "analysis/identification/block_grams.h"
#include "analysis/residuals/comparison.h"

namespace swarmcert::identification {

/// Returns the entry of `vehicle` in flights.toml; the fallback kind if there is none.
residuals::VehicleUse use_of(const residuals::Inputs& inputs, const std::string& vehicle);

/// Shared coefficients of some columns and a constant force per vehicle, by least squares within the bounds of the
/// coefficients, with the squared error.
struct JointFit {
  Eigen::VectorXd shared;
  std::map<std::string, Eigen::Vector3d> offsets_N;
  double square = 0;
};

class KindFit {
 public:
  /// @param inputs must outlive this object
  KindFit(const residuals::Inputs& inputs, const std::string& kind, int jobs);

  /// Adds effects by name, with their default shapes.
  void add(const std::vector<std::string>& names);

  /// Searches over all shapes at once. Each pass through the flights tries a step up and a step down in each shape
  /// parameter, and the vertices of the parabolas through the errors of the last pass; each effect moves to its best
  /// shape, and steps without gain are halved.
  void search(int passes, const residuals::Progress& progress);

  bool is_empty() const { return covered_.records == 0; }
  const std::map<std::string, Eigen::Vector3d>& offsets_N() const { return fit_.offsets_N; }
  /// Returns the effects in `names`, with values.
  std::vector<stability::EffectSpec> specs(const std::set<std::string>& names) const;

 private:
  /// Sums over the blocks of a vehicle.
  struct Sum {
    Eigen::VectorXd gram, b;
    double y = 0;
  };
  /// An effect of a joint fit with its current shape.
  struct Part {
    Candidate candidate;
    std::vector<double> shape, step;
    std::vector<double> proposal;  ///< an additional theta: the vertices of the parabolas of all parameters
    std::vector<double> coefficients;
  };

  /// Chooses the best theta of effect `i` beside the others, and its next direction and step.
  void choose(const Grams& grams, const std::map<std::string, Sum>& sums, std::size_t i,
              std::vector<std::size_t>& chosen);
  void step(bool moves);
  /// Returns the inputs in which the other vehicles serve only as neighbours.
  residuals::Inputs of_vehicle(const std::string& vehicle) const;
  static JointFit solve(const std::map<std::string, Sum>& sums, const std::vector<int>& columns,
                        int first_offset, const std::vector<stability::Parameter>& bounds);
  JointFit solve_with(const Grams& grams, const std::map<std::string, Sum>& sums,
                      const std::vector<std::size_t>& chosen) const;

  const residuals::Inputs& inputs_;
  const std::string kind_;
  const int jobs_;
  std::map<std::string, std::vector<int>> flights_of_;  ///< by vehicle
  Coverage covered_;
  std::vector<Part> parts_;
  JointFit fit_;
};

}  // namespace swarmcert::identification
