/// @file The vertical force on one vehicle as a function of the positions of the others, for shifts of their clocks.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <map>
#include <vector>

#include "analysis/identification/scan/curve_fit.h"
#include "analysis/residuals/track.h"

namespace swarmcert::identification {

inline constexpr double kClockSample_s = 0.05;  ///< averaging time of the forces
inline constexpr double kClockStep_s = 0.02;    ///< step of the shifts
inline constexpr int kClockSteps = 20;          ///< most steps between two clocks, in either direction
inline constexpr int kWakeSteps = 15;           ///< most steps for the arrival of a wake
inline constexpr int kClockTenths = 10;         ///< parts of a flight that are left out in turn

/// Maps from a neighbour's relative position to the vertical force, one per kind of neighbour, fitted to the sum over
/// all neighbours, where each neighbour is read at the vehicle's time plus a shift.
class Interplay {
 public:
  static constexpr int kAbsent = std::numeric_limits<int>::min();
  /// @param r force_residual() of `own`, in W
  /// @param others vehicles on the clock of `own`, except for the unknown shifts
  Interplay(const residuals::Track& own, const std::vector<Eigen::Vector3d>& r,
            const std::vector<const residuals::Track*>& others);

  int size() const { return static_cast<int>(force_N_.size()); }
  bool is_rich() const;
  /// Returns the sum of squares about the mean, N^2.
  double total() const;
  /// Returns the part of total() explained by the maps, N^2. Results are cached.
  /// @param shifts  of each of the others, in steps from -kClockSteps - kWakeSteps to kClockSteps, or kAbsent
  /// @param without the tenth of the flight to leave out; -1: none
  double explained(const std::vector<int>& shifts, int without = -1);

 private:
  struct Path {
    std::vector<double> time_s;
    std::vector<Eigen::Vector3d> p_m;
    int map = 0;                                 ///< index of the map of its kind
    std::map<int, std::vector<SparseRow>> rows;  ///< by shift, filled on demand
  };
  /// Sums of a least squares fit over a tenth of the flight.
  struct Sums {
    Eigen::MatrixXd gram;
    Eigen::VectorXd b, columns;
    double sum = 0, count = 0;
  };

  void read(const residuals::Track& own, const std::vector<Eigen::Vector3d>& r);
  void keep_what_every_shift_knows();
  const std::vector<SparseRow>& rows_at(Path& path, int shift) const;
  std::vector<Sums> sums_at(const std::vector<int>& shifts);
  double fitted_to(const std::vector<Sums>& tenths, int without) const;

  std::vector<double> time_s_, force_N_;
  std::vector<Eigen::Vector3d> own_m_;
  std::vector<Path> others_;
  int maps_ = 0;
  std::map<std::vector<int>, double> of_all_;                             ///< explained(), by shifts
  std::map<std::vector<int>, std::array<double, kClockTenths>> without_;  ///< the same without each tenth
};

}  // namespace swarmcert::identification
