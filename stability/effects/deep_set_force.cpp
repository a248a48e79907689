#include "stability/effects/deep_set_force.h"

#include <algorithm>

#include "nn/base/input_error.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::stability {
namespace {

const std::vector<std::string> kInputs = {"dp_x_m", "dp_y_m", "dp_z_m", "dv_x_m_s", "dv_y_m_s", "dv_z_m_s"};

[[noreturn]] void refuse(const files::Network& network, const std::string& field, const std::string& value,
                         const std::string& what, const std::string& hint) {
  throw files::InputError({network.path, "", field, value, what, hint});
}

/// Returns the component of (dp, dv) that each input of phi is.
std::vector<int> read_order(const files::Network& network, int inputs) {
  std::vector<int> order;
  for (int i = 0; i < inputs; ++i) {
    if (network.input_order.empty()) {
      order.push_back(i);  // published networks: dp, then dv
      continue;
    }
    const std::string& name = network.input_order[static_cast<std::size_t>(i)];
    const auto found = std::find(kInputs.begin(), kInputs.end(), name);
    if (found == kInputs.end()) {
      refuse(network, "input.order", files::in_quotes(name), "is not an input that simulation provides",
             "use dp_x_m .. dv_z_m_s");
    }
    order.push_back(static_cast<int>(found - kInputs.begin()));
  }
  return order;
}

}  // namespace

DeepSetForce::DeepSetForce(files::Network network, const std::string& kind,
                           const std::vector<std::string>& kinds, DeepSetOutput output)
    : network_(std::move(network)) {
  if (network_.plain) {
    refuse(network_, "", "", "is a plain network, but a force between vehicles needs a deep set",
           "use a network.toml with phi and rho");
  }
  // The views below point into arrays owned by the evaluators, so the vector must not reallocate after this.
  evaluators_.reserve(network_.phi.size() + 1);
  std::vector<std::string> names;
  for (const auto& [name, weights] : network_.phi) {
    evaluators_.emplace_back(weights);
    if (name == files::kGroundKind) {
      ground_ = evaluators_.back().mlp();
      set_.ground = &ground_;
    } else {
      phi_.push_back(evaluators_.back().mlp());
      names.push_back(name);
    }
  }
  if (phi_.empty()) refuse(network_, "phi", "", "has only the ground", "add the phi of a neighbour's kind");
  for (const std::string& wanted : kinds) {
    const auto found = std::find(names.begin(), names.end(), wanted);
    if (found == names.end() && names.size() > 1) {
      refuse(network_, "phi", "", "has no kind " + files::in_quotes(wanted), "add [phi." + wanted + "]");
    }
    phi_of_kind_.push_back(found == names.end() ? 0 : static_cast<int>(found - names.begin()));
  }
  auto rho = network_.rho.find(kind);
  if (rho == network_.rho.end() && network_.rho.size() == 1) rho = network_.rho.begin();
  if (rho == network_.rho.end()) {
    refuse(network_, "rho", "", "has no kind " + files::in_quotes(kind), "add [rho." + kind + "]");
  }
  evaluators_.emplace_back(rho->second);
  const std::string quantity = network_.output_quantity.empty() ? "force_z" : network_.output_quantity;
  if (output == DeepSetOutput::kForceZ) files::require_force_z(network_);
  if (output == DeepSetOutput::kTorque) files::require_torque(network_);
  if (rho->second.outputs() != files::components(quantity)) {
    refuse(network_, "rho." + rho->first, std::to_string(rho->second.outputs()) + " outputs",
           "must be 1: the force along z", "");
  }
  set_.rho = evaluators_.back().mlp();
  set_.phi = phi_.data();
  set_.num_kinds = static_cast<int>(phi_.size());
  if (network_.clamp) {
    set_.lower = network_.clamp->lower.data();
    set_.upper = network_.clamp->upper.data();
  }
  silent_ = files::silent_counts(network_, rho->first);
  set_.silent = silent_.data();
  set_.num_silent = static_cast<int>(silent_.size()) / set_.num_kinds;
  if (set_.inputs() > static_cast<int>(kInputs.size())) {
    refuse(network_, "phi." + names.front(), std::to_string(set_.inputs()) + " inputs",
           "must be at most 6: relative position and velocity", "");
  }
  input_ = read_order(network_, set_.inputs());
  is_torque_ = quantity == "torque";
  const std::string& unit = network_.output_unit;
  SI_per_unit_ = unit == "N" || unit == "N_m" ? 1 : unit == "mN_m" ? 1e-3 : kGramForce_N;
  own_.resize(files::kGroundInputs);
  hidden_sum_.resize(static_cast<std::size_t>(set_.hidden()));
  scratch_.resize(static_cast<std::size_t>(nn::scratch_size(set_)));
  reserve(16);
}

void DeepSetForce::reserve(int neighbours) {
  const auto count = static_cast<std::size_t>(neighbours);
  inputs_.resize(count * input_.size());
  clamped_.resize(count * static_cast<std::size_t>(set_.inputs()));
  order_.resize(count);
  neighbours_.resize(count);
}

Eigen::Vector3d DeepSetForce::evaluate(const Instant& now) {
  if (now.num_neighbours > static_cast<int>(order_.size())) reserve(2 * now.num_neighbours);
  own_ = {-now.p_W_m.z(), -now.v_W_m_s.x(), -now.v_W_m_s.y(), -now.v_W_m_s.z()};
  for (int j = 0; j < now.num_neighbours; ++j) {
    const Neighbour& neighbour = now.neighbours[j];
    double* const x = inputs_.data() + static_cast<std::size_t>(j) * input_.size();
    for (std::size_t i = 0; i < input_.size(); ++i) {
      x[i] = input_[i] < 3 ? neighbour.dp_W_m[input_[i]] : neighbour.dv_W_m_s[input_[i] - 3];
    }
    neighbours_[static_cast<std::size_t>(j)] = {x, phi_of_kind_[static_cast<std::size_t>(neighbour.kind)]};
  }
  Eigen::Vector3d output = Eigen::Vector3d::Zero();
  nn::evaluate(
      set_, own_.data(), neighbours_.data(), now.num_neighbours, output.data(),
      {clamped_.data(), order_.data(), static_cast<int>(order_.size()), hidden_sum_.data(), scratch_.data()});
  return SI_per_unit_ * output;
}

Eigen::Vector3d DeepSetForce::evaluate(const Instant& now, const double* weights) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double level = 1;
  Instant some = now;
  for (;;) {
    present_.clear();
    double next = 0;
    for (int j = 0; j < now.num_neighbours; ++j) {
      if (weights[j] >= level) {
        present_.push_back(now.neighbours[j]);
      } else {
        next = std::max(next, weights[j]);
      }
    }
    some.neighbours = present_.data();
    some.num_neighbours = static_cast<int>(present_.size());
    sum += (level - next) * evaluate(some);
    if (!(next > 0)) return sum;
    level = next;
  }
}

Wrench DeepSetForce::as_wrench(const Instant& now, const Eigen::Vector3d& output) const {
  if (is_torque_) return {Eigen::Vector3d::Zero(), now.R_WB.transpose() * output};
  if (set_.outputs() == 1) return {Eigen::Vector3d(0, 0, output[0]), Eigen::Vector3d::Zero()};
  return {output, Eigen::Vector3d::Zero()};
}

double DeepSetForce::force_z_N(const Instant& now) { return evaluate(now)[0]; }

double DeepSetForce::force_z_N(const Instant& now, const double* weights) {
  return evaluate(now, weights)[0];
}

Wrench DeepSetForce::wrench(const Instant& now) { return as_wrench(now, evaluate(now)); }

Wrench DeepSetForce::wrench(const Instant& now, const double* weights) {
  return as_wrench(now, evaluate(now, weights));
}

}  // namespace swarmcert::stability
