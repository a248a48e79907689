/// @file What explanations predict along a track, record by record.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "analysis/identification/block_grams.h"
#include "analysis/identification/evidence/curve.h"
#include "analysis/identification/evidence/spectral.h"
#include "analysis/identification/passes.h"
#include "analysis/identification/scan/samples.h"

namespace swarmcert::evidence {

/// Where the force of a curve points.
enum class Frame {
  kWorld,    ///< along an axis of the world
  kBody,     ///< of the body
  kVelocity  ///< along the velocity: a drag of any form
};

/// A free curve: its variable, and the direction of its force.
struct CurveOver {
  identification::ScanVariable variable;
  Frame frame;
  int axis;
  Curve curve;

  Eigen::Vector3d direction(const stability::Instant& now) const;
};

/// The stretches of a track, and where they stand among those of all tracks.
struct PlacedTrack {
  std::vector<Stretch> stretches;  ///< within the track
  std::size_t first_stretch = 0;   ///< among all
};

/// The stretches of all flights, and curves over every variable that changes in them.
struct Survey {
  std::vector<std::vector<PlacedTrack>> tracks;  ///< by flight
  std::vector<Stretch> stretches;
  std::vector<CurveOver> curves;
  std::vector<std::string> vehicles;  ///< that flew
};
Survey survey(const identification::Passes& passes);

/// The forces in W of the columns of effects, of curves, of forces along the axes of the body, constant (3) and in
/// proportion to the thrust (2, and one that is 0), and the residual, as the log would show them.
class TrackColumns {
 public:
  /// @param grams    defines the columns of effects
  /// @param instants the track's, or others at the same times
  TrackColumns(const identification::Passes& passes, const identification::ModelledTrack& modelled,
               const identification::Grams& grams, const std::vector<CurveOver>& curves,
               const std::vector<stability::Instant>& instants);

  static Eigen::Index width(const identification::Grams& grams, const std::vector<CurveOver>& curves) {
    return body_column(grams, curves) + 6;
  }
  /// Returns the first column of the forces along the axes of the body.
  static Eigen::Index body_column(const identification::Grams& grams, const std::vector<CurveOver>& curves) {
    return grams.columns + static_cast<Eigen::Index>(curves.size()) * Curve::kSize;
  }
  /// Components along an axis, [records x (width() and the residual)].
  const Eigen::MatrixXf& along(int axis) const { return values_[static_cast<std::size_t>(axis)]; }

 private:
  void add_effects(const identification::Passes& passes, const identification::ModelledTrack& modelled,
                   const identification::Grams& grams, const std::vector<stability::Instant>& instants);
  void add_curves(const identification::Passes& passes, const identification::ModelledTrack& modelled,
                  const std::vector<CurveOver>& curves, const std::vector<stability::Instant>& instants);

  std::array<Eigen::MatrixXf, 3> values_;
};

/// Returns the columns along the set points, without the residual; empty without set points.
std::array<Eigen::MatrixXf, 3> wanted_columns(const identification::Passes& passes,
                                              const identification::ModelledTrack& modelled,
                                              const identification::Grams& grams,
                                              const std::vector<CurveOver>& curves);

}  // namespace swarmcert::evidence
