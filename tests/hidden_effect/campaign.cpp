#include "hidden_effect/campaign.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <cmath>
#include <filesystem>

#include "analysis/run.h"
#include "data.h"
#include "nn/files/json.h"

namespace swarmcert::tests {

Answer ask(const std::vector<Hidden>& hidden, Program program, double duration_s, std::uint64_t seed,
           const std::string& folder, bool knows_lag) {
  Answer answer;
  Truth truth;
  int vehicles = 1;
  for (const Hidden& h : hidden) {
    answer.label += (answer.label.empty() ? "" : " + ") + h.name;
    truth = together(truth, h.truth);
    vehicles = std::max(vehicles, h.vehicles);
  }
  std::string model = read_text(source_path("stability/models/crazyflie-small.toml"));
  if (knows_lag && truth.motor_lag_s == 0) {
    truth.motor_lag_s = kUsualLag_s;
    model += fmt::format("\n[[effect]]\nname = \"motor_lag\"\nparameters = {{ tau_s = {} }}\n", kUsualLag_s);
  }
  const std::string flights = folder + "/flights";
  std::filesystem::remove_all(flights);
  write_text(folder + "/model.toml", model);
  fly(truth, {program, vehicles, duration_s, seed}, flights);
  const Outcome outcome =
      run_shell("swarmcert diagnose model.toml flights -q --force --json result.json", folder);
  EXPECT_EQ(outcome.exit_code, 0) << answer.label << ": " << outcome.output;
  if (outcome.exit_code != 0) return answer;
  const files::Json result = files::read_json(folder + "/result.json", "swarmcert/diagnose/1");
  std::set<std::string> allowed;
  std::size_t found = 0;
  for (const files::Json& entry : result["ranking"]) {
    answer.named.push_back(entry["effect"]);
    answer.drops.push_back(entry["drop"]);
  }
  const auto is_named = [&](const std::string& name) {
    return std::find(answer.named.begin(), answer.named.end(), name) != answer.named.end();
  };
  for (const Hidden& h : hidden) {
    allowed.insert(h.answers.begin(), h.answers.end());
    allowed.insert(h.allowed.begin(), h.allowed.end());
    found += h.answers.empty() || std::any_of(h.answers.begin(), h.answers.end(), is_named) ? 1 : 0;
    if (!answer.named.empty() && h.answers.count(answer.named[0]) == 1) answer.first_right = true;
  }
  answer.all_found = found == hidden.size();
  answer.claims_falsely = std::any_of(answer.named.begin(), answer.named.end(),
                                      [&](const std::string& n) { return allowed.count(n) == 0; });
  answer.exact = answer.all_found && !answer.claims_falsely;
  answer.flagged = result["unexplained"]["flag"];
  answer.ratio = result["unexplained"]["ratio"];
  if (hidden.size() == 1 && !hidden[0].parameter.empty() && answer.first_right) {
    const files::Json& fitted = result["ranking"][0]["parameters"][hidden[0].parameter];
    answer.has_value = true;
    answer.value_error = fitted["value"].get<double>() / hidden[0].value - 1;
    answer.value_right = std::abs(answer.value_error) <= hidden[0].tolerance;
    if (fitted.contains("interval_90")) {
      answer.covered = fitted["interval_90"][0].get<double>() <= hidden[0].value &&
                       hidden[0].value <= fitted["interval_90"][1].get<double>();
    }
  }
  return answer;
}

std::pair<double, double> clopper_pearson(int hits, int runs) {
  const double tail = 0.05;
  const double lower =
      hits == 0 ? 0 : boost::math::quantile(boost::math::beta_distribution<>(hits, runs - hits + 1), tail);
  const double upper =
      hits == runs ? 1
                   : boost::math::quantile(boost::math::beta_distribution<>(hits + 1, runs - hits), 1 - tail);
  return {lower, upper};
}

std::string share(int hits, int runs) {
  const auto [lower, upper] = clopper_pearson(hits, runs);
  return fmt::format("{} of {} ({:.3f}, 90 %: {:.3f} .. {:.3f})", hits, runs,
                     runs > 0 ? double(hits) / runs : 0, lower, upper);
}

}  // namespace swarmcert::tests
