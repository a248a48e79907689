/// @file The vertical force on one vehicle as a function of the positions of the others, for shifts of their clocks.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "analysis/identification/scan/curve_fit.h"
#include "analysis/residuals/track.h"

namespace swarmcert::identification {

inline constexpr double kClockSample_s = 0.05;  ///< averaging time of the forces
inline constexpr double kClockStep_s = 0.02;    ///< step of the shifts
inline constexpr int kClockSteps = 20;          ///< most steps between two clocks, in either direction
inline constexpr int kWakeSteps = 15;           ///< most steps for the arrival of a wake
inline constexpr int kClockTenths = 10;         ///< parts of a flight that are left out in turn

/// The vertical force on a vehicle, averaged over kClockSample_s.
struct ForceRecords {
  std::vector<double> time_s, force_N;
  std::vector<Eigen::Vector3d> p_m;  ///< own position

  int size() const { return static_cast<int>(force_N.size()); }
};
/// @param r force_residual() of `own`, in W
/// @param everywhere also uses records that are cut only because a neighbour's position is unknown there
ForceRecords force_records(const residuals::Track& own, const std::vector<Eigen::Vector3d>& r,
                           bool everywhere);

/// The positions in a log, by its own clock.
struct LoggedPath {
  std::vector<double> time_s;
  std::vector<Eigen::Vector3d> p_m;

  explicit LoggedPath(const residuals::Track& track);
  /// Returns the interpolated position; nothing outside the log or in a gap.
  std::optional<Eigen::Vector3d> at(double time_s) const;
};

/// Returns the number of columns of the map of one kind of neighbour.
Eigen::Index interplay_columns();
/// Returns the rows of the map at relative positions, given as lateral distances and heights; NaN: an empty row.
std::vector<SparseRow> interplay_rows(const Eigen::VectorXf& lateral_m, const Eigen::VectorXf& height_m);

/// Sums of a least squares fit of the maps and a constant.
struct InterplaySums {
  Eigen::MatrixXd gram;
  Eigen::VectorXd b, columns;
  double sum = 0, count = 0;

  explicit InterplaySums(Eigen::Index size)
      : gram(Eigen::MatrixXd::Zero(size, size)),
        b(Eigen::VectorXd::Zero(size)),
        columns(Eigen::VectorXd::Zero(size)) {}
  void add(const std::vector<std::pair<Eigen::Index, double>>& row, double force_N);
  InterplaySums& operator+=(const InterplaySums& other);
  /// Returns the part of the sum of squares about the mean that the maps explain, N^2.
  double explained() const;
};

/// Maps from a neighbour's relative position to the vertical force, one per kind of neighbour, fitted to the sum over
/// all neighbours, where each neighbour is read at the vehicle's time plus a shift.
class Interplay {
 public:
  static constexpr int kAbsent = std::numeric_limits<int>::min();
  /// @param r force_residual() of `own`, in W
  /// @param others vehicles on the clock of `own`, except for the unknown shifts
  Interplay(const residuals::Track& own, const std::vector<Eigen::Vector3d>& r,
            const std::vector<const residuals::Track*>& others);

  int size() const { return records_.size(); }
  bool is_rich() const;
  /// Returns the sum of squares about the mean, N^2.
  double total() const;
  /// Returns the part of total() explained by the maps, N^2. Results are cached.
  /// @param shifts  of each of the others, in steps from -kClockSteps - kWakeSteps to kClockSteps, or kAbsent
  /// @param without the tenth of the flight to leave out; -1: none
  double explained(const std::vector<int>& shifts, int without = -1);

 private:
  struct Path {
    LoggedPath logged;
    int map = 0;                                 ///< index of the map of its kind
    std::map<int, std::vector<SparseRow>> rows;  ///< by shift, filled on demand
  };
  void keep_what_every_shift_knows();
  const std::vector<SparseRow>& rows_at(Path& path, int shift) const;
  /// Returns the sums over each tenth of the flight.
  std::vector<InterplaySums> sums_at(const std::vector<int>& shifts);
  double fitted_to(const std::vector<InterplaySums>& tenths, int without) const;

  ForceRecords records_;
  std::vector<Path> others_;
  int maps_ = 0;
  std::map<std::vector<int>, double> of_all_;                             ///< explained(), by shifts
  std::map<std::vector<int>, std::array<double, kClockTenths>> without_;  ///< the same without each tenth
};

}  // namespace swarmcert::identification
