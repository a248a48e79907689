/// @file Effects with shapes fitted jointly to all flights of one kind of vehicle, each vehicle with an offset of its
/// own.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "analysis/identification/block_grams.h"
#include "analysis/residuals/comparison.h"

namespace swarmcert::identification {

/// What flights.toml says of `vehicle`; the fallback kind where it says nothing.
residuals::VehicleUse use_of(const residuals::Inputs& inputs, const std::string& vehicle);

/// Shared coefficients of some columns, and a constant force for each vehicle, by least squares within the bounds of
/// the coefficients; the squared error.
struct JointFit {
  Eigen::VectorXd shared;
  std::map<std::string, Eigen::Vector3d> offsets_N;
  double square = 0;
};

class KindFit {
 public:
  /// @param inputs must outlive this.
  KindFit(const residuals::Inputs& inputs, const std::string& kind, int jobs);

  /// More effects, by name, with the shapes of their own defaults.
  void add(const std::vector<std::string>& names);

  /// A search over all shapes at once: each pass through the flights tries one step up and one down in every shape
  /// parameter, and where the parabolas through the last pass's errors have their vertices; each effect moves to its
  /// best, and steps that gain nothing are halved.
  void search(int passes, const residuals::Progress& progress);

  bool is_empty() const { return covered_.records == 0; }
  const std::map<std::string, Eigen::Vector3d>& offsets_N() const { return fit_.offsets_N; }
  /// The effects that are in `names`, with values.
  std::vector<stability::EffectSpec> specs(const std::set<std::string>& names) const;

 private:
  /// Sums of a vehicle's blocks.
  struct Sum {
    Eigen::VectorXd gram, b;
    double y = 0;
  };
  /// One effect of a joint fit, with the shape that it has now.
  struct Part {
    Candidate candidate;
    std::vector<double> shape, step;
    std::vector<double> proposal;  ///< one more theta to try: where the parabolas of all parameters meet
    std::vector<double> coefficients;
  };

  /// The best theta of effect `i` beside the others; where its shape goes next, and how far.
  void choose(const Grams& grams, const std::map<std::string, Sum>& sums, std::size_t i,
              std::vector<std::size_t>& chosen);
  void step(bool moves);
  /// The others are neighbours and nothing else.
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
