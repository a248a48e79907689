/// @file Compares a model with flights: the force residual by vehicle, flight, time and flight regime.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "analysis/residuals/learning_error.h"
#include "analysis/residuals/place_residual.h"
#include "analysis/residuals/regions.h"
#include "analysis/residuals/statistics.h"
#include "analysis/residuals/torque_residual.h"
#include "analysis/residuals/trajectory.h"

namespace swarmcert::residuals {

/// Errors of a group of records.
struct GroupErrors {
  ErrorStatistics statistics;
  /// 90 %, of x, y, z, total, from blocks of 2 s; nothing if they are too few.
  std::optional<std::array<Interval, 4>> rmse_interval;
  Axes nrmse;  ///< rmse divided by the mean weight of the vehicles
  Eigen::Vector3d low_band_to_floor = Eigen::Vector3d::Zero();  ///< Spectrum::low_band_to_floor()
  Eigen::Vector3d noise_floor_N = Eigen::Vector3d::Zero();
};

struct Moment {
  std::string flight, vehicle, path;
  double time_s = 0;                                     ///< on the log's clock
  Eigen::Vector3d residual_N = Eigen::Vector3d::Zero();  ///< mean over 0.1 s
};

/// Errors of one vehicle in one flight.
struct TrackErrors : TrackHead {
  std::string composition;                                               ///< see Comparison::compositions
  std::string composition_words;                                         ///< "small with large and small"
  std::array<std::size_t, static_cast<std::size_t>(Cut::kCount)> cut{};  ///< number of records per cut
  double used_s = 0;                  ///< sum of the steps between consecutive used records
  std::vector<std::string> findings;  ///< what was wrong with the log
  bool is_sound = true;               ///< nothing in the log is damaged; time gaps are not damage
  GroupErrors errors;
  TrajectoryErrors trajectory;
  TorqueErrors torque;
  std::vector<std::array<float, 5>> series;  ///< every second used record: time, residual x, y, z, nominal z
};

struct RegionErrors {
  int variable = 0, region = 0;
  std::string name;  ///< region_name(), or that of one of PlaceSquares
  double share = 0;  ///< fraction of the total squared residual explained by this region's bias
  ErrorStatistics statistics;
};

/// The squares, a power of two of metres wide, by which places over the ground are told apart: few along x and along y.
struct PlaceSquares {
  double width_m = 0;
  int first[2] = {0, 0},
      count[2] = {0, 0};  ///< along x and y; the first begins at first * width_m; none: no position
};

/// Vertical residual as a function of the relative position of the neighbour that is laterally closest among those
/// within 1 m in height.
struct NeighbourMap {
  static constexpr int kLateral = PlaceGrid::kLateral, kHeights = PlaceGrid::kHeights;
  static constexpr double kLateralStep_m = PlaceGrid::kLateralStep_m,
                          kHeightStep_m = PlaceGrid::kHeightStep_m, kLowest_m = PlaceGrid::kLowest_m;
  struct Cell {
    std::size_t records = 0;
    double sum_N = 0, squares_N2 = 0;
  };
  /// [height of the neighbour above the vehicle, starting at kLowest_m][lateral distance, starting at 0]
  std::array<std::array<Cell, kLateral>, kHeights> cells{};
};

/// Results of the second level (closed-loop simulation) over all tracks that have it.
struct Trajectories {
  std::string refused;  ///< why no track has it; otherwise empty
  std::size_t tracks = 0, diverged = 0;
  double seconds = 0;
  Axes rmse_m, max_m;                    ///< simulated minus measured position, weighted by seconds
  Axes measured_rms_m, simulated_rms_m;  ///< distance from the setpoint
  /// Ratio of the largest measured error to the largest replayed one, per track, over tracks that did not diverge.
  struct PeakRatio {
    Axes p50, p95, max;
    Axes coverage;  ///< fraction of tracks whose replayed peak is at least the measured one
    std::size_t tracks = 0;
  } peak_ratio;
};

struct Comparison {
  /// 1 for axes along which a force can be judged in all compared tracks; 0 for the others, whose errors are zero.
  Eigen::Vector3d judged = Eigen::Vector3d::Ones();
  GroupErrors overall;
  std::vector<TrackErrors> tracks;  ///< in order of flights and vehicles
  std::map<std::string, GroupErrors> scenarios, vehicles, kinds;
  /// Errors by the kinds of the neighbours and of the vehicle, written as initials: "SL2S"; "Ge2S" flies alone over the
  /// ground. If two kinds share an initial, kinds are written out: "small+slow2small".
  std::map<std::string, GroupErrors> compositions;
  std::map<std::string, std::string> composition_words;  ///< by the same names: "small alone"
  std::vector<RegionErrors> regions;  ///< worst first; those of kPlaceVariable are `squares`, x fastest
  PlaceSquares squares;
  std::vector<Moment> moments;  ///< worst first
  LearningError learning_error;
  Trajectories trajectories;
  NeighbourMap neighbours;
  std::vector<std::string> problems;  ///< logs that could not be read or give no force, and why
};

/// Reports progress: number of flights done, out of all flights.
using Progress = std::function<void(int done, int total)>;

/// gains.toml by kind of vehicle; "" applies to every kind without an entry of its own.
using GainsOfKinds = std::map<std::string, stability::Gains>;

/// Compares the models with the flights. The result does not depend on `jobs`.
/// @param gains for the second level, for the kinds that have them
/// @param visit if set, is called with each track as loaded and the index of its flight: the tracks of a flight in
///   order, several flights concurrently. This saves other users of the tracks a pass of their own.
/// @throws files::InputError if gains cannot be flown at 500 Hz.
Comparison compare(const Inputs& inputs, int jobs, const Progress& progress, const GainsOfKinds& gains = {},
                   const std::function<void(std::size_t flight, const Track& track)>& visit = nullptr);

/// The parts of a comparison that a search needs.
struct Leftover {
  double rmse_N = 0;                                     ///< of all axes together
  Eigen::Vector3d low_band_to_floor, noise_floor_N;      ///< as in GroupErrors
  SpectralLine line;                                     ///< Spectrum::line()
  std::array<double, kNumVariables> region_shares = {};  ///< sum of RegionErrors::share, by variable
};

/// Returns the same numbers as compare() for the same inputs (shares up to round-off), without the rest of its work,
/// and the line of the spectrum.
Leftover left_over(const Inputs& inputs, int jobs);

}  // namespace swarmcert::residuals
