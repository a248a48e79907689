#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/stages.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::reproduction {
namespace {

constexpr int kVehicles = 3;
constexpr double kSwap_s = 4.5, kMove_s = 3;

/// Force remaining for the position loop: the truth minus the prediction after the lag of the motors.
std::vector<double> remainder_N(const std::vector<Moment>& moments, double lag_s) {
  std::vector<double> remainder;
  double lagged = static_cast<double>(moments.front().prediction_gf);
  for (std::size_t k = 0; k < moments.size(); ++k) {
    const double step_s = k == 0 ? 0 : static_cast<double>(moments[k].time_s - moments[k - 1].time_s);
    lagged += (1 - std::exp(-step_s / lag_s)) * (static_cast<double>(moments[k].prediction_gf) - lagged);
    remainder.push_back((static_cast<double>(moments[k].interaction_gf) - lagged) * stability::kGramForce_N);
  }
  return remainder;
}

/// Measured disturbance class of the remainder of one vehicle in a flight of swaps.
stability::Disturbance measured(const std::vector<Moment>& moments, double lag_s) {
  const std::vector<double> f = remainder_N(moments, lag_s);
  stability::Disturbance seen;
  seen.amplitude_N = seen.rate_N_s = seen.variation_N = seen.impulse_N_s = 0;
  std::vector<double> impulses;
  for (std::size_t k = 0; k < f.size(); ++k) {
    const double step_s = k == 0 ? 0.01 : static_cast<double>(moments[k].time_s - moments[k - 1].time_s);
    const double change = k == 0 ? f[0] : f[k] - f[k - 1];
    seen.amplitude_N = std::max(seen.amplitude_N, std::abs(f[k]));
    seen.variation_N += std::abs(change);
    seen.rate_N_s = std::max(seen.rate_N_s, std::abs(change) / step_s);
    const auto swap = static_cast<std::size_t>(static_cast<double>(moments[k].time_s) / kSwap_s);
    impulses.resize(std::max(impulses.size(), swap + 1));
    impulses[swap] += std::abs(f[k]) * step_s;
  }
  seen.impulse_N_s = *std::max_element(impulses.begin(), impulses.end());
  seen.passes = static_cast<int>(impulses.size());
  seen.pass_period_s = kSwap_s;
  seen.pass_length_s = kMove_s;
  return seen;
}

/// Largest z-errors in the swaps that test a network.
struct ErrorsInSwaps {
  double predicted_m = 0, flown_m = 0;
  std::string by;  ///< name of the bound that predicted it
};

ErrorsInSwaps errors_in_swaps(const Setting& setting, const Truth& truth, const stability::AxisLoop& loop,
                              double motor_lag_s, const files::Network& network) {
  ErrorsInSwaps errors;
  for (int k = 0; k < scale_of(setting).flight_seeds; ++k) {
    const Flown flown = fly(
        setting, truth, {"swap", kVehicles, 0, seed_of(setting.seed, "table", static_cast<std::uint64_t>(k))},
        &network, false);
    errors.flown_m = std::max(errors.flown_m, largest_error_m(flown, 2));
    for (const auto& moments : flown.vehicles) {
      const stability::DisturbanceBounds bounds =
          stability::disturbance_bounds(loop, stability::Channel::kForce, measured(moments, motor_lag_s));
      if (bounds.least() > errors.predicted_m) {
        errors.predicted_m = bounds.least();
        errors.by = bounds.which();
      }
    }
  }
  return errors;
}

struct GammaRow {
  double gamma = 0;
  Learned learned;
  ErrorsInSwaps errors;
};

struct TradeoffResult {
  std::string truth;
  std::vector<GammaRow> curve;
};

void describe(files::Record& record, const TradeoffResult& result) {
  record.field("truth", result.truth, "Name of the simulated truth.");
  record.field("trained_with", kVehicles, "Number of vehicles that the networks were trained with.");
  record.list("curve", result.curve, "Error over gamma.", [](files::Record& r, const GammaRow& row) {
    r.field("gamma", row.gamma, "Limit of the norm of every layer.");
    r.field("gamma_proved", row.learned.keeps_gamma, "Whether every layer keeps it.", "", "proved");
    r.field("bound_gf_per_unit", row.learned.bound, "Largest Lipschitz bound.", "gf/unit",
            "proved upper bound");
    r.field("test_rmse_gf", row.learned.test_gf, "On flights not seen.", "gf");
    r.field("predicted_z_error_m", row.errors.predicted_m, "Of the linear loop in these flights.", "m",
            "upper bound");
    r.field("predicted_by", row.errors.by, "Name of the bound that is least.");
    r.field("flown_z_error_m", row.errors.flown_m, "", "m");
  });
}

Finding run_tradeoff(const Setting& setting) {
  Finding finding;
  const Truth truth = truths(setting).front();
  Stages stages(setting, truth, 0);
  const int stage = stage_of(kVehicles);
  const stability::Gains gains = stability::load_gains(setting.gains);
  const std::optional<stability::AxisLoop> loop =
      stability::FlownLoop{gains, {truth.model.mass_kg}}.continuous(2);
  TradeoffResult result{truth.name, {}};
  std::string data;
  const std::vector<double> gammas =
      setting.full ? std::vector<double>{1, 1.5, 2, 2.5, 3, 4, 6} : std::vector<double>{1.5, 3};
  for (const double gamma : gammas) {
    LearnOptions options = stages.learn_options();
    options.gamma.value = gamma;
    options.steps = setting.full ? 6000 : 600;
    const std::string folder =
        (std::filesystem::path(stages.flights(stage).folder) / fmt::format("gamma-{:g}", gamma)).string();
    Learned learned = learn(setting, options, folder, stages.data_key(stage),
                            [&] { return stages.data(stage, options.sizes); });
    const ErrorsInSwaps errors = errors_in_swaps(setting, truth, *loop, gains.motor_lag_s, learned.network);
    data += fmt::format("{} {} {} {}\n", learned.bound, learned.test_gf, 100 * errors.predicted_m,
                        100 * errors.flown_m);
    result.curve.push_back({gamma, std::move(learned), errors});
  }
  finding.fields = files::record_of(result);
  finding.show("Networks trained with three, gamma in every layer", "curve",
               {{"gamma", "", "{:g}"},
                {"bound_gf_per_unit", "proved bound", "{:.1f}"},
                {"test_rmse_gf", "test RMSE", "{:.2f}"},
                {"predicted_z_error_m", "predicted z-error", "{:.3f}"},
                {"predicted_by", "by"},
                {"flown_z_error_m", "flown", "{:.3f}"}});
  finding.notes.push_back(
      "Predicted: the loop's exact gains times the measured remainder of the force after the prediction, "
      "with the motors' lag, in swaps of three. It bounds the linear loop, for these flights: noise and "
      "saturation come on top.");
  finding.figures.push_back(
      {"lipschitz", data,
       "set logscale x\nset grid\nset key top right\nset xlabel 'proved Lipschitz bound [gf per m "
       "or m/s]'\nset ylabel 'test RMSE [gf]'\nset y2label 'largest z-error [cm]'\nset y2tics\nset "
       "yrange [0:*]\nset y2range [0:*]\nplot 'lipschitz.dat' using 1:2 with linespoints lw 2 "
       "title 'test RMSE', '' using 1:3 axes x1y2 with linespoints title 'predicted z-error', '' "
       "using 1:4 axes x1y2 with linespoints title 'flown z-error'\n",
       "Test error and tracking error over the proved Lipschitz bound."});
  return finding;
}

}  // namespace

Experiment lipschitz_tradeoff() {
  return experiment<TradeoffResult>("lipschitz", "test error, certified bound and tracking error over gamma",
                                    run_tradeoff);
}

}  // namespace swarmcert::reproduction
