#include "analysis/identification/labels/wrong_kind.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "analysis/identification/balance/mean_fit.h"
#include "analysis/identification/column_run.h"
#include "analysis/identification/labels/exchanged_streams.h"
#include "analysis/residuals/force_residual.h"
#include "analysis/residuals/plausibility.h"

namespace swarmcert::identification {
namespace {

using residuals::Track;

/// Sums over a block of y, the acceleration along the thrust axis without the model's effects, and x = T / m.
struct ThrustSums {
  double xx = 0, xy = 0, yy = 0, count = 0;

  double left(double scale) const { return (yy - 2 * scale * xy + scale * scale * xx) / count; }
};

bool is_thrust_plausible(const std::vector<logs::Doubt>& doubts) {
  return std::none_of(doubts.begin(), doubts.end(), [](const logs::Doubt& doubt) {
    return doubt.signal == "thrust" || doubt.signal == "battery";
  });
}

std::vector<ThrustSums> thrust_sums(const residuals::Inputs& inputs, const stability::Model& model,
                                    const Track& track) {
  const auto r = residuals::force_residual(model, inputs.kinds, inputs.rules, track);
  const TrackBlocks cut = cut_into_blocks(track);
  std::vector<ThrustSums> sums(cut.blocks.size());
  for (std::size_t i = 0; i < r.size(); ++i) {
    if (cut.of_record[i] < 0) continue;
    ThrustSums& sum = sums[static_cast<std::size_t>(cut.of_record[i])];
    const double x = track.instants[i].thrust_N / model.mass_kg;
    const double y = r[i].dot(track.instants[i].b3_W()) / model.mass_kg + x;
    sum.xx += x * x;
    sum.xy += x * y;
    sum.yy += y * y;
    ++sum.count;
  }
  return sums;
}

/// Returns the residual of each block with the scale fitted to the blocks of the other parity.
std::vector<double> scaled(const std::vector<ThrustSums>& blocks) {
  std::array<ThrustSums, 2> halves;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    halves[b % 2].xx += blocks[b].xx;
    halves[b % 2].xy += blocks[b].xy;
  }
  std::vector<double> left;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const ThrustSums& half = halves[1 - b % 2];
    left.push_back(blocks[b].left(half.xx > 0 ? half.xy / half.xx : 1));
  }
  return left;
}

std::vector<double> as_it_is(const std::vector<ThrustSums>& blocks) {
  std::vector<double> left;
  for (const ThrustSums& block : blocks) left.push_back(block.left(1));
  return left;
}

std::vector<double> minus(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> differences;
  for (std::size_t i = 0; i < a.size(); ++i) differences.push_back(a[i] - b[i]);
  return differences;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(std::max<std::size_t>(values.size(), 1));
}

/// Requires at least a tenth of the mean square, as for a formula that replaces a named effect.
bool is_clearly_less(const std::vector<double>& less, const std::vector<double>& more, int tried) {
  constexpr double kLeastGainOfCurve = 0.1;
  return mean_of(less) < (1 - kLeastGainOfCurve) * mean_of(more) && surely_positive(minus(more, less), tried);
}

void append(const std::vector<double>& from, std::vector<double>& to) {
  to.insert(to.end(), from.begin(), from.end());
}

/// Pools the trials of all `logs` with `kind`; returns nothing if one of them is not plausible with it.
std::optional<KindTrial> pooled(const std::vector<const LogKind*>& logs, const std::string& kind) {
  KindTrial all;
  all.kind = kind;
  for (const LogKind* log : logs) {
    const auto trial = std::find_if(log->trials.begin(), log->trials.end(),
                                    [&](const KindTrial& one) { return one.kind == kind; });
    if (trial == log->trials.end()) return std::nullopt;
    append(trial->own, all.own);
    append(trial->other, all.other);
    append(trial->own_scaled, all.own_scaled);
    append(trial->other_scaled, all.other_scaled);
  }
  return all;
}

/// Returns the other kind as which `logs` fly, if there is one.
std::optional<WrongKind> judged(const std::vector<const LogKind*>& logs, int tried) {
  std::optional<WrongKind> best;
  for (const KindTrial& named : logs[0]->trials) {
    const std::optional<KindTrial> trial = pooled(logs, named.kind);
    if (!trial || !surely_positive(minus(trial->own, trial->other), tried)) continue;
    // The thrust curve of the own kind fits better at another scale.
    if (is_clearly_less(trial->own_scaled, trial->other_scaled, tried)) continue;
    WrongKind found;
    found.vehicle = logs[0]->vehicle;
    found.kind = logs[0]->kind;
    found.is_kind = named.kind;
    found.is_sure = is_clearly_less(trial->other_scaled, trial->own_scaled, tried);
    found.before_m_s2 = std::sqrt(mean_of(trial->own));
    found.after_m_s2 = std::sqrt(mean_of(trial->other));
    found.blocks = static_cast<int>(trial->own.size());
    found.flights = static_cast<int>(logs.size());
    if (!best || found.after_m_s2 < best->after_m_s2) best = found;
  }
  return best;
}

/// Finds pairs of vehicles of a flight that each fly as the other's kind.
void pair_up(std::vector<WrongKind>& found) {
  for (auto one = found.begin(); one != found.end(); ++one) {
    if (one->flight.empty() || !one->exchanged_with.empty()) continue;
    const auto other = std::find_if(one + 1, found.end(), [&](const WrongKind& candidate) {
      return candidate.flight == one->flight && candidate.exchanged_with.empty() &&
             candidate.is_kind == one->kind && candidate.kind == one->is_kind;
    });
    if (other == found.end()) continue;
    one->exchanged_with = other->vehicle;
    other->exchanged_with = one->vehicle;
    one->is_sure = other->is_sure = true;
  }
}

}  // namespace

LogKind kind_of(const residuals::Inputs& inputs, const Track& track) {
  LogKind log = {track.flight, track.vehicle, track.kind, track.path, is_thrust_plausible(track.doubts), {}};
  if (log.is_plausible || inputs.rules.per_mass || track.thrust_source != logs::ThrustSource::kDuty)
    return log;
  const stability::Model own = inputs.model_for(track);
  std::vector<ThrustSums> of_own;
  for (const stability::Model& model : inputs.models) {
    if (model.kind == track.kind || model.num_rotors() != 4) continue;
    Track tried = track;
    residuals::apply_model(model, inputs.kinds, inputs.rules, tried);
    if (!is_thrust_plausible(residuals::doubts_of(model, tried))) continue;
    if (of_own.empty()) of_own = thrust_sums(inputs, own, track);
    const std::vector<ThrustSums> of_other = thrust_sums(inputs, model, tried);
    log.trials.push_back(
        {model.kind, as_it_is(of_own), as_it_is(of_other), scaled(of_own), scaled(of_other)});
  }
  return log;
}

std::vector<WrongKind> wrong_kinds(const std::vector<LogKind>& logs) {
  std::map<std::string, std::vector<const LogKind*>> vehicles;
  int tried = 0;
  for (const LogKind& log : logs) {
    vehicles[log.vehicle].push_back(&log);
    tried += static_cast<int>(log.trials.size());
  }
  std::vector<WrongKind> found;
  for (const auto& [vehicle, own] : vehicles) {
    const bool is_ever_right =
        std::any_of(own.begin(), own.end(), [](const LogKind* log) { return log->is_plausible; });
    if (!is_ever_right) {
      if (const std::optional<WrongKind> wrong = judged(own, tried)) found.push_back(*wrong);
      continue;
    }
    for (const LogKind* log : own) {
      std::optional<WrongKind> wrong = judged({log}, tried);
      if (!wrong) continue;
      wrong->flight = log->flight;
      wrong->path = log->path;
      found.push_back(*wrong);
    }
  }
  pair_up(found);
  return found;
}

}  // namespace swarmcert::identification
