#include "hidden_effect/campaign.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "analysis/run.h"
#include "data.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "nn/base/shard.h"

namespace swarmcert::tests {
namespace {

constexpr const char* kSchema = "swarmcert/campaign-answer/1";

files::Json json_of(const Answer& answer) {
  return {{"label", answer.label},
          {"named", answer.named},
          {"drops", answer.drops},
          {"first_right", answer.first_right},
          {"exact", answer.exact},
          {"all_found", answer.all_found},
          {"claims_falsely", answer.claims_falsely},
          {"flagged", answer.flagged},
          {"ratio", answer.ratio},
          {"has_value", answer.has_value},
          {"value_right", answer.value_right},
          {"covered", answer.covered},
          {"value_error", answer.value_error}};
}

Answer answer_of(const files::Json& json) {
  Answer answer;
  answer.label = json["label"];
  answer.named = json["named"].get<std::vector<std::string>>();
  answer.drops = json["drops"].get<std::vector<double>>();
  answer.first_right = json["first_right"];
  answer.exact = json["exact"];
  answer.all_found = json["all_found"];
  answer.claims_falsely = json["claims_falsely"];
  answer.flagged = json["flagged"];
  answer.ratio = json["ratio"];
  answer.has_value = json["has_value"];
  answer.value_right = json["value_right"];
  answer.covered = json["covered"];
  answer.value_error = json["value_error"];
  return answer;
}

}  // namespace

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
  const std::string verdict = result["verdict"];
  EXPECT_EQ(verdict == "missing_effect", !answer.named.empty()) << answer.label;
  if (answer.named.empty()) {
    EXPECT_TRUE(verdict == "unexplained" || !answer.flagged) << answer.label;
    EXPECT_TRUE(verdict == "nothing_missing" || answer.flagged || !result["remainder"].empty())
        << answer.label << " is said to be unexplained, without a variable";
  }
  if (hidden.size() == 1 && !hidden[0].parameter.empty() && answer.first_right) {
    const files::Json& fitted = result["ranking"][0]["parameters"][hidden[0].parameter];
    answer.has_value = true;
    // Results give the ratio as a factor.
    const double value = hidden[0].value + (hidden[0].parameter == "ratio" ? 1 : 0);
    answer.value_error = (fitted["value"].get<double>() - value) / hidden[0].value;
    answer.value_right = std::abs(answer.value_error) <= hidden[0].tolerance;
    if (fitted.contains("interval_90")) {
      answer.covered =
          fitted["interval_90"][0].get<double>() <= value && value <= fitted["interval_90"][1].get<double>();
    }
  }
  return answer;
}

std::optional<Answer> ask_once(const std::vector<Hidden>& hidden, Program program, double duration_s,
                               std::uint64_t seed, const std::string& folder, bool knows_lag) {
  const char* const kept = std::getenv("SWARMCERT_CAMPAIGN");
  if (kept == nullptr) return ask(hidden, program, duration_s, seed, folder, knows_lag);
  const char* const programs[] = {"rich", "slow", "hover"};
  std::string name = programs[static_cast<int>(program)];
  for (const Hidden& h : hidden) name += "-" + h.name;
  name += fmt::format("-{}-{:g}s{}", seed, duration_s, knows_lag ? "-lag" : "");
  std::replace(name.begin(), name.end(), ' ', '_');
  const std::string path = std::string(kept) + "/" + name + ".json";
  const char* const text = std::getenv("SWARMCERT_CAMPAIGN_SHARD");
  if (text != nullptr && !std::filesystem::exists(path)) {
    const std::optional<files::Shard> shard = files::shard_of(text);
    if (!shard) throw std::invalid_argument("SWARMCERT_CAMPAIGN_SHARD is not I/N: " + std::string(text));
    std::uint32_t number = 0;  // of the run, the same in each process
    for (const char letter : name) number = 31 * number + static_cast<unsigned char>(letter);
    if (!shard->has(number)) return std::nullopt;
  }
  return answer_of(files::kept_unit(path, kSchema, name, [&] {
    return json_of(ask(hidden, program, duration_s, seed, folder, knows_lag));
  }));
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
