#include <algorithm>
#include <cmath>

#include "lipschitz/boxes.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/witness.h"
#include "lipschitz/networks.h"
#include "lipschitz/values/range.h"
#include "nn/base/content_hash.h"
#include "nn/base/random.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert {
namespace {

using files::Network;
using lipschitz::CertifiedBound;
using lipschitz::CertifiedRange;
using Compositions = std::set<std::vector<std::string>>;

/// Two kinds of vehicles; small ones have no network in some compositions. f is near 5 and neighbours change it little,
/// so its range does not contain 0, and steps to 0 are larger than all others.
Network two_kinds(const Compositions& silent, bool with_ground = false) {
  std::mt19937 generator(6);
  Network net;
  net.phi["large"] = tests::random_network({6, 7, 5}, generator);
  net.phi["small"] = tests::random_network({6, 8, 5}, generator);
  net.rho["large"] = tests::random_network({5, 6, 1}, generator);
  net.rho["small"] = tests::random_network({5, 6, 1}, generator);
  if (with_ground) net.phi["ground"] = tests::random_network({4, 6, 5}, generator);
  for (auto& [kind, phi] : net.phi) {
    for (double& weight : phi.layers.back().weights) weight *= 0.125;
    for (double& bias : phi.layers.back().biases) bias *= 0.125;
  }
  for (auto& [kind, rho] : net.rho) {
    double& bias = rho.layers.back().biases[0];
    bias = static_cast<float>(bias + 5);
  }
  net.sha256 = "made by a test";
  if (!silent.empty()) net.silent["small"] = silent;
  return net;
}

const Compositions kSomeSilent = {{"large", "small"}, {"small", "small"}};

tests::Domain cubes(const Network& net) {
  tests::Domain domain;
  for (const auto& [kind, phi] : net.phi)
    domain[files::FunctionId::phi(kind)] = tests::cube(phi.inputs(), 0.5);
  return domain;
}

lipschitz::CertifyOptions one_round() {
  lipschitz::CertifyOptions options;
  options.lower.rounds = 3;
  options.neighbours = 2;
  options.jobs = 1;
  return options;
}

std::map<std::string, double> rho_bounds(const lipschitz::Certification& found) {
  std::map<std::string, double> bounds;
  for (const CertifiedBound& bound : found.bounds)
    if (bound.function.is_rho()) bounds[bound.function.kind()] = bound.upper.value();
  return bounds;
}

/// Certifies ranges, jumps and float32 errors for up to `neighbours` neighbours.
lipschitz::Certification with_values(const Network& net, int neighbours) {
  lipschitz::CertifyOptions options = one_round();
  options.domain = cubes(net);
  lipschitz::Certification found = lipschitz::certify(net, options);
  found.values =
      lipschitz::certified_values(net, options.domain, rho_bounds(found), {neighbours, false, false, 0});
  return found;
}

/// Values of f for neighbours anywhere in their boxes, evaluated without the functions under test.
class Flown {
 public:
  explicit Flown(const Network& net) : net_(net), random_(3) {
    for (const auto& [name, weights] : files::parts(net)) evaluators_.emplace(name, *weights);
    ground_ = point("phi:ground");
  }

  std::vector<double> point(const files::FunctionId& part) {
    std::vector<double> x;
    const auto inputs = static_cast<std::size_t>(part.is_ground_phi() ? 4 : 6);
    const lipschitz::Box box = tests::cube(static_cast<int>(inputs), 0.5);
    for (std::size_t k = 0; k < inputs; ++k) {
      const double r = std::clamp(1.5 * random_.uniform() - 0.25, 0.0, 1.0);
      x.push_back(box.lower[k] + r * (box.upper[k] - box.lower[k]));
    }
    return x;
  }

  void move_ground() { ground_ = point("phi:ground"); }
  void add(const std::string& kind) { neighbours_.emplace_back(kind, point("phi:" + kind)); }
  void remove_last() { neighbours_.pop_back(); }
  void clear() { neighbours_.clear(); }

  bool is_silent(const std::string& own) const {
    std::vector<std::string> kinds;
    for (const auto& [kind, x] : neighbours_) kinds.push_back(kind);
    std::sort(kinds.begin(), kinds.end());
    const auto found = net_.silent.find(own);
    return found != net_.silent.end() && found->second.count(kinds) == 1;
  }

  double force(const std::string& own) const {
    if (is_silent(own)) return 0;
    std::vector<double> sum(5);
    const auto add = [&sum](const std::vector<double>& term) {
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += term[i];
    };
    for (const auto& [kind, x] : neighbours_) add(evaluators_.at("phi:" + kind)(x));
    if (net_.phi.count("ground") == 1) add(evaluators_.at("phi:ground")(ground_));
    return evaluators_.at("rho:" + own)(sum)[0];
  }

 private:
  const Network& net_;
  files::Random random_;
  std::map<files::FunctionId, files::Evaluator<double>> evaluators_;
  std::vector<std::pair<std::string, std::vector<double>>> neighbours_;
  std::vector<double> ground_;
};

/// The certified values of `function` for at most `neighbours` neighbours.
struct Stated {
  files::FunctionId function;
  int neighbours;
  double lower, upper, jump;
};

std::vector<Stated> all_stated(const Network& net, int neighbours) {
  const lipschitz::Certification found = with_values(net, neighbours);
  lipschitz::RangeOptions options;
  options.neighbours = neighbours;
  options.nodes = 200;
  options.jobs = 1;
  std::vector<Stated> result;
  for (const CertifiedRange& range : lipschitz::ranges(net, cubes(net), rho_bounds(found), options)) {
    result.push_back({range.function, range.neighbours_at_most, range.lower, range.upper, range.jump});
    EXPECT_LE(range.lower, range.least.value) << range.function;
    EXPECT_GE(range.upper, range.greatest.value) << range.function;
    EXPECT_LE(range.least.value, range.greatest.value) << range.function;
  }
  for (const lipschitz::CertifiedValues& values : found.values)
    result.push_back(
        {values.function, values.neighbours, values.lower[0], values.upper[0], values.jump.value()});
  const files::Json certificate = lipschitz::certificate(net, found);
  EXPECT_TRUE(check::check(certificate, net).accepted) << check::check(certificate, net).reason;
  return result;
}

/// Checks random compositions against the certified values. Returns the largest step to or from a silent composition
/// when a neighbour enters or leaves.
double expect_flights_within(const Network& net, int neighbours) {
  const std::vector<Stated> all = all_stated(net, neighbours);
  EXPECT_EQ(all.size(), 2 * 4 * static_cast<std::size_t>(neighbours))
      << "ranges and values of four functions";
  constexpr double kRounding = 1e-9;
  double largest_silent_step = 0;
  for (const Stated& one : all) {
    const std::string kind = one.function.phi_kind(), own = one.function.rho_kind();
    Flown flown(net);
    files::Random random(7);
    for (int sample = 0; sample < 300; ++sample) {
      flown.move_ground();
      for (std::uint64_t n = random.below(static_cast<std::uint64_t>(one.neighbours) + 1); n > 0; --n)
        flown.add(kind);
      EXPECT_LE(one.lower - kRounding, flown.force(own)) << one.function;
      EXPECT_GE(one.upper + kRounding, flown.force(own)) << one.function;
      flown.clear();
      for (std::uint64_t n = random.below(3); n > 0; --n) flown.add(random.below(2) == 0 ? "large" : "small");
      const double before = flown.force(own);
      const bool was_silent = flown.is_silent(own);
      flown.add(kind);
      const double step = std::abs(flown.force(own) - before);
      EXPECT_LE(step, one.jump + kRounding) << one.function;
      if (was_silent != flown.is_silent(own)) largest_silent_step = std::max(largest_silent_step, step);
      flown.clear();
    }
  }
  return largest_silent_step;
}

TEST(Silent, NoValueLeavesTheRangeAndNoStepTheJumpAmongAllCompositions) {
  for (const bool with_ground : {false, true}) {
    const Network net = two_kinds(kSomeSilent, with_ground);
    const double step = expect_flights_within(net, 3);
    double plain_jump = 0;
    for (const Stated& one : all_stated(two_kinds({}, with_ground), 3))
      if (one.function.rho_kind() == "small") plain_jump = std::max(plain_jump, one.jump);
    EXPECT_GT(step, plain_jump) << "the step does not exceed the jump of the network that is never silent";
  }
  Network smooth = two_kinds(kSomeSilent);
  tests::set_activation(smooth.phi.at("small"), files::Activation::kTanh);
  EXPECT_GT(expect_flights_within(smooth, 2), 3);
}

TEST(Silent, OfOneKindEveryStepUpToTheNumberOfNeighboursCounts) {
  Network net = two_kinds({{"small", "small"}});
  net.phi.erase("large");
  net.rho.erase("large");
  lipschitz::RangeOptions options;
  options.neighbours = 3;
  options.nodes = 200;
  const auto found = lipschitz::ranges(net, cubes(net), {{"small", 1e6}}, options);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_LT(found[0].jump, 3) << "no second neighbour can enter yet";
  EXPECT_GT(found[0].lower, 0);
  for (const std::size_t n : {1u, 2u}) {
    EXPECT_EQ(found[n].lower, 0) << n;
    EXPECT_EQ(found[n].least.value, 0) << n;
    EXPECT_EQ(found[n].least.networks.size(), 2u) << "attained by the pair";
    EXPECT_GT(found[n].jump, 4) << n;
  }
}

TEST(Silent, TheRangeIsNothingButZeroWhereTheNetworkNeverSpeaks) {
  const Network net = two_kinds({{}, {"small"}});
  int seen = 0;
  for (const Stated& one : all_stated(net, 2)) {
    if (one.function != "set:small:small" || one.neighbours != 1) continue;
    EXPECT_EQ(one.lower, 0);
    EXPECT_EQ(one.upper, 0);
    EXPECT_GT(one.jump, 4) << "a second neighbour may enter";
    ++seen;
  }
  EXPECT_EQ(seen, 2);
}

TEST(Silent, UpperBoundsAndLawsStayOnBoxesAsWellAndWitnessesAreAmongOtherNeighbours) {
  const Network net = two_kinds({{"small"}, {"large", "small"}}), always = two_kinds({});
  for (const bool on_box : {false, true}) {
    lipschitz::CertifyOptions options = one_round();
    if (on_box) options.domain = cubes(net);
    if (on_box) options.method = lipschitz::UpperMethod::kBranch;
    options.branch.nodes = 20;
    const lipschitz::Certification found = lipschitz::certify(net, options);
    const lipschitz::Certification plain = lipschitz::certify(always, options);
    ASSERT_EQ(found.bounds.size(), plain.bounds.size());
    for (std::size_t i = 0; i < found.bounds.size(); ++i) {
      const CertifiedBound &bound = found.bounds[i], &same = plain.bounds[i];
      // Branch and bound stops close to a witness, and the witnesses differ.
      EXPECT_LE(std::abs(bound.upper.value() - same.upper.value()), (on_box ? 0.05 : 0) * same.upper.value());
      std::vector<files::FunctionId> there = bound.lower.other_networks;
      there.push_back(bound.function.input_part());
      EXPECT_FALSE(bound.lower.witness && files::is_silent_among(net, bound.function, there))
          << bound.function;
      EXPECT_TRUE(bound.lower.witness || !bound.neighbours.empty()) << bound.function;
    }
    ASSERT_EQ(found.laws.size(), plain.laws.size());
    const files::Json certificate = lipschitz::certificate(net, found);
    EXPECT_NE(certificate["statement"].get<std::string>().find(": large+small>small, small>small."),
              std::string::npos);
    EXPECT_TRUE(check::check(certificate, net).accepted) << check::check(certificate, net).reason;
    EXPECT_FALSE(check::check(certificate, always).accepted);
    EXPECT_FALSE(check::check(lipschitz::certificate(always, plain), net).accepted);
  }
  EXPECT_THROW(lipschitz::slope_function(net, "set:small:small", {}), std::invalid_argument);
  EXPECT_THROW(lipschitz::slope_function(net, "set:large:small", {"phi:small"}), std::invalid_argument);
  EXPECT_NO_THROW(lipschitz::slope_function(net, "set:small:small", {"phi:small"}));
  EXPECT_NO_THROW(lipschitz::slope_function(net, "set:small:large", {}));
}

/// Statements about rho of a sum are false if the function is 0 instead.
TEST(Silent, TheCheckerRefusesWhatIsTrueOfTheNetworkThatIsNeverSilentOnly) {
  const Network plain = two_kinds({});
  const lipschitz::Certification found = with_values(plain, 2);
  std::vector<std::string> witnessed = {"small"};
  for (const files::FunctionId& other : tests::bound_of(found, "set:small:small").lower.other_networks)
    witnessed.push_back(other.kind());
  std::sort(witnessed.begin(), witnessed.end());
  const Network silent = two_kinds({{"small"}, witnessed});
  files::Json certificate = lipschitz::certificate(plain, found);
  ASSERT_TRUE(check::check(certificate, plain).accepted) << check::check(certificate, plain).reason;
  certificate["statement"] = check::statement_for(silent);
  certificate["network"]["silent"] = files::silent_compositions(silent);
  const auto said = [&silent](files::Json changed) {
    changed["content_sha256"] = files::content_sha256(changed);
    return check::check(changed, silent).reason;
  };
  EXPECT_NE(said(certificate).find("set:small:small is 0 among these neighbours"), std::string::npos)
      << said(certificate);
  for (files::Json& bound : certificate["bounds"])
    bound["lower"] = bound["lower_hex"] = bound["lower_witness"] = nullptr;
  EXPECT_NE(said(certificate).find("claims less than the step"), std::string::npos) << said(certificate);
  for (files::Json& values : certificate["values"]) {
    values["jump"] = 100;
    values["jump_hex"] = files::hex_float(100);
  }
  EXPECT_NE(said(certificate).find("the range lacks 0"), std::string::npos) << said(certificate);
  for (files::Json& values : certificate["values"]) values["lower"][0] = files::hex_float(-100);
  EXPECT_NE(said(certificate).find("every statement verified"), std::string::npos) << said(certificate);
  for (files::Json& values : certificate["values"]) values["upper"][0] = files::hex_float(0);
  EXPECT_NE(said(certificate).find("the values leave the range"), std::string::npos) << said(certificate);
}

TEST(Silent, FromTheFirstLayerOnTheStepIsBoundedByWhatItIsBesideSilence) {
  // One input, no round-off: f = 5 + x next to silence, |x| <= 1; the network itself changes by at most 1.
  Network net =
      tests::deep_set(tests::weights({tests::layer(1, 1, {1})}), tests::weights({tests::layer(1, 1, {1})}));
  net.rho.at("default").layers[0].biases[0] = 5;
  net.sha256 = "made by a test";
  net.silent["default"] = {{}};
  lipschitz::CertifyOptions options = one_round();
  options.domain["phi:default"] = {{-1}, {1}};
  lipschitz::Certification found = lipschitz::certify(net, options);
  found.values = lipschitz::certified_values(net, options.domain, rho_bounds(found), {1, false, false, 0});
  ASSERT_EQ(found.values.size(), 1u);
  EXPECT_EQ(found.values[0].jump, 6);
  EXPECT_EQ(found.values[0].lower[0], 0);
  EXPECT_EQ(found.values[0].upper[0], 6);
  const auto accepts = [&](double jump) {
    lipschitz::Certification changed = found;
    changed.values[0].jump = jump;
    return check::check(lipschitz::certificate(net, changed), net).accepted;
  };
  EXPECT_TRUE(accepts(6));
  EXPECT_FALSE(accepts(std::nextafter(6.0, 0.0)));
}

}  // namespace
}  // namespace swarmcert
