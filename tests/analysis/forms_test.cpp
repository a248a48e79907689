/// Physical forms: their texts, what they say beyond the data, and the names under which they are proposed.
#include "analysis/identification/scan/forms.h"

#include <gtest/gtest.h>

#include <set>

#include "analysis/identification/scan/form_reach.h"
#include "analysis/identification/scan/proposal.h"
#include "stability/effects/effect.h"

namespace swarmcert::identification {
namespace {

TEST(Proposals, AreNamedWithTheirPlace) {
  for (const char* name : {"formula", "formula:1", "formula:12", "shape", "shape:2"})
    EXPECT_TRUE(is_proposal(name));
  for (const char* name : {"formulas", "formula:", "formula:0", "formula:x", "formula:1x", "shape:-1"})
    EXPECT_FALSE(is_proposal(name));
}

/// The functions and the texts of all forms agree.
TEST(Forms, TextsGiveTheValues) {
  const auto check = [](const std::vector<Form>& forms) {
    for (const Form& form : forms) {
      std::vector<double> theta;
      for (const FormParameter& parameter : form.shape)
        theta.push_back(parameter.starts[parameter.starts.size() / 2]);
      double values[kMostFormFunctions] = {};
      const double v[2] = {0.7, 0.35};
      form.values(v, theta.data(), values);
      for (std::size_t k = 0; k < form.texts.size(); ++k) {
        stability::EffectSpec spec;
        spec.name = "form";
        spec.parameters["coefficient"] = 1;
        spec.expression.linear = {"coefficient"};
        std::string text = form.texts[k];
        replace_all(text, "{0}", "x");
        replace_all(text, "{1}", "y");
        for (std::size_t s = 0; s < form.shape.size(); ++s) {
          replace_all(text, kShapeLetters[s], form.shape[s].name);
          spec.parameters[form.shape[s].name] = theta[s];
        }
        spec.expression.formulas["force_z_N"] = "coefficient * (" + text + ")";
        const stability::AppliedEffect effect(spec, {});
        stability::Instant now;
        now.p_W_m = {v[0], v[1], 1};
        EXPECT_NEAR(effect.wrench(now).force_W_N.z(), values[k], 1e-12) << form.name << ": " << text;
      }
    }
  };
  check(forms_over({0, 1}, false));
  check(forms_over({-1, 1}, true));
  check(forms_over_section({-1, 1}, {0, 1}));
}

/// The middle start of each shape parameter.
std::vector<double> typical_theta(const Form& form) {
  std::vector<double> theta;
  for (const FormParameter& parameter : form.shape)
    theta.push_back(parameter.starts[parameter.starts.size() / 2]);
  return theta;
}

TEST(Forms, GrowBeyondTheirRangeIfNothingLimitsThem) {
  const FormRange range = {-1, 1};
  std::set<std::string> growing, limited;
  for (const Form& form : forms_over(range, true))
    (grows_beyond(form, typical_theta(form), {range}, 0) ? growing : limited).insert(form.name);
  for (const char* const name : {"linear", "quadratic"}) EXPECT_EQ(growing.count(name), 1u) << name;
  for (const char* const name : {"gaussian", "sinusoid"}) EXPECT_EQ(limited.count(name), 1u) << name;
}

}  // namespace
}  // namespace swarmcert::identification
