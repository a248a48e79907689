#include "stability/effects/expression.h"

#include <muParser.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "nn/base/doubles.h"
#include "nn/base/input_error.h"
#include "nn/base/suggest.h"

namespace swarmcert::stability {
namespace {

const std::vector<std::string> kTargets = {"force_x_N",   "force_y_N",   "force_z_N",
                                           "force_b1_N",  "force_b2_N",  "force_b3_N",
                                           "torque_x_Nm", "torque_y_Nm", "torque_z_Nm"};
const std::vector<std::string> kVariables = {
    "x",     "y",   "z",   "vx", "vy", "vz", "b3x",  "b3y",     "b3z",     "wx",   "wy",
    "wz",    "T",   "V",   "m",  "g",  "t",  "time", "battery", "heading", "tilt", "speed",
    "climb", "vbx", "vby", "dx", "dy", "dz", "dvx",  "dvy",     "dvz",     "mj"};
constexpr std::size_t kFirstOfNeighbour = 25;  // "dx"

/// If `formula` has the form "rest + name", with the sum as its outermost operation, returns the length of the rest;
/// else 0.
std::size_t length_before(const std::string& name, const std::string& formula) {
  const std::size_t plus = formula.rfind('+');
  if (plus == std::string::npos || plus == 0) return 0;
  const auto is_of_name = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  const std::size_t from = formula.find_first_not_of(' ', plus + 1), to = formula.find_last_not_of(' ');
  const std::size_t last = formula.find_last_not_of(' ', plus - 1);
  if (from == std::string::npos || formula.substr(from, to + 1 - from) != name) return 0;
  if (last == std::string::npos || (!is_of_name(formula[last]) && formula[last] != ')')) return 0;
  int depth = 0;
  for (std::size_t i = 0; i < plus; ++i) {
    depth += formula[i] == '(' ? 1 : formula[i] == ')' ? -1 : 0;
    if (depth == 0 && std::strchr("<>=!&|?:,", formula[i]) != nullptr) return 0;
  }
  return depth == 0 ? plus : 0;
}

/// Shape parameters without a grid vary as well: by a factor of two to both sides if there are at most two of them, in
/// small steps around their values if there are more. Parameters at zero have no scale and stay fixed, as do those with
/// equal bounds.
void add_grids(std::vector<Parameter>& shape) {
  const auto varies = [](const Parameter& p) { return p.grid.empty() && p.value != 0 && p.lower < p.upper; };
  const bool few = std::count_if(shape.begin(), shape.end(), varies) <= 2;
  for (Parameter& parameter : shape) {
    if (!varies(parameter)) continue;
    for (const double factor : {0.5, 1.0, 2.0}) {
      if (few || factor == 1)
        parameter.grid.push_back(std::clamp(factor * parameter.value, parameter.lower, parameter.upper));
    }
  }
}

EffectInfo describe(const EffectSpec& spec) {
  EffectInfo info;
  info.name = spec.name;
  info.source = "user-defined";
  info.equivalence_class = spec.name;
  info.excitation = "flights in which the formula varies";
  info.needs_neighbours = spec.expression.per_neighbour;
  for (const auto& [target, formula] : spec.expression.formulas) {
    info.equation += (info.equation.empty() ? "" : "; ") + target + " = " + formula;
  }
  const auto parameter = [&](const std::string& name, double value) {
    Parameter result = {name, "", value, -kInfinity, kInfinity};
    if (const auto bounds = spec.expression.bounds.find(name); bounds != spec.expression.bounds.end()) {
      result.lower = bounds->second.lower;
      result.upper = bounds->second.upper;
    }
    if (const auto grid = spec.expression.grid.find(name); grid != spec.expression.grid.end()) {
      result.grid = grid->second;
    }
    return result;
  };
  const std::vector<std::string>& linear = spec.expression.linear;
  for (const std::string& name : linear) {
    const auto value = spec.parameters.find(name);
    info.linear.push_back(parameter(name, value == spec.parameters.end() ? 0 : value->second));
  }
  for (const auto& [name, value] : spec.parameters) {
    if (std::find(linear.begin(), linear.end(), name) == linear.end()) {
      info.shape.push_back(parameter(name, value));
    }
  }
  add_grids(info.shape);
  return info;
}

}  // namespace

struct ExpressionEffect::Formulas {
  std::string path, name;
  bool per_neighbour = false;
  bool turns = false;  ///< some formula uses the heading or the tilt, which are slow to compute
  std::vector<double> variables = std::vector<double>(kVariables.size());
  std::vector<double> linear, shape;
  struct Formula {
    std::size_t target;
    mu::Parser parser;
    /// A coefficient that is added to the result of `parser`. The parser's formula does not contain it and is linear in
    /// the others, so if all others are zero the formula need not be evaluated.
    const double* constant = nullptr;
  };
  std::vector<Formula> formulas;

  [[noreturn]] void refuse(const std::string& target, const std::string& value, const std::string& what,
                           const std::string& hint) const {
    throw files::InputError({path, "", "effect " + name + ", " + target, value, what, hint});
  }

  void add(std::size_t target, const std::string& text, const EffectInfo& info) {
    Formula& formula = formulas.emplace_back();
    formula.target = target;
    std::vector<std::string> known = kVariables;
    if (!per_neighbour) known.resize(kFirstOfNeighbour);
    try {
      for (std::size_t i = 0; i < known.size(); ++i) {  // each defined variable costs time
        if (text.find(known[i]) != std::string::npos) formula.parser.DefineVar(known[i], &variables[i]);
      }
      for (std::size_t k = 0; k < info.linear.size(); ++k) {
        formula.parser.DefineVar(info.linear[k].name, &linear[k]);
        known.push_back(info.linear[k].name);
      }
      for (std::size_t k = 0; k < info.shape.size(); ++k) {
        formula.parser.DefineVar(info.shape[k].name, &shape[k]);
        known.push_back(info.shape[k].name);
      }
      set_text(text, info, formula);
      for (const auto& used : formula.parser.GetUsedVar()) {
        turns = turns || used.first == "heading" || used.first == "tilt";
        if (std::find(known.begin(), known.end(), used.first) == known.end()) {
          refuse(kTargets[target], files::in_quotes(used.first), "is neither a variable nor a parameter",
                 files::did_you_mean(used.first, known));
        }
      }
      formula.parser.Eval();
    } catch (const mu::Parser::exception_type& error) {
      refuse(kTargets[target], files::in_quotes(text), "is not a formula (" + error.GetMsg() + ")", "");
    }
  }

  void set_text(const std::string& text, const EffectInfo& info, Formula& formula) {
    for (std::size_t k = 0; k < info.linear.size(); ++k) {
      const std::size_t length = length_before(info.linear[k].name, text);
      if (length == 0) continue;
      formula.parser.SetExpr(text.substr(0, length));
      if (formula.parser.GetUsedVar().count(info.linear[k].name) != 0) break;
      formula.constant = &linear[k];
      return;
    }
    formula.parser.SetExpr(text);
  }

  void set_own(const Instant& now) {
    const Eigen::Vector3d b3 = now.b3_W();
    const double own[kFirstOfNeighbour] = {now.p_W_m.x(),
                                           now.p_W_m.y(),
                                           now.p_W_m.z(),
                                           now.v_W_m_s.x(),
                                           now.v_W_m_s.y(),
                                           now.v_W_m_s.z(),
                                           b3.x(),
                                           b3.y(),
                                           b3.z(),
                                           now.omega_B_rad_s.x(),
                                           now.omega_B_rad_s.y(),
                                           now.omega_B_rad_s.z(),
                                           now.thrust_N,
                                           now.battery_V,
                                           now.mass_kg,
                                           kGravity_m_s2,
                                           now.time_s,
                                           now.time_s,
                                           now.battery_V,
                                           turns ? std::atan2(now.R_WB(1, 0), now.R_WB(0, 0)) : 0,
                                           turns ? std::acos(std::clamp(now.R_WB(2, 2), -1.0, 1.0)) : 0,
                                           now.v_W_m_s.norm(),
                                           now.v_W_m_s.dot(b3),
                                           now.v_W_m_s.dot(now.R_WB.col(0)),
                                           now.v_W_m_s.dot(now.R_WB.col(1))};
    std::copy(std::begin(own), std::end(own), variables.begin());
  }

  void set_neighbour(const Neighbour& neighbour) {
    double* const to = variables.data() + kFirstOfNeighbour;
    for (int i = 0; i < 3; ++i) {
      to[i] = neighbour.dp_W_m[i];
      to[3 + i] = neighbour.dv_W_m_s[i];
    }
    to[6] = neighbour.mass_kg;
  }

  /// Adds the current values of the formulas to `sum`.
  /// @param only the only nonzero coefficient, if there is exactly one.
  void add_value(const Instant& now, const double* only, Wrench* sum) {
    for (Formula& formula : formulas) {
      const double* const constant = formula.constant;
      double value = constant != nullptr && constant == only ? 0 : formula.parser.Eval();
      if (constant != nullptr) value += *constant;
      if (!std::isfinite(value)) {
        refuse(kTargets[formula.target], std::to_string(value),
               "is not finite at z = " + std::to_string(now.p_W_m.z()) +
                   " m, T = " + std::to_string(now.thrust_N) + " N",
               "keep the formula defined everywhere, e.g. with max()");
      }
      if (formula.target < 3) {
        sum->force_W_N[static_cast<int>(formula.target)] += value;
      } else if (formula.target < 6) {
        sum->force_W_N += value * now.R_WB.col(static_cast<int>(formula.target) - 3);
      } else {
        sum->torque_B_Nm[static_cast<int>(formula.target) - 6] += value;
      }
    }
  }

  Wrench evaluate(const Instant& now, const double* only = nullptr) {
    Wrench sum;
    if (!per_neighbour) add_value(now, only, &sum);
    for (int j = 0; per_neighbour && j < now.num_neighbours; ++j) {
      set_neighbour(now.neighbours[j]);
      add_value(now, only, &sum);
    }
    return sum;
  }

  /// Tests linearity at random instants: f(0) = 0 and f(c) = sum_k c_k f(e_k).
  void check_linear(const EffectInfo& info) {
    std::mt19937_64 random(1);
    const auto uniform = [&random](double lower, double upper) {
      return lower + (upper - lower) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    for (int trial = 0; trial < 20; ++trial) {
      Instant now;
      Neighbour neighbour = {{uniform(-0.3, 0.3), uniform(-0.3, 0.3), uniform(0.1, 0.6)},
                             {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)},
                             {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)},
                             uniform(0.02, 0.08),
                             0};
      now.p_W_m = {uniform(-1, 1), uniform(-1, 1), uniform(0.1, 1)};
      now.v_W_m_s = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
      now.omega_B_rad_s = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
      now.thrust_N = uniform(0.2, 0.6);
      now.battery_V = uniform(3.3, 4.2);
      now.mass_kg = uniform(0.02, 0.08);
      now.time_s = uniform(0, 10);
      now.neighbours = &neighbour;
      now.num_neighbours = 1;
      set_own(now);
      for (std::size_t k = 0; k < shape.size(); ++k) shape[k] = info.shape[k].value;
      std::vector<double> c(linear.size());
      Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
      double size = 0;
      const auto value = [&] {
        const Wrench wrench = evaluate(now);
        Eigen::Matrix<double, 6, 1> result;
        result << wrench.force_W_N, wrench.torque_B_Nm;
        return result;
      };
      std::fill(linear.begin(), linear.end(), 0.0);
      const double constant = value().norm();
      for (std::size_t k = 0; k < linear.size(); ++k) {
        c[k] = uniform(-2, 2);
        linear[k] = 1;
        sum += c[k] * value();
        size += std::abs(c[k]) * value().norm();
        linear[k] = 0;
      }
      std::copy(c.begin(), c.end(), linear.begin());
      const double gap = (value() - sum).norm();
      if (constant != 0 || gap > 1e-9 * (size + 1e-300)) {
        refuse("linear", "", "the formulas are not linear in these parameters, or have a constant part",
               "list only multiplicative coefficients; multiply the whole formula by one of them");
      }
    }
  }
};

ExpressionEffect::ExpressionEffect(const EffectSpec& spec, const std::string& path)
    : Effect(describe(spec)), formulas_(std::make_unique<Formulas>()) {
  formulas_->path = path;
  formulas_->name = spec.name;
  formulas_->per_neighbour = spec.expression.per_neighbour;
  formulas_->linear.resize(info().linear.size());
  formulas_->shape.resize(info().shape.size());
  if (info().linear.empty() || num_columns() > kMostColumns ||
      static_cast<int>(info().shape.size()) > kMostShape) {
    formulas_->refuse("linear", std::to_string(num_columns()) + " names",
                      "an effect has 1 to 8 coefficients and at most 8 other parameters",
                      "list the multiplicative parameters");
  }
  for (const std::vector<Parameter>* parameters : {&info().linear, &info().shape}) {
    for (const Parameter& parameter : *parameters) {
      if (std::find(kVariables.begin(), kVariables.end(), parameter.name) == kVariables.end()) continue;
      formulas_->refuse("parameters", files::in_quotes(parameter.name), "is the name of a variable",
                        "rename the parameter");
    }
  }
  for (const auto& [target, text] : spec.expression.formulas) {
    const auto found = std::find(kTargets.begin(), kTargets.end(), target);
    if (found == kTargets.end()) {
      formulas_->refuse(target, "", "is not a force or torque", files::did_you_mean(target, kTargets));
    }
    formulas_->add(static_cast<std::size_t>(found - kTargets.begin()), text, info());
  }
  formulas_->check_linear(info());
}

ExpressionEffect::~ExpressionEffect() = default;

void ExpressionEffect::columns(const Instant& now, const double* shape, Wrench* columns) const {
  std::copy(shape, shape + formulas_->shape.size(), formulas_->shape.begin());
  formulas_->set_own(now);
  std::fill(formulas_->linear.begin(), formulas_->linear.end(), 0.0);
  for (std::size_t k = 0; k < formulas_->linear.size(); ++k) {
    formulas_->linear[k] = 1;
    columns[k] = formulas_->evaluate(now, &formulas_->linear[k]);
    formulas_->linear[k] = 0;
  }
}

double ExpressionEffect::reach_m(double, const double*) const {
  return formulas_->per_neighbour ? std::numeric_limits<double>::infinity() : 0;
}

}  // namespace swarmcert::stability
