#include <algorithm>

#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/witness.h"
#include "lipschitz/networks.h"
#include "lipschitz/range.h"
#include "nn/base/content_hash.h"
#include "nn/refusal.h"
#include "nn/weights/functions.h"

namespace swarmcert {
namespace {

using files::Network;
using lipschitz::CertifiedBound;

/// Two kinds of vehicles; small ones have no network between a small and a large one, if asked for.
Network two_kinds(bool is_silent) {
  std::mt19937 generator(6);
  Network net;
  net.phi["large"] = tests::random_network({6, 7, 5}, generator);
  net.phi["small"] = tests::random_network({6, 8, 5}, generator);
  net.rho["large"] = tests::random_network({5, 6, 1}, generator);
  net.rho["small"] = tests::random_network({5, 6, 1}, generator);
  if (is_silent) net.silent["small"] = {{"large", "small"}};
  return net;
}

lipschitz::CertifyOptions one_round() {
  lipschitz::CertifyOptions options;
  options.lower.rounds = 1;
  options.neighbours = 2;
  return options;
}

TEST(Silent, UpperBoundsAndLawsStayAndLowerOnesOfTheKindAreNotStated) {
  const lipschitz::Certification found = lipschitz::certify(two_kinds(true), one_round());
  const lipschitz::Certification plain = lipschitz::certify(two_kinds(false), one_round());
  ASSERT_EQ(found.bounds.size(), plain.bounds.size());
  for (std::size_t i = 0; i < found.bounds.size(); ++i) {
    const CertifiedBound &bound = found.bounds[i], &same = plain.bounds[i];
    EXPECT_EQ(bound.upper.value(), same.upper.value()) << bound.function;
    EXPECT_TRUE(same.lower.witness) << bound.function;
    const bool is_silent = bound.function == "set:large:small" || bound.function == "set:small:small";
    EXPECT_EQ(bound.lower.witness.has_value(), !is_silent) << bound.function;
  }
  ASSERT_EQ(found.laws.size(), plain.laws.size());
  for (std::size_t i = 0; i < found.laws.size(); ++i)
    EXPECT_EQ(found.laws[i].upper.value(), plain.laws[i].upper.value());
}

TEST(Silent, ACertificateSaysSoAndIsOneOfThisNetworkOnly) {
  const Network silent = two_kinds(true), plain = two_kinds(false);
  const files::Json certificate = lipschitz::certificate(silent, lipschitz::certify(silent, one_round()));
  EXPECT_NE(certificate["statement"].get<std::string>().find("step by all of their value"),
            std::string::npos);
  const check::CheckResult checked = check::check(certificate, silent);
  EXPECT_TRUE(checked.accepted) << checked.reason;
  EXPECT_FALSE(check::check(certificate, plain).accepted);
  const files::Json of_plain = lipschitz::certificate(plain, lipschitz::certify(plain, one_round()));
  EXPECT_FALSE(check::check(of_plain, silent).accepted);
}

/// What holds of rho of a sum is false where the function is 0 instead.
TEST(Silent, TheCheckerRefusesWitnessesAndValuesOfWhatIsSomewhereZero) {
  const Network silent = two_kinds(true), plain = two_kinds(false);
  lipschitz::CertifyOptions options = one_round();
  for (const std::string part : {"phi:large", "phi:small"})
    options.domain[part] = {std::vector<double>(6, -1), std::vector<double>(6, 1)};
  lipschitz::Certification found = lipschitz::certify(plain, options);
  std::map<std::string, double> rho_bound;
  for (const CertifiedBound& bound : found.bounds)
    if (files::is_rho(bound.function)) rho_bound[files::kind_of(bound.function)] = bound.upper.value();
  found.values = lipschitz::certified_values(plain, options.domain, rho_bound, {2, false, false, 0});
  files::Json certificate = lipschitz::certificate(plain, found);
  EXPECT_TRUE(check::check(certificate, plain).accepted);
  certificate["statement"] = lipschitz::certificate(silent, {})["statement"];
  const auto refused = [&silent](files::Json changed) {
    changed["content_sha256"] = files::content_sha256(changed);
    return check::check(changed, silent).reason;
  };
  EXPECT_NE(refused(certificate).find("a lower bound of a function that is 0 in some compositions"),
            std::string::npos)
      << refused(certificate);
  for (files::Json& bound : certificate["bounds"])
    bound["lower"] = bound["lower_hex"] = bound["lower_witness"] = nullptr;
  EXPECT_NE(refused(certificate).find("values of a function that is 0 in some compositions"),
            std::string::npos)
      << refused(certificate);
  certificate["values"] = files::Json::array();
  EXPECT_NE(refused(certificate).find("every statement verified"), std::string::npos) << refused(certificate);
}

TEST(Silent, RangesJumpsBoxesAndWitnessesAreRefusedByName) {
  const Network net = two_kinds(true);
  lipschitz::CertifyOptions options = one_round();
  options.domain["phi:small"] = {std::vector<double>(6, -1), std::vector<double>(6, 1)};
  EXPECT_THROW(lipschitz::certify(net, options), std::invalid_argument);
  options.domain.clear();
  options.method = lipschitz::UpperMethod::kBranch;
  EXPECT_THROW(lipschitz::certify(net, options), std::invalid_argument);
  EXPECT_THROW(lipschitz::slope_function(net, "set:small:small", {}), std::invalid_argument);
  EXPECT_NO_THROW(lipschitz::slope_function(net, "set:small:large", {}));
  EXPECT_TRUE(
      tests::refuses([&] { lipschitz::ranges(net, options.domain, {}, {}); },
                     {"silent", "large+small>small", "ranges are of networks that are silent nowhere"}));
  EXPECT_TRUE(tests::refuses([&] { lipschitz::certified_values(net, options.domain, {}, {}); }, {"silent"}));
}

}  // namespace
}  // namespace swarmcert
