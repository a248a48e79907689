#include "analysis/identification/rotor_response.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace swarmcert::identification {
namespace {

/// Long enough for the rates to exceed their noise, and shorter than an attitude loop takes to react.
constexpr double kResponseWindow_s = 0.03;
constexpr double kFewestWindows = 200;

/// The forces of the motors of a log after a lag, in shares of the weight.
class LaggedForces {
 public:
  LaggedForces(const logs::Log& log, double lag_s) : log_(log), lag_s_(lag_s) {}

  /// Goes on to record `i`, which follows the last one unless `restarts`.
  const Eigen::VectorXd& at(std::size_t i, bool restarts) {
    Eigen::VectorXd force(log_.signals.motor_commands);
    for (Eigen::Index k = 0; k < force.size(); ++k) {
      const auto command = static_cast<double>(log_.samples[i].motor_command[static_cast<std::size_t>(k)]);
      force[k] = std::pow(command / log_.hover_command, log_.motor_power);
    }
    const double step_s = restarts ? 0 : 1e-6 * (log_.samples[i].time_us - log_.samples[i - 1].time_us);
    const bool is_direct = restarts || lag_s_ == 0;
    lagged_ = is_direct ? force : Eigen::VectorXd(force + std::exp(-step_s / lag_s_) * (lagged_ - force));
    return lagged_;
  }

 private:
  const logs::Log& log_;
  const double lag_s_;
  Eigen::VectorXd lagged_;
};

/// Sums of the regression; the last unknown is the offset.
struct ResponseSums {
  Eigen::MatrixXd gram;  ///< [unknowns x unknowns]
  Eigen::MatrixXd b;     ///< [unknowns x 3]
  Eigen::Vector3d square = Eigen::Vector3d::Zero();
  double windows = 0;
};

ResponseSums sums_of(const logs::Log& log, const std::vector<char>& is_airborne, double lag_s) {
  const Eigen::Index motors = log.signals.motor_commands;
  ResponseSums sums = {Eigen::MatrixXd::Zero(motors + 1, motors + 1), Eigen::MatrixXd::Zero(motors + 1, 3)};
  const auto rates = [&](std::size_t i) {
    const logs::Vector& w = log.samples[i].rates_rad_s;
    return Eigen::Vector3d(w[0], w[1], w[2]);
  };
  LaggedForces forces(log, lag_s);
  Eigen::VectorXd integral = Eigen::VectorXd::Zero(motors + 1), before;
  std::size_t first = 0;
  for (std::size_t i = 0; i < log.samples.size(); ++i) {
    const bool restarts = i == 0 || log.samples[i].restarts || is_airborne[i] == 0;
    const Eigen::VectorXd now = forces.at(i, restarts);
    if (!restarts) {
      const double step_s = 1e-6 * (log.samples[i].time_us - log.samples[i - 1].time_us);
      integral.head(motors) += step_s / 2 * (before + now);
      integral[motors] += step_s;
    }
    before = now;
    const bool is_full = integral[motors] >= kResponseWindow_s;
    const Eigen::Vector3d change = rates(i) - rates(first);
    if (is_full && change.allFinite()) {
      sums.gram += integral * integral.transpose();
      sums.b += integral * change.transpose();
      sums.square += change.cwiseAbs2();
      ++sums.windows;
    }
    if (!is_full && !restarts) continue;
    first = i;
    integral.setZero();
  }
  return sums;
}

bool is_sure(const RotorResponse& response, int axis) {
  constexpr double kSurely = 5;
  const auto gain = response.gain_rad_s2.row(axis).cwiseAbs().array();
  return (gain > kSurely * response.standard_error.row(axis).array()).all();
}

/// Front right or back left.
bool is_on_first_diagonal(const stability::RotorPlace& rotor) { return (rotor.x_m > 0) == (rotor.y_m < 0); }

}  // namespace

std::optional<RotorResponse> rotor_response(const logs::Log& log, const std::vector<char>& is_airborne) {
  std::optional<RotorResponse> best;
  double least = 1;
  for (const double lag_s : {0.0, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1}) {
    const ResponseSums sums = sums_of(log, is_airborne, lag_s);
    const Eigen::LDLT<Eigen::MatrixXd> solver(sums.gram);
    constexpr double kTogether = 1e-12;
    if (sums.windows < kFewestWindows || !(solver.rcond() > kTogether)) return {};
    const Eigen::MatrixXd c = solver.solve(sums.b);
    const Eigen::Vector3d left = sums.square - (c.transpose() * sums.b).diagonal();
    const double share = left.cwiseQuotient(sums.square).mean();
    if (share >= least) continue;
    least = share;
    const Eigen::Index unknowns = sums.gram.rows();
    const Eigen::VectorXd spread =
        solver.solve(Eigen::MatrixXd::Identity(unknowns, unknowns)).diagonal().cwiseSqrt();
    const Eigen::Vector3d noise = (left / (sums.windows - static_cast<double>(unknowns))).cwiseSqrt();
    best = RotorResponse{c.topRows(unknowns - 1).transpose(), noise * spread.head(unknowns - 1).transpose()};
  }
  return best;
}

std::vector<stability::RotorPlace> places_of(const RotorResponse& response, double arm_m) {
  const Eigen::Matrix3Xd& gain = response.gain_rad_s2;
  if (gain.cols() != 4 || !is_sure(response, 0) || !is_sure(response, 1)) return {};
  const double d = arm_m * std::sqrt(0.5);
  std::vector<stability::RotorPlace> rotors;
  std::set<std::pair<bool, bool>> quadrants;
  // The torque of a force F along z at (x, y) is (y F, -x F); a counterclockwise rotor turns the body clockwise.
  for (Eigen::Index k = 0; k < gain.cols(); ++k) {
    const bool is_left = gain(0, k) > 0, is_front = gain(1, k) < 0;
    quadrants.insert({is_left, is_front});
    rotors.push_back({is_front ? d : -d, is_left ? d : -d, 0, gain(2, k) < 0});
  }
  if (quadrants.size() != 4) return {};
  const auto agrees = [](const stability::RotorPlace& rotor) {
    return is_on_first_diagonal(rotor) == rotor.counterclockwise;
  };
  const auto agreeing = std::count_if(rotors.begin(), rotors.end(), agrees);
  if (is_sure(response, 2) && (agreeing == 0 || agreeing == 4)) return rotors;
  for (stability::RotorPlace& rotor : rotors) rotor.counterclockwise = is_on_first_diagonal(rotor);
  return rotors;
}

}  // namespace swarmcert::identification
