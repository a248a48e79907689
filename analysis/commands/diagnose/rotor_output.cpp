#include "analysis/commands/diagnose/rotor_output.h"

#include <fmt/core.h>

#include <array>
#include <optional>
#include <string>

#include "stability/effects/registry.h"

namespace swarmcert::analysis {
namespace {

using identification::RotorBalance;

std::array<double, 4> numbers(const Eigen::Vector4d& four) { return {four[0], four[1], four[2], four[3]}; }

FittedValues factors_of(const RotorBalance& balance) {
  FittedValues factors;
  for (std::size_t k = 0; k < balance.factors.size(); ++k)
    factors["rotor_" + std::to_string(k + 1)] = {balance.factors[k].value, balance.factors[k].interval};
  return factors;
}

/// Returns the ranking entry: its errors are those of the four rotor loads, relative to healthy flights.
Ranked ranked_rotor(const RotorBalance& balance, const std::string& kind) {
  Eigen::Vector4d left_N = balance.rise_N;
  left_N[balance.rotor - 1] = 0;
  const stability::EffectInfo& info = stability::effect_info(identification::rotor_effect());
  Ranked entry;
  entry.effect = info.name;
  entry.kind = kind;
  entry.vehicle = balance.vehicle;
  entry.rmse_before_N = balance.rise_N.norm() / 2;
  entry.rmse_after_N = left_N.norm() / 2;
  entry.drop = 1 - entry.rmse_after_N / entry.rmse_before_N;
  entry.parameters = factors_of(balance);
  entry.equivalence_class = info.equivalence_class;
  entry.rivals.push_back({{"payload"}, kUnknown, info.excitation});
  entry.separated_by = info.excitation;
  entry.records = balance.records;
  entry.blocks = entry.flights = static_cast<std::size_t>(balance.flights);
  entry.rotor = balance.rotor;
  entry.statement = identification::in_words(balance);
  return entry;
}

void print_rotors(const std::vector<RotorBalance>& balances) {
  int of_vehicle = 0;
  for (const RotorBalance& balance : balances) {
    if (balance.flight.empty()) {
      of_vehicle = balance.rotor;
      fmt::print("  {}: {} ({} flights, {} healthy)\n", balance.vehicle, identification::in_words(balance),
                 balance.flights, balance.healthy_flights);
    } else if (balance.rotor != of_vehicle) {
      fmt::print("    {}: {}\n", balance.flight, identification::in_words(balance));
    }
  }
}

}  // namespace

std::vector<RotorBalance> judge_rotors(const residuals::Inputs& inputs, const residuals::Inputs& healthy,
                                       int jobs, bool prints, Judgement& judgement) {
  std::vector<RotorBalance> all;
  for (const stability::Model& model : inputs.models) {
    const std::vector<RotorBalance> balances =
        identification::rotor_balances(identification::rotor_loads(inputs, model.kind, jobs),
                                       identification::rotor_loads(healthy, model.kind, jobs), model);
    if (prints) print_rotors(balances);
    std::vector<Ranked> named;
    for (const RotorBalance& balance : balances)
      if (balance.flight.empty() && balance.rotor != 0) named.push_back(ranked_rotor(balance, model.kind));
    if (!named.empty()) {
      judgement.verdict = identification::Verdict::kMissingEffect;
      judgement.reason.clear();
    }
    judgement.ranking.insert(judgement.ranking.begin(), named.begin(), named.end());
    all.insert(all.end(), balances.begin(), balances.end());
  }
  return all;
}

void describe_rotors(files::Record& record, const RotorBalance& balance) {
  record.field("vehicle", balance.vehicle, "");
  record.field("flight", balance.flight.empty() ? std::nullopt : std::optional(balance.flight),
               "null: all flights of the vehicle.");
  record.field("flights", balance.flights, "");
  record.field("healthy_flights", balance.healthy_flights, "");
  record.field("load_N", numbers(balance.load_N), "Front right, back right, back left, front left.", "N");
  record.field("healthy_load_N", numbers(balance.healthy_N), "The same of healthy flights.", "N");
  record.field("rise_N", numbers(balance.rise_N), "Over the mean of the two rotors that rose least.", "N");
  record.field("least_rise_N", balance.least_rise_N, "That names a rotor.", "N");
  record.field("parameters", factors_of(balance), "Fractions of the previous thrust; 1: unchanged.");
  record.field("rotor", balance.rotor == 0 ? std::nullopt : std::optional(balance.rotor),
               "Weak, or with a load near it; null: none is named.");
  record.field("statement", record.is_shape() ? "" : identification::in_words(balance), "It in words.");
}

}  // namespace swarmcert::analysis
