/// Every effect of the library under another name: identification must judge the twins alike.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/run.h"
#include "data.h"
#include "hidden_effect/truths.h"
#include "stability/effects/registry.h"
#include "stability/effects/traits.h"

namespace swarmcert::tests {
namespace {

const std::string kTwin = "twin_of_";

/// While it exists, the library has only twins.
class OnlyTwins {
 public:
  OnlyTwins() {
    for (const std::string& name : stability::effect_names())
      originals_.push_back(stability::withdraw_effect(name));
    for (const stability::EffectEntry& original : originals_) {
      stability::EffectInfo info = original.info;
      info.name = kTwin + info.name;
      stability::register_effect(std::move(info), original.make);
    }
  }
  ~OnlyTwins() {
    for (const std::string& name : stability::effect_names()) stability::withdraw_effect(name);
    for (stability::EffectEntry& original : originals_)
      stability::register_effect(std::move(original.info), std::move(original.make));
  }
  OnlyTwins(const OnlyTwins&) = delete;
  OnlyTwins& operator=(const OnlyTwins&) = delete;

 private:
  std::vector<stability::EffectEntry> originals_;
};

/// What diagnose says, without the twins' prefix.
struct Judgement {
  std::vector<std::string> named, suspected;
  std::vector<std::vector<std::string>> rivals;
  std::map<std::string, double> values;  ///< "thrust_ratio.ratio", with both ends of the interval
};

std::string original_of(const std::string& name) {
  return name.rfind(kTwin, 0) == 0 ? name.substr(kTwin.size()) : name;
}

std::vector<std::string> originals_of(std::vector<std::string> names) {
  for (std::string& name : names) name = original_of(name);
  std::sort(names.begin(), names.end());
  return names;
}

Judgement judge(const std::string& flights) {
  residuals::InputArguments arguments;
  arguments.models = {source_path("stability/models/crazyflie-small.toml")};
  arguments.flights = {flights};
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  const identification::Diagnosis diagnosis = identification::diagnose(
      inputs, inputs.models[0].kind, identification::every_flight(inputs), 2, [](int, int) {});
  Judgement result;
  result.suspected = originals_of(diagnosis.suspected);
  for (const identification::Missing& missing : diagnosis.ranking) {
    const std::string name = original_of(missing.effect);
    result.named.push_back(name);
    result.rivals.push_back(originals_of(missing.finding.confounded_with()));
    for (const auto& [parameter, value] : missing.parameters) result.values[name + "." + parameter] = value;
    for (const auto& [parameter, interval] : missing.intervals) {
      result.values[name + "." + parameter + ".lower"] = interval.lower;
      result.values[name + "." + parameter + ".upper"] = interval.upper;
    }
  }
  return result;
}

TEST(HiddenEffect, IsJudgedAlikeUnderAnotherName) {
  std::vector<Hidden> cases = single_effects();
  ASSERT_GE(cases.size(), 15U);
  std::size_t named = 0;
  for (const Hidden& hidden : cases) {
    if (hidden.vehicles > 1) continue;
    SCOPED_TRACE(hidden.name);
    const ScratchFolder folder;
    const std::string flights = (folder.path() / "flights").string();
    fly(hidden.truth, {Program::kRich, 1, 25, 3}, flights);
    const Judgement original = judge(flights);
    const OnlyTwins twins;
    const Judgement twin = judge(flights);
    EXPECT_EQ(twin.named, original.named);
    EXPECT_EQ(twin.suspected, original.suspected);
    EXPECT_EQ(twin.rivals, original.rivals);
    EXPECT_EQ(twin.values, original.values);
    named += original.named.size();
  }
  EXPECT_GE(named, 10U);
}

TEST(HiddenEffect, KeepsItsTraitsUnderAnotherName) {
  const std::vector<std::string> names = stability::effect_names();
  const OnlyTwins twins;
  EXPECT_EQ(originals_of(stability::effect_names()), originals_of(names));
  for (const std::string& name : names) {
    EXPECT_EQ(stability::traits_of(name).family, stability::Family::kNone) << name;
    EXPECT_EQ(stability::effect_info(kTwin + name).name, kTwin + name);
  }
  EXPECT_EQ(stability::plain_effect(stability::Family::kDrag), kTwin + "drag_linear");
}

}  // namespace
}  // namespace swarmcert::tests
