/// @file What set points can have caused: the instruments of the evidence.
///
/// A controller answers a gust with thrust, and the gust moves the vehicle: thrust and velocity are correlated with the
/// disturbance, and least squares take the answer for a cause. Only what set points command is not.
#pragma once

#include <Eigen/Core>
#include <array>
#include <mutex>
#include <string>
#include <vector>

#include "analysis/identification/evidence/spectral.h"
#include "analysis/identification/passes.h"

namespace swarmcert::evidence {

class Instruments {
 public:
  /// @param columns  number of explanations' columns
  /// @param vehicles that flew
  Instruments(const Spectral& spectral, Eigen::Index columns, std::vector<std::string> vehicles);

  /// Adds a track. May be called from several threads.
  /// @param first  index of the first stretch among all
  /// @param wanted the columns along the set points, by axis, [records x columns]; empty without set points
  void add(const identification::ModelledTrack& modelled, const std::vector<Stretch>& stretches,
           std::size_t first, const std::array<Eigen::MatrixXf, 3>& wanted);

  /// Returns the instruments of each axis, [rows x instruments]: set points at several lags with their powers, a
  /// constant per vehicle, and mixtures of the columns along the set points. Empty if a log has no set points.
  std::array<Eigen::MatrixXf, 3> of_axes() const;

 private:
  const Spectral& spectral_;
  const std::vector<std::string> vehicles_;
  std::mutex mutex_;
  bool is_complete_ = true;
  Eigen::MatrixXf commanded_;  ///< [rows x signals]
  std::array<Eigen::MatrixXf, 3> wanted_;
};

}  // namespace swarmcert::evidence
