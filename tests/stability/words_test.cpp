/// Effects in plain words.
#include "stability/effects/words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "stability/effects/registry.h"

namespace swarmcert::stability {
namespace {

const ForceWords kMilli = {1000, "mN"};

/// The names in braces.
std::set<std::string> names_in(const std::string& text) {
  std::set<std::string> names;
  for (std::size_t at = text.find('{'); at != std::string::npos; at = text.find('{', at + 1))
    names.insert(text.substr(at + 1, text.find('}', at) - at - 1));
  return names;
}

TEST(Words, EveryEffectHasAPhraseForEachOfItsParametersThatIsNotZero) {
  for (const std::string& name : effect_names()) {
    const EffectInfo& info = effect_info(name);
    std::set<std::string> known;
    for (const auto* list : {&info.linear, &info.shape})
      for (const Parameter& parameter : *list) known.insert(parameter.name);
    int count = 0;
    for (const Phrase& phrase : phrases()) {
      if (phrase.effect != name) continue;
      ++count;
      EXPECT_EQ(known.count(phrase.leading), 1u) << name << ": " << phrase.leading;
      for (const char* const text : {phrase.text, phrase.if_negative}) {
        if (text == nullptr) continue;
        for (const std::string& used : names_in(text)) EXPECT_EQ(known.count(used), 1u) << text;
      }
    }
    EXPECT_GE(count, 1) << name;
  }
}

TEST(Words, AreWithoutBracesAndWithUnitsForTheDefaultsOfEveryEffect) {
  for (const std::string& name : effect_names()) {
    const EffectInfo& info = effect_info(name);
    std::map<std::string, double> values;
    for (const Parameter& parameter : info.linear) values[parameter.name] = 0.5;
    for (const Parameter& parameter : info.shape) values[parameter.name] = parameter.value;
    const std::string words = in_words(name, values, kMilli);
    EXPECT_FALSE(words.empty()) << name;
    EXPECT_EQ(words.find_first_of("{}"), std::string::npos) << words;
  }
}

TEST(Words, StateSizeSignAndUnit) {
  EXPECT_EQ(
      in_words("wind_field",
               {{"thermal_N", -0.035}, {"x_m", 0.4}, {"y_m", -0.3}, {"radius_m", 0.3}, {"shear_x_N", 0}},
               kMilli),
      "a downdraft of 35 mN at x 0.4 m, y -0.3 m, radius 0.3 m");
  EXPECT_EQ(in_words("constant_force", {{"force_x_N", 0}, {"force_y_N", 0}, {"force_z_N", -2}}, {}),
            "a steady force of 2 N downwards");
  EXPECT_EQ(in_words("flow_torque", {{"moment_N_s", 5e-4}}, {}),
            "air that tilts the moving vehicle back, with 0.0005 N s times the speed");
  EXPECT_EQ(in_words("thrust_ratio", {{"ratio", 1.379}}, {}),
            "a thrust of 1.38 times the model's, or a mass as much smaller");
  EXPECT_EQ(in_words("my_own_formula", {{"a", 1}}, {}), "");
}

}  // namespace
}  // namespace swarmcert::stability
