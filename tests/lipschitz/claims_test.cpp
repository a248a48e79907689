#include "lipschitz/base/claims.h"

#include <Eigen/Core>

#include "data.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/networks.h"
#include "nn/base/file_io.h"
#include "nn/refusal.h"
#include "nn/temp_folder.h"

namespace swarmcert::lipschitz {
namespace {

using files::Network;

double block_bound(const Network& network, const files::FunctionId& function, const std::string& block,
                   const std::vector<double>& scale = {}) {
  return tests::proved(sdp_bound(check::stages(network, function, block, scale)));
}

const CertifiedBound& bound_of(const Certification& found, const files::FunctionId& function,
                               const std::string& block) {
  for (const CertifiedBound& bound : found.bounds)
    if (bound.function == function && bound.block == block && bound.scale.empty()) return bound;
  throw std::logic_error("no bound for " + function.name() + " " + block);
}

double law_of(const Certification& found, LawKind law, const Neighbours& neighbours,
              const std::string& block = "all") {
  for (const CertifiedLaw& one : found.laws)
    if (one.law == law && one.neighbours == neighbours && one.block == block) return one.upper.value();
  throw std::logic_error("no such law");
}

Network published(const std::string& phi, const std::string& rho) {
  files::NetworkArguments arguments;
  arguments.phi = tests::data_path("weights/zip_f32/" + phi);
  arguments.rho = tests::data_path("weights/zip_f32/" + rho);
  return files::load_network(arguments);
}

/// Returns a NET with two kinds of six inputs and a ground of four inputs.
Network mixed_network(std::mt19937& generator) {
  Network network;
  network.phi["ground"] = tests::random_network({4, 5, 4}, generator);
  network.phi["large"] = tests::random_network({6, 7, 4}, generator);
  network.phi["small"] = tests::random_network({6, 5, 5, 4}, generator);
  network.rho["small"] = tests::random_network({4, 6, 1}, generator);
  network.input_order = {"dp_x_m", "dp_y_m", "dp_z_m", "dv_x_m_s", "dv_y_m_s", "dv_z_m_s"};
  return network;
}

/// Returns the set function of several neighbours as one chain in all their inputs, whose bound a law must not
/// undercut.
std::vector<check::Matrix> joint_stages(const std::vector<std::vector<check::Matrix>>& terms) {
  std::vector<check::Matrix> joint;
  const std::size_t depth = terms.front().size();
  std::size_t shared = 0;  // number of stages of phi, placed side by side; all phi here have the same depth
  while (shared + 1 < depth && terms.size() > 1 && terms[0][depth - 1 - shared].entries.size() > 0) {
    bool equal = true;
    for (const auto& term : terms) {
      const check::Matrix& a = term[depth - 1 - shared];
      const check::Matrix& b = terms[0][depth - 1 - shared];
      equal = equal && a.rows == b.rows && a.cols == b.cols;
      for (std::size_t i = 0; equal && i < a.entries.size(); ++i)
        equal = (a.entries[i] - b.entries[i]).sign() == 0;
    }
    if (!equal) break;
    ++shared;
  }
  const std::size_t merged = depth - 1 - shared;  // the stage in which the terms are summed: [M_1 M_2 ...]
  for (std::size_t k = 0; k < depth; ++k) {
    if (k > merged) {
      joint.push_back(terms[0][k]);
      continue;
    }
    int rows = 0;
    int cols = 0;
    for (const auto& term : terms) rows += term[k].rows, cols += term[k].cols;
    check::Matrix m(k == merged ? terms[0][k].rows : rows, cols);
    int row = 0;
    int col = 0;
    for (const auto& term : terms) {
      for (int i = 0; i < term[k].rows; ++i)
        for (int j = 0; j < term[k].cols; ++j) m(row + i, col + j) = term[k](i, j);
      row += k == merged ? 0 : term[k].rows;
      col += term[k].cols;
    }
    joint.push_back(m);
  }
  return joint;
}

TEST(Claims, BlocksOfTheFlownNetworkAreAsPublishedInTheReference) {
  SWARMCERT_NEEDS_DATA();
  const Network network = published("phi_L.pth", "rho_L.pth");
  // Joint LipSDP with the columns of the block, from an independent solver.
  EXPECT_NEAR(block_bound(network, "set:default:default", "position"), 415.12925, 5e-4);
  EXPECT_NEAR(block_bound(network, "set:default:default", "velocity"), 63.222528, 5e-5);
  EXPECT_NEAR(block_bound(network, "set:default:default", "x2"), 165.65935, 5e-4);
  EXPECT_NEAR(block_bound(network, "set:default:default", "x5"), 45.658888, 5e-5);
  EXPECT_NEAR(block_bound(network, "phi:default", "position"), 24.58392, 5e-5);
  EXPECT_NEAR(block_bound(network, "phi:default", "velocity"), 3.6855246, 5e-6);
}

TEST(Claims, BlocksOfALinearNetworkAreTheNormsOfItsColumns) {
  const Network network = tests::plain(tests::weights({tests::layer(1, 6, {3, 4, 0, 5, 0, 12})}));
  EXPECT_NEAR(block_bound(network, "network", "position"), 5, 1e-12);
  EXPECT_NEAR(block_bound(network, "network", "velocity"), 13, 1e-12);
  EXPECT_NEAR(block_bound(network, "network", "x1"), 4, 1e-12);
  EXPECT_NEAR(block_bound(network, "network", "all"), std::sqrt(9 + 16 + 25 + 144), 1e-12);
  // Weighted: f = 3 x0 + ... = (3 s0) (x0 / s0) + ...
  EXPECT_NEAR(block_bound(network, "network", "all", {1, 2, 1, 1, 1, 0.5}), std::sqrt(9 + 64 + 25 + 36),
              1e-12);
}

TEST(Claims, NoBlockExceedsTheWholeAndTogetherTheyReachIt) {
  std::mt19937 generator(5);
  for (int round = 0; round < 4; ++round) {
    const Network network = mixed_network(generator);
    const double whole = block_bound(network, "set:small:small", "all");
    const double position = block_bound(network, "set:small:small", "position");
    const double velocity = block_bound(network, "set:small:small", "velocity");
    EXPECT_LE(position, whole * (1 + 1e-7));
    EXPECT_LE(velocity, whole * (1 + 1e-7));
    // By the Cauchy-Schwarz inequality, sqrt(Lp^2 + Lv^2) bounds the whole, so the SDP cannot be much looser.
    EXPECT_GE(std::hypot(position, velocity), whole * 0.999);
  }
}

TEST(Claims, JointBlockBoundHoldsForEveryPairOfPoints) {
  std::mt19937 generator(6);
  const Network network = mixed_network(generator);
  const files::Weights& phi = network.phi.at("large");
  const double position = block_bound(network, "phi:large", "position");
  const double velocity = block_bound(network, "phi:large", "velocity");
  const files::Evaluator<double> f(phi);
  double closest = 0;
  for (int sample = 0; sample < 20000; ++sample) {
    std::vector<double> x, y;
    double dp = 0;
    double dv = 0;
    const double radius = std::exp2(static_cast<double>(generator() % 10) - 6);
    for (int k = 0; k < 6; ++k) {
      x.push_back(3.0 * static_cast<double>(tests::random_number(generator)));
      y.push_back(x[k] + radius * static_cast<double>(tests::random_number(generator)));
      (k < 3 ? dp : dv) += (x[k] - y[k]) * (x[k] - y[k]);
    }
    const std::vector<double> fx = f(x), fy = f(y);
    double df = 0;
    for (std::size_t i = 0; i < fx.size(); ++i) df += (fx[i] - fy[i]) * (fx[i] - fy[i]);
    const double allowed = position * std::sqrt(dp) + velocity * std::sqrt(dv);
    ASSERT_LE(std::sqrt(df), allowed * (1 + 1e-12));
    closest = std::max(closest, std::sqrt(df) / allowed);
  }
  EXPECT_GT(closest, 0.2) << "the samples are not close to the bound";
}

TEST(Claims, TwoNeighboursMatchTheDirectJointComputation) {
  SWARMCERT_NEEDS_DATA();
  const Network network = published("phi_L.pth", "rho_L.pth");
  const std::vector<check::Matrix> one = check::stages(network, "set:default:default");
  const double k = tests::proved(sdp_bound(one));
  const double law = law_bound(LawKind::kAllStacked, {{UpperBound(k), 2}}).value();
  const double direct = tests::proved(sdp_bound(joint_stages({one, one})));
  EXPECT_NEAR(law, 590.5766, 1e-3);  // joint LipSDP with two copies, from an independent solver
  EXPECT_NEAR(direct, law, 2e-5 * law);
}

TEST(Claims, LawsBoundTheJointFunctionOfMixedKinds) {
  std::mt19937 generator(7);
  Network network;
  network.phi["large"] = tests::random_network({6, 7, 4}, generator);
  network.phi["small"] = tests::random_network({6, 5, 4}, generator);
  network.rho["small"] = tests::random_network({4, 6, 1}, generator);
  const std::vector<check::Matrix> large = check::stages(network, "set:large:small");
  const std::vector<check::Matrix> small = check::stages(network, "set:small:small");
  const double direct = tests::proved(sdp_bound(joint_stages({large, small, small})));
  const std::vector<std::pair<UpperBound, int>> terms = {{UpperBound(tests::proved(sdp_bound(large))), 1},
                                                         {UpperBound(tests::proved(sdp_bound(small))), 2}};
  const double law = law_bound(LawKind::kAllStacked, terms).value();
  EXPECT_GE(law, direct * (1 - 1e-7));
  EXPECT_LE(law, direct * 1.5);
  EXPECT_GE(law_bound(LawKind::kAllMax, terms).value(), law);
}

TEST(Claims, LawsOfTinyAndHugeBoundsAreNeitherLostNorEndless) {
  for (const double k : {0.0, 5e-324, 3e-310, 1e-170, 1.0, 1e170, 1e300}) {
    const double stacked = law_bound(LawKind::kAllStacked, {{UpperBound(k), 4}}).value();
    EXPECT_EQ(stacked, 2 * k) << k;
    EXPECT_EQ(law_bound(LawKind::kAllMax, {{UpperBound(k), 4}}).value(), 4 * k) << k;
  }
  EXPECT_TRUE(std::isinf(law_bound(LawKind::kAllMax, {{UpperBound(1e308), 4}}).value()));
  EXPECT_TRUE(std::isinf(law_bound(LawKind::kAllStacked, {{UpperBound(INFINITY), 4}}).value()));
}

TEST(Claims, LawsAddUpTheirTermsAndTheGround) {
  std::mt19937 generator(8);
  const Network network = mixed_network(generator);
  CertifyOptions options;
  options.lower.rounds = 0;
  options.neighbours = 3;
  options.mixture = {{"small", 1}, {"large", 2}};
  options.blocks = {"position", "velocity"};
  const Certification found = certify(network, options);
  for (const std::string block : {"all", "position", "velocity"}) {
    const double small = bound_of(found, "set:small:small", block).upper.value();
    const double large = bound_of(found, "set:large:small", block).upper.value();
    const double ground = bound_of(found, "set:ground:small", block).upper.value();
    EXPECT_NEAR(law_of(found, LawKind::kAllStacked, {{"small", 3}}, block),
                std::sqrt(3 * small * small + ground * ground), 1e-9);
    EXPECT_NEAR(law_of(found, LawKind::kAllMax, {{"large", 3}}, block), 3 * large + ground, 1e-9);
    EXPECT_NEAR(law_of(found, LawKind::kOwnState, options.mixture, block), small + 2 * large + ground, 1e-9);
  }
  EXPECT_EQ(found.laws.size(), 27u);  // 3 groups, 3 blocks, 3 laws
  const check::CheckResult result = check::check(certificate(network, found), network);
  EXPECT_TRUE(result.accepted) << result.reason;
}

/// f(own) = relu(x1) + ... with all neighbours at the same place: the own-state law, with factor n, is attained, so a
/// factor sqrt(n) would be wrong.
TEST(Claims, OwnStateLawIsAttainedAndGrowsWithNNotWithItsRoot) {
  Network network = tests::deep_set(tests::weights({tests::layer(1, 2, {2, 0})}),
                                    tests::weights({tests::layer(1, 1, {3})}));
  CertifyOptions options;
  options.lower.rounds = 0;
  options.neighbours = 4;
  const Certification found = certify(network, options);
  EXPECT_NEAR(law_of(found, LawKind::kOwnState, {{"default", 4}}), 24, 1e-9);  // f = 3 * 4 * 2 * x: slope 24
  EXPECT_NEAR(law_of(found, LawKind::kAllStacked, {{"default", 4}}), 12, 1e-9);  // sqrt(4) * 6
}

TEST(Claims, WitnessesLieInTheBlockTheBoxAndTheNorm) {
  std::mt19937 generator(9);
  const Network network = mixed_network(generator);
  CertifyOptions options;
  options.lower.rounds = 1;
  options.blocks = {"every"};
  options.scale = {1, 1, 1, 2, 2, 3};
  options.domain["phi:small"] = options.domain["phi:large"] = {{-1, -1, -1, -2, -2, -2}, {1, 1, 1, 2, 2, 2}};
  options.domain["phi:ground"] = {{-1, -2, -2, -2}, {1, 2, 2, 2}};
  const Certification found = certify(network, options);
  int boxed = 0;
  int scaled = 0;
  for (const CertifiedBound& bound : found.bounds) {
    ASSERT_TRUE(bound.lower.witness) << bound.function << " " << bound.block;
    EXPECT_LE(bound.lower.witness->slope.value(), bound.upper.value())
        << bound.function << " " << bound.block;
    EXPECT_EQ(bound.domain, bound.function.is_rho() ? "global" : "box");
    boxed += bound.domain == "box" ? 1 : 0;
    scaled += bound.scale.empty() ? 0 : 1;
  }
  EXPECT_EQ(boxed, 6 + 2 * (6 + 8 + 8) + 4);  // six functions, their blocks, four of six inputs scaled
  EXPECT_EQ(scaled, 4);
  const check::CheckResult result = check::check(certificate(network, found), network);
  EXPECT_TRUE(result.accepted) << result.reason;
}

TEST(Claims, WhatNoFunctionHasIsRefused) {
  std::mt19937 generator(10);
  const Network network = mixed_network(generator);
  ClaimOptions options;
  options.blocks = {"x9"};
  EXPECT_THROW(claims(network, options), std::invalid_argument);
  options.blocks = {};
  options.scale = {1, 2};
  EXPECT_THROW(claims(network, options), std::invalid_argument);
  options.scale = {1, 1, 1, 1, 1, 0};
  EXPECT_THROW(claims(network, options), std::invalid_argument);
  options.mixture = {{"ground", 1}};
  EXPECT_THROW(law_claims(network, options), std::invalid_argument);
  options.mixture = {{"nobody", 1}};
  EXPECT_THROW(law_claims(network, options), std::invalid_argument);
  options.mixture = {{"small", 0}};
  EXPECT_THROW(law_claims(network, options), std::invalid_argument);
}

TEST(Gamma, IsJudgedAsItIsStated) {
  using files::GammaStatement;
  const auto norm = [](double lower, double upper) {
    return Enclosure{LowerBound(lower), UpperBound(upper)};
  };
  const auto judged = [&](double value, GammaStatement::Scope scope, GammaStatement::Mode mode,
                          const std::vector<Enclosure>& norms) {
    return respects_gamma({value, scope, mode}, norms);
  };
  const auto layer = GammaStatement::Scope::kLayer;
  const auto whole = GammaStatement::Scope::kNetwork;
  const auto clip = GammaStatement::Mode::kClip;
  const auto equal = GammaStatement::Mode::kEqual;
  using Verdicts = std::vector<Verdict>;
  const Verdict yes = Verdict::kProved;
  const Verdict no = Verdict::kRefuted;
  const Verdict unknown = Verdict::kInconclusive;
  const std::vector<Enclosure> norms = {norm(2, 2), norm(8, 8)};
  EXPECT_EQ(judged(4, layer, clip, norms), (Verdicts{yes, no}));
  // 2 * 8 = 16, although 8 is above its share of 4.
  EXPECT_EQ(judged(16, whole, clip, norms), (Verdicts{yes, yes}));
  EXPECT_EQ(judged(15.999, whole, clip, norms), (Verdicts{no, no}));
  EXPECT_EQ(judged(16, whole, equal, norms), (Verdicts{no, no}));
  EXPECT_EQ(judged(16, whole, equal, {norm(4, 4), norm(4 * (1 - 1e-8), 4)}), (Verdicts{yes, yes}));
  EXPECT_EQ(judged(2, layer, equal, norms), (Verdicts{yes, no}));
  EXPECT_EQ(judged(3, layer, equal, {norm(2.9, 2.95)}), (Verdicts{no}));
  EXPECT_EQ(judged(3, layer, clip, {norm(2.9, 3.1)}), (Verdicts{unknown}));
  EXPECT_EQ(judged(9, whole, clip, {norm(2.9, 3.1), norm(3, 3)}), (Verdicts{unknown, unknown}));
}

TEST(Domain, IsReadForEveryPartAndRefusedWithLineAndMend) {
  std::mt19937 generator(11);
  const Network network = mixed_network(generator);
  const tests::TempFolder folder;
  const std::string path = folder / "box.toml";
  const auto read = [&](const std::string& text) {
    files::write_file(path, "schema = \"swarmcert/box/1\"\n" + text, true);
    return read_domain(path, network);
  };
  const std::string box = "lower = [-1,-1,-1,-2,-2,-2]\nupper = [1,1,1,2,2,2]\n";
  EXPECT_EQ(read(box).at("phi:large").lower, (std::vector<double>{-1, -1, -1, -2, -2, -2}));
  EXPECT_EQ(read(box).at("phi:ground").upper, (std::vector<double>{1, 2, 2, 2}));
  EXPECT_EQ(read(box + "ground = { lower = [0,0,0,0], upper = [3,1,1,1] }\n").at("phi:ground").upper,
            (std::vector<double>{3, 1, 1, 1}));
  EXPECT_TRUE(
      tests::refuses([&] { read("lower = [1]\nupper = [1]\n"); }, {"line 2", "1 numbers", "6 inputs"}));
  EXPECT_TRUE(tests::refuses([&] { read("lower = [1,1,1,1,1,1]\nupper = [0,1,1,1,1,1]\n"); },
                             {"line 2", "entry 0 is above"}));
  EXPECT_TRUE(tests::refuses([&] { read(box + "uper = 3\n"); }, {"uper", "did you mean"}));
  EXPECT_TRUE(tests::refuses([&] { read(box + "ground = { lower = [0], upper = [3] }\n"); }, {"4 inputs"}));
  files::write_file(path, "schema = \"swarmcert/network/1\"\n", true);
  EXPECT_TRUE(tests::refuses([&] { read_domain(path, network); }, {"schema", "swarmcert/box/1"}));
  const Network plain = tests::plain(tests::random_network({2, 1}, generator));
  files::write_file(path, "schema = \"swarmcert/box/1\"\nlower = [0,0]\nupper = [1,1]\n", true);
  EXPECT_EQ(read_domain(path, plain).at("network").upper, (std::vector<double>{1, 1}));
}

}  // namespace
}  // namespace swarmcert::lipschitz
