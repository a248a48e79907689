#include "analysis/identification/scan/samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "analysis/identification/column_run.h"
#include "analysis/identification/instrument.h"
#include "analysis/identification/remainder.h"
#include "analysis/identification/scan/balance_columns.h"
#include "analysis/residuals/force_residual.h"
#include "nn/base/parallel.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;
using stability::Instant;

constexpr double kMean_s = 0.1;
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr double kHeightOfNeighbours_m = 1.5;

using Values = ScanValues;

double& at(Values& values, ScanVariable variable) { return values[static_cast<std::size_t>(variable)]; }

/// Sums over one sample.
struct Sum {
  Values values{}, commanded{};
  Eigen::VectorXd residual;
  double cos_heading = 0, sin_heading = 0, cos_commanded = 0, sin_commanded = 0;
  int count = 0;
};

struct TrackSamples {
  std::vector<Values> values, commanded;
  std::vector<Eigen::VectorXd> residual;
  std::vector<std::array<float, 9>> axes;
  std::vector<std::array<float, NeighbourPlaces::kLags>> lateral_m, height_m;
  std::vector<std::array<float, std::size_t{3} * NeighbourPlaces::kLags>> velocity_m_s;
  /// Horizontal unit vector to the nearest neighbour; zero if there is none.
  std::vector<Eigen::Vector2f> toward;
  std::vector<int> block;
  int blocks = 0;
  double squares_N2 = 0;
  std::size_t records = 0;
};

double heading_of(const Eigen::Matrix3d& R) { return std::atan2(R(1, 0), R(0, 0)); }

/// Returns the wind velocity implied by a constant force and a linear drag; NaN without such a pair.
Eigen::Vector3d wind_of(const stability::Model& model) {
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
  double drag_N_s_m = 0;
  for (const stability::EffectSpec& spec : model.effects) {
    if (spec.is_expression()) continue;
    const stability::EffectInfo& info = stability::effect_info(spec.name);
    const std::vector<double> values = stability::effect_values(info, spec).linear;
    if (info.traits.family == stability::Family::kPush && spec.vehicle.empty())
      force_N += Eigen::Vector3d(values[0], values[1], 0);
    if (info.traits.drag_exponent == 1) drag_N_s_m += values[0];
  }
  if (force_N.isZero() || !(drag_N_s_m > 0))
    return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  return force_N / drag_N_s_m;
}

void set_motion(const Instant& now, Values& to) {
  using V = ScanVariable;
  const Eigen::Vector3d v_B_m_s = now.R_WB.transpose() * now.v_W_m_s;
  for (int axis = 0; axis < 3; ++axis) {
    const auto offset = static_cast<std::size_t>(axis);
    to[static_cast<std::size_t>(V::kX) + offset] = now.p_W_m[axis];
    to[static_cast<std::size_t>(V::kVx) + offset] = now.v_W_m_s[axis];
    to[static_cast<std::size_t>(V::kBodyVx) + offset] = v_B_m_s[axis];
    to[static_cast<std::size_t>(V::kRateX) + offset] = now.omega_B_rad_s[axis];
  }
  at(to, V::kSpeed) = now.v_W_m_s.norm();
  at(to, V::kClimb) = now.v_W_m_s.dot(now.b3_W());
  at(to, V::kHeading) = heading_of(now.R_WB);
  at(to, V::kTilt) = std::acos(std::clamp(now.R_WB(2, 2), -1.0, 1.0));
  at(to, V::kThrust) = now.thrust_N;
  at(to, V::kBattery) = now.battery_V;
  at(to, V::kTime) = now.time_s;
}

/// Returns the laterally nearest neighbour among those within kHeightOfNeighbours_m in height; null if there is none.
const stability::Neighbour* nearest_neighbour(const Instant& then, const Eigen::Vector3d& to_W_m) {
  const stability::Neighbour* nearest = nullptr;
  double least_m = std::numeric_limits<double>::infinity();
  for (int j = 0; j < then.num_neighbours; ++j) {
    const Eigen::Vector3d dp_m = then.p_W_m + then.neighbours[j].dp_W_m - to_W_m;
    const double distance_m = dp_m.head<2>().norm();
    if (std::abs(dp_m.z()) > kHeightOfNeighbours_m || !(distance_m < least_m)) continue;
    least_m = distance_m;
    nearest = &then.neighbours[j];
  }
  return nearest;
}

void set_neighbour(const Instant& now, Values& to) {
  using V = ScanVariable;
  const stability::Neighbour* const nearest = nearest_neighbour(now, now.p_W_m);
  const Eigen::Vector3d unknown = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Eigen::Vector3d dp_m = nearest == nullptr ? unknown : nearest->dp_W_m;
  const Eigen::Vector3d dv_m_s = nearest == nullptr ? unknown : nearest->dv_W_m_s;
  at(to, V::kNeighbourX) = dp_m.x();
  at(to, V::kNeighbourY) = dp_m.y();
  at(to, V::kNeighbourVx) = dv_m_s.x();
  at(to, V::kNeighbourVy) = dv_m_s.y();
  at(to, V::kNeighbourVz) = dv_m_s.z();
}

/// Returns the residual force at each record, [6 x records].
Eigen::MatrixXd force_columns(const stability::Model& model, const residuals::Inputs& inputs,
                              const Track& track) {
  const auto left_N = residuals::force_residual(model, inputs.kinds, inputs.rules, track);
  Eigen::MatrixXd columns(6, static_cast<Eigen::Index>(left_N.size()));
  for (std::size_t i = 0; i < left_N.size(); ++i)
    columns.col(static_cast<Eigen::Index>(i)) << left_N[i], track.instants[i].R_WB.transpose() * left_N[i];
  return columns;
}

class TrackSampler {
 public:
  TrackSampler(const residuals::Inputs& inputs, const Track& track, ScanQuantity quantity)
      : model_(inputs.model_for(track)),
        track_(track),
        quantity_(quantity),
        residual_(quantity == ScanQuantity::kForce ? force_columns(model_, inputs, track)
                                                   : balance_columns(model_, inputs, track)),
        cut_(cut_into_blocks(track)),
        wind_m_s_(wind_of(model_)) {
    if (track.targets.size() == track.instants.size()) wanted_ = as_commanded(track, model_.mass_kg);
  }

  TrackSamples run() {
    if (residual_.cols() == 0) return std::move(result_);
    result_.blocks = static_cast<int>(cut_.blocks.size());
    sum_.residual = Eigen::VectorXd::Zero(residual_.rows());
    int block = -1;
    double start_s = 0;
    for (std::size_t i = 0; i < track_.instants.size(); ++i) {
      const int own = cut_.of_record[i] >= 0 ? cut_.of_record[i] : block;
      const double now_s = track_.instants[i].time_s;
      const bool is_used = track_.cut[i] == residuals::Cut::kNone && own >= 0;
      if (!is_used || own != block || now_s - start_s >= kMean_s) {
        close(block);
        start_s = now_s;
      }
      if (!is_used) continue;
      block = own;
      if (residual_.col(static_cast<Eigen::Index>(i)).allFinite()) add(i);
    }
    close(block);
    return std::move(result_);
  }

 private:
  void add(std::size_t i) {
    using V = ScanVariable;
    const Instant& now = track_.instants[i];
    Values values = scan_values(now), commanded;
    commanded.fill(std::numeric_limits<double>::quiet_NaN());
    at(values, V::kAirspeed) = (now.v_W_m_s - wind_m_s_).norm();
    for (std::size_t r = 0; r < 4; ++r) values[static_cast<std::size_t>(V::kDuty1) + r] = track_.duty[i][r];
    if (!wanted_.empty()) {
      const Instant& wanted = wanted_[i];
      set_motion(wanted, commanded);
      at(commanded, V::kAirspeed) = (wanted.v_W_m_s - wind_m_s_).norm();
      const double duty = model_.thrust.pwm(wanted.thrust_N / 4, now.battery_V);
      for (const V rotor : {V::kDuty1, V::kDuty2, V::kDuty3, V::kDuty4}) at(commanded, rotor) = duty;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        values[static_cast<std::size_t>(V::kSetpointX) + axis] =
            track_.targets[i].p_W_m[static_cast<Eigen::Index>(axis)];
      }
    }
    for (const V v :
         {V::kHeading, V::kTime, V::kBattery, V::kSetpointX, V::kSetpointY, V::kSetpointZ, V::kRateZ})
      at(commanded, v) = std::numeric_limits<double>::quiet_NaN();
    // The attitude controller reacts to every rate with a torque, so setpoints cannot confirm a torque.
    if (quantity_ == ScanQuantity::kBalance)
      at(commanded, V::kRateX) = at(commanded, V::kRateY) = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t v = 0; v < values.size(); ++v) {
      sum_.values[v] += values[v];
      sum_.commanded[v] += commanded[v];
    }
    sum_.cos_heading += std::cos(at(values, V::kHeading));
    sum_.sin_heading += std::sin(at(values, V::kHeading));
    const auto residual = residual_.col(static_cast<Eigen::Index>(i));
    sum_.residual += residual;
    result_.squares_N2 += residual.head<3>().squaredNorm();
    ++result_.records;
    middle_ = sum_.count == 0 ? i : middle_ + (sum_.count % 2 == 0 ? 1 : 0);
    ++sum_.count;
  }

  void close(int block) {
    if (sum_.count == 0) return;
    const double n = sum_.count;
    for (double& value : sum_.values) value /= n;
    for (double& value : sum_.commanded) value /= n;
    at(sum_.values, ScanVariable::kHeading) = std::atan2(sum_.sin_heading, sum_.cos_heading);
    result_.values.push_back(sum_.values);
    result_.commanded.push_back(sum_.commanded);
    result_.residual.emplace_back(sum_.residual / n);
    const std::size_t middle = std::min(middle_, track_.instants.size() - 1);
    std::array<float, 9> axes{};
    for (std::size_t k = 0; k < 9; ++k) axes[k] = static_cast<float>(track_.instants[middle].R_WB.data()[k]);
    result_.axes.push_back(axes);
    result_.block.push_back(block);
    add_neighbours(middle);
    sum_ = {};
    sum_.residual = Eigen::VectorXd::Zero(residual_.rows());
  }

  /// Adds the past positions of neighbours relative to the vehicle's position at record `i`.
  void add_neighbours(std::size_t i) {
    std::array<float, NeighbourPlaces::kLags> lateral_m, height_m;
    std::array<float, std::size_t{3} * NeighbourPlaces::kLags> velocity_m_s;
    lateral_m.fill(kUnknown);
    height_m.fill(kUnknown);
    velocity_m_s.fill(kUnknown);
    Eigen::Vector2f toward = Eigen::Vector2f::Zero();
    std::size_t past = i;
    for (std::size_t lag = 0; lag < NeighbourPlaces::kLags; ++lag) {
      const double then_s =
          track_.instants[i].time_s - static_cast<double>(lag) * NeighbourPlaces::kLag_s + 1e-3;
      while (past > 0 && track_.instants[past].time_s > then_s && track_.restarts[past] == 0) --past;
      const Instant& then = track_.instants[past];
      const Eigen::Vector3d& own_W_m = track_.instants[i].p_W_m;
      const stability::Neighbour* const nearest = nearest_neighbour(then, own_W_m);
      if (nearest == nullptr) continue;
      const Eigen::Vector3d dp_m = then.p_W_m + nearest->dp_W_m - own_W_m;
      const double distance_m = dp_m.head<2>().norm();
      lateral_m[lag] = static_cast<float>(distance_m);
      height_m[lag] = static_cast<float>(dp_m.z());
      const Eigen::Vector3d dv_m_s = then.v_W_m_s + nearest->dv_W_m_s - track_.instants[i].v_W_m_s;
      for (std::size_t axis = 0; axis < 3; ++axis)
        velocity_m_s[3 * lag + axis] = static_cast<float>(dv_m_s[static_cast<Eigen::Index>(axis)]);
      if (lag == 0 && distance_m > 0) toward = (dp_m.head<2>() / distance_m).cast<float>();
    }
    result_.lateral_m.push_back(lateral_m);
    result_.height_m.push_back(height_m);
    result_.velocity_m_s.push_back(velocity_m_s);
    result_.toward.push_back(toward);
  }

  const stability::Model model_;
  const Track& track_;
  const ScanQuantity quantity_;
  const Eigen::MatrixXd residual_;
  const TrackBlocks cut_;
  const Eigen::Vector3d wind_m_s_;
  std::vector<Instant> wanted_;
  Sum sum_;
  std::size_t middle_ = 0;
  TrackSamples result_;
};

/// The commanded thrust depends on the model's mass, so differences of the means are removed.
void align_means(std::vector<Values>& commanded, const std::vector<Values>& values) {
  using V = ScanVariable;
  for (const V v : {V::kThrust, V::kDuty1, V::kDuty2, V::kDuty3, V::kDuty4}) {
    const auto k = static_cast<std::size_t>(v);
    double shift = 0;
    for (std::size_t i = 0; i < values.size(); ++i) shift += values[i][k] - commanded[i][k];
    shift /= static_cast<double>(std::max<std::size_t>(values.size(), 1));
    for (Values& c : commanded) c[k] += shift;
  }
}

/// Subtracts the mean of the track from its residuals.
void remove_trim(TrackSamples& track) {
  if (track.residual.empty()) return;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(track.residual[0].size());
  for (const Eigen::VectorXd& residual : track.residual) mean += residual;
  mean /= static_cast<double>(track.residual.size());
  for (Eigen::VectorXd& residual : track.residual) residual -= mean;
}

void append(const std::vector<std::vector<TrackSamples>>& pieces, ScanSamples& all) {
  Eigen::Index size = 0;
  for (const auto& piece : pieces) {
    for (const TrackSamples& track : piece) size += static_cast<Eigen::Index>(track.values.size());
  }
  all.values.resize(size, kNumScanVariables);
  all.commanded.resize(size, kNumScanVariables);
  all.residual.resize(size, static_cast<Eigen::Index>(scan_columns(all.quantity).size()));
  all.axes.resize(size, 9);
  all.neighbours.lateral_m.resize(size, NeighbourPlaces::kLags);
  all.neighbours.height_m.resize(size, NeighbourPlaces::kLags);
  all.neighbours.velocity_m_s.resize(size, 3 * NeighbourPlaces::kLags);
  Eigen::MatrixX2f toward(size, 2);
  Eigen::Index row = 0;
  for (const auto& piece : pieces) {
    for (const TrackSamples& track : piece) {
      for (std::size_t i = 0; i < track.values.size(); ++i, ++row) {
        for (int v = 0; v < kNumScanVariables; ++v) {
          all.values(row, v) = static_cast<float>(track.values[i][static_cast<std::size_t>(v)]);
          all.commanded(row, v) = static_cast<float>(track.commanded[i][static_cast<std::size_t>(v)]);
        }
        all.residual.row(row).head(track.residual[i].size()) = track.residual[i].cast<float>();
        toward.row(row) = track.toward[i];
        for (int k = 0; k < 9; ++k) all.axes(row, k) = track.axes[i][static_cast<std::size_t>(k)];
        for (int k = 0; k < NeighbourPlaces::kLags; ++k) {
          all.neighbours.lateral_m(row, k) = track.lateral_m[i][static_cast<std::size_t>(k)];
          all.neighbours.height_m(row, k) = track.height_m[i][static_cast<std::size_t>(k)];
        }
        for (int k = 0; k < 3 * NeighbourPlaces::kLags; ++k)
          all.neighbours.velocity_m_s(row, k) = track.velocity_m_s[i][static_cast<std::size_t>(k)];
        all.flight.push_back(all.flights);
        all.block.push_back(all.blocks + track.block[i]);
      }
      all.blocks += track.blocks;
    }
    ++all.flights;
  }
  if (all.quantity != ScanQuantity::kForce || size == 0) return;
  const auto horizontal = all.residual.leftCols<2>();
  const Eigen::RowVector2f mean = horizontal.colwise().mean();
  all.residual.col(kTowardColumn) =
      ((horizontal.rowwise() - mean).array() * toward.array()).rowwise().sum().matrix();
}

}  // namespace

const std::vector<ScanColumn>& scan_columns(ScanQuantity quantity) {
  static const std::vector<ScanColumn> kForces = {
      {"force", "world", "x", "N", "force_x_N"}, {"force", "world", "y", "N", "force_y_N"},
      {"force", "world", "z", "N", "force_z_N"}, {"force", "body", "x", "N", "force_b1_N"},
      {"force", "body", "y", "N", "force_b2_N"}, {"force", "body", "z", "N", "force_b3_N"},
      {"force", "neighbour", "toward", "N", ""}};
  static const std::vector<ScanColumn> kBalances = {
      {"torque", "body", "roll", "Nm", "torque_x_Nm"}, {"torque", "body", "pitch", "Nm", "torque_y_Nm"},
      {"torque", "body", "yaw", "Nm", "torque_z_Nm"},  {"rotor_force", "body", "rotor_1", "N", ""},
      {"rotor_force", "body", "rotor_2", "N", ""},     {"rotor_force", "body", "rotor_3", "N", ""},
      {"rotor_force", "body", "rotor_4", "N", ""}};
  return quantity == ScanQuantity::kForce ? kForces : kBalances;
}

ScanValues scan_values(const stability::Instant& now) {
  ScanValues values;
  values.fill(std::numeric_limits<double>::quiet_NaN());
  set_motion(now, values);
  set_neighbour(now, values);
  return values;
}

const ScanVariableInfo& scan_variable(ScanVariable variable) {
  // Neighbour positions are scanned as a map. Formulas over their velocities would not vanish far away.
  static const std::array<ScanVariableInfo, static_cast<std::size_t>(kNumScanVariables)> all = {{
      {"x", "x", "m", false, true, true},
      {"y", "y", "m", false, true, true},
      {"z", "z", "m", false, true, true},
      {"vx", "vx", "m_s", false, true, false},
      {"vy", "vy", "m_s", false, true, false},
      {"vz", "vz", "m_s", false, true, true},
      {"vx", "vbx", "m_s", false, false, true},
      {"vy", "vby", "m_s", false, false, true},
      {"vz", "vbz", "m_s", false, false, false},  // the same as `climb`
      {"speed", "speed", "m_s", false, true, true},
      {"airspeed", "", "m_s", false, true, true},
      {"climb", "climb", "m_s", false, true, true},
      {"heading", "heading", "rad", false, true, true},
      {"tilt", "tilt", "rad", true, true, true},
      {"thrust", "T", "N", true, true, true},
      {"duty_1", "", "", true, true, true},
      {"duty_2", "", "", true, true, true},
      {"duty_3", "", "", true, true, true},
      {"duty_4", "", "", true, true, true},
      {"battery", "V", "V", false, true, true},
      {"time", "t", "s", false, true, true},
      {"set_point_x", "", "m", false, true, true},
      {"set_point_y", "", "m", false, true, true},
      {"set_point_z", "", "m", false, true, true},
      {"rate_x", "wx", "rad_s", true, true, true},
      {"rate_y", "wy", "rad_s", true, true, true},
      {"rate_z", "wz", "rad_s", false, true, true},
      {"neighbour_x", "dx", "m", false, false, false},
      {"neighbour_y", "dy", "m", false, false, false},
      {"neighbour_vx", "", "m_s", false, true, false},
      {"neighbour_vy", "", "m_s", false, true, false},
      {"neighbour_vz", "", "m_s", false, true, false},
  }};
  return all[static_cast<std::size_t>(variable)];
}

bool ScanSamples::has_neighbours() const {
  for (Eigen::Index i = 0; i < neighbours.lateral_m.rows(); ++i) {
    if (!std::isnan(neighbours.lateral_m(i, 0))) return true;
  }
  return false;
}

ScanSamples thinned(const ScanSamples& samples, Eigen::Index most) {
  const Eigen::Index step = (samples.size() + most - 1) / most;
  if (step <= 1) return samples;
  ScanSamples few;
  few.quantity = samples.quantity;
  few.flights = samples.flights;
  few.blocks = samples.blocks;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < samples.size(); i += step) {
    kept.push_back(i);
    few.flight.push_back(samples.flight[static_cast<std::size_t>(i)]);
    few.block.push_back(samples.block[static_cast<std::size_t>(i)]);
  }
  few.values = samples.values(kept, Eigen::all);
  few.commanded = samples.commanded(kept, Eigen::all);
  few.residual = samples.residual(kept, Eigen::all);
  few.axes = samples.axes(kept, Eigen::all);
  few.neighbours.lateral_m = samples.neighbours.lateral_m(kept, Eigen::all);
  few.neighbours.height_m = samples.neighbours.height_m(kept, Eigen::all);
  few.neighbours.velocity_m_s = samples.neighbours.velocity_m_s(kept, Eigen::all);
  return few;
}

ScanSamples scan_samples(const Passes& passes, const std::vector<stability::EffectSpec>& specs,
                         ScanQuantity quantity) {
  const residuals::Inputs inputs = inputs_with(passes, specs);
  std::vector<std::vector<TrackSamples>> pieces(inputs.found.flights.size());
  files::parallel_for(static_cast<int>(pieces.size()), passes.jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    std::vector<std::string> problems;
    for (const Track& track : inputs.load(k, problems)) {
      if (track.position_only || track.kind != passes.kind) continue;
      pieces[k].push_back(TrackSampler(inputs, track, quantity).run());
      align_means(pieces[k].back().commanded, pieces[k].back().values);
      if (quantity == ScanQuantity::kBalance) remove_trim(pieces[k].back());
    }
  });
  ScanSamples all;
  all.quantity = quantity;
  append(pieces, all);
  double squares_N2 = 0;
  std::size_t records = 0;
  for (const auto& piece : pieces) {
    for (const TrackSamples& track : piece) {
      squares_N2 += track.squares_N2;
      records += track.records;
    }
  }
  all.mean_square_N2 = records > 0 ? squares_N2 / static_cast<double>(records) : 0;
  return all;
}

}  // namespace swarmcert::identification
