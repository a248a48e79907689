/// @file A model against flights: how large the force residual is, of whom, when and where.
#pragma once

#include <array>
#include <functional>
#include <map>
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

/// Errors of one group of records.
struct GroupErrors {
  ErrorStatistics statistics;
  std::array<Interval, 4> rmse_interval;  ///< 90 %, of x, y, z, total, from blocks of 2 s
  Axes nrmse;                             ///< rmse over the vehicles' mean weight
  Eigen::Vector3d low_band_to_floor = Eigen::Vector3d::Zero();  ///< Spectrum::low_band_to_floor()
  Eigen::Vector3d noise_floor_N = Eigen::Vector3d::Zero();
};

struct Moment {
  std::string flight, vehicle, path;
  double time_s = 0;                                     ///< of the log's clock
  Eigen::Vector3d residual_N = Eigen::Vector3d::Zero();  ///< mean over 0.1 s
};

/// One vehicle in one flight.
struct TrackErrors : TrackHead {
  std::string composition;                                               ///< see Comparison::compositions
  std::array<std::size_t, static_cast<std::size_t>(Cut::kCount)> cut{};  ///< records by what became of them
  double used_s = 0;                  ///< between used records that follow each other
  std::vector<std::string> findings;  ///< what was wrong with the log
  bool is_sound = true;               ///< nothing in the log is damaged; gaps in time are no damage
  GroupErrors errors;
  TrajectoryErrors trajectory;
  TorqueErrors torque;
  std::vector<std::array<float, 5>> series;  ///< every second used record: time, residual x, y, z, nominal z
};

struct RegionErrors {
  int variable = 0, region = 0;
  std::string words;  ///< "height below 0.08 m: +3.5 gf"
  double share = 0;   ///< of all squared residual that this region's bias explains
  ErrorStatistics statistics;
};

/// Vertical residual over the place of the neighbour that is laterally nearest among those within 1 m in height.
struct NeighbourMap {
  static constexpr int kLateral = PlaceGrid::kLateral, kHeights = PlaceGrid::kHeights;
  static constexpr double kLateralStep_m = PlaceGrid::kLateralStep_m,
                          kHeightStep_m = PlaceGrid::kHeightStep_m, kLowest_m = PlaceGrid::kLowest_m;
  struct Cell {
    std::size_t records = 0;
    double sum_N = 0, squares_N2 = 0;
  };
  /// [height of the neighbour above the vehicle, from kLowest_m up][lateral distance, from 0]
  std::array<std::array<Cell, kLateral>, kHeights> cells{};
};

/// The second level over all tracks that have it.
struct Trajectories {
  std::string refused;  ///< why no track has it; else empty
  std::size_t tracks = 0, diverged = 0;
  double seconds = 0;
  Axes rmse_m, max_m;                    ///< simulated minus measured position, weighted by seconds
  Axes measured_rms_m, simulated_rms_m;  ///< from the set point
  /// Largest measured error over the largest replayed one, per track; of tracks that did not diverge.
  struct PeakRatio {
    Axes p50, p95, max;
    Axes coverage;  ///< share of tracks whose replayed peak is at least the measured one
    std::size_t tracks = 0;
  } peak_ratio;
};

struct Comparison {
  /// 1 for the axes along which every compared track lets a force be judged, 0 for the others: their errors are zero.
  Eigen::Vector3d judged = Eigen::Vector3d::Ones();
  GroupErrors overall;
  std::vector<TrackErrors> tracks;  ///< in order of flights and vehicles
  std::map<std::string, GroupErrors> scenarios, vehicles, kinds;
  /// By kinds of the neighbours, then of the vehicle, as initials: "SL2S"; "Ge2S" flies alone, over the ground. Kinds
  /// with one initial are written out: "small+slow2small".
  std::map<std::string, GroupErrors> compositions;
  std::vector<RegionErrors> regions;  ///< worst first
  std::vector<Moment> moments;        ///< worst first
  LearningError learning_error;
  Trajectories trajectories;
  NeighbourMap neighbours;
  std::vector<std::string> problems;  ///< logs that could not be read or have no force, and why
};

/// Shows progress: flights done of all.
using Progress = std::function<void(int done, int total)>;

/// gains.toml by kind of vehicle; "" stands for every kind without its own.
using GainsOfKinds = std::map<std::string, stability::Gains>;

/// Compares. The result does not depend on `jobs`.
/// @param gains of the second level, for the kinds that have them.
/// @throws files::InputError if gains cannot be flown at 500 Hz.
/// @param visit if there is one, is shown each track as loaded, with the index of its flight: the tracks of a flight in
///   their order, several flights at a time. What else needs the tracks so needs no pass of its own.
Comparison compare(const Inputs& inputs, int jobs, const Progress& progress, const GainsOfKinds& gains = {},
                   const std::function<void(std::size_t flight, const Track& track)>& visit = nullptr);

/// What a search wants to know of a comparison.
struct Leftover {
  double rmse_N = 0;                                     ///< of all axes together
  Eigen::Vector3d low_band_to_floor, noise_floor_N;      ///< as of GroupErrors
  std::array<double, kNumVariables> region_shares = {};  ///< sum of RegionErrors::share, by variable
};

/// These numbers as compare() gives them for the same inputs, without the rest of its work; shares up to rounding.
Leftover left_over(const Inputs& inputs, int jobs);

}  // namespace swarmcert::residuals
