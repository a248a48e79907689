#include <cctype>
#include <functional>

#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/networks.h"
#include "nn/base/content_hash.h"
#include "nn/base/file_io.h"

namespace swarmcert {
namespace {

using check::check;
using files::Json;
using files::Network;

/// A small heterogeneous NET with ground, clamp and units, so that its certificate has every kind of statement.
const Network& network() {
  static const Network made = [] {
    std::mt19937 generator(11);
    Network net;
    net.sha256 = files::sha256("network.toml of this test");
    net.phi["ground"] = tests::random_network({4, 6, 5}, generator);
    net.phi["small"] = tests::random_network({6, 7, 6, 5}, generator);
    net.rho["small"] = tests::random_network({5, 6, 1}, generator);
    net.rho["large"] = tests::random_network({5, 4, 1}, generator);
    net.output_unit = "gf";
    net.input_order = {"dp_x_m", "dp_y_m", "dp_z_m", "dv_x_m_s", "dv_y_m_s", "dv_z_m_s"};
    net.clamp = files::InputClamp{{-1, -1, -1, -2, -2, -2}, {1, 1, 1, 2, 2, 2}};
    int number = 0;
    for (auto* kinds : {&net.phi, &net.rho}) {
      for (auto& [kind, weights] : *kinds)
        weights.sha256 = files::sha256("weights " + std::to_string(number++));
    }
    return net;
  }();
  return made;
}

lipschitz::CertifyOptions quick() {
  lipschitz::CertifyOptions options;
  options.method = lipschitz::UpperMethod::kSdp;  // every number of its proofs bears on them
  options.lower.rounds = 1;
  options.blocks = {"position"};
  options.scale = {1, 1, 1, 2, 2, 2};
  options.neighbours = 2;
  options.domain["phi:small"] = {{-1, -1, -1, -2, -2, -2}, {1, 1, 1, 2, 2, 2}};
  options.domain["phi:ground"] = {{-1, -2, -2, -2}, {1, 2, 2, 2}};
  return options;
}

const Json& certificate() {
  static const Json made = lipschitz::certificate(network(), lipschitz::certify(network(), quick()));
  return made;
}

/// Returns `changed` with a matching content hash, as a forger would write it.
Json rehashed(Json changed) {
  changed["content_sha256"] = files::content_sha256(changed);
  return changed;
}

/// Returns the JSON pointers of all leaves of `document`.
std::vector<std::string> leaves(const Json& document) {
  std::vector<std::string> pointers;
  const Json flat = document.flatten();
  for (const auto& [pointer, value] : flat.items()) pointers.push_back(pointer);
  return pointers;
}

/// Returns another value of the same type, as from a forger or a damaged disk; for an integer of a factor, one that
/// makes the factor too large.
Json altered(const Json& value, const std::string& pointer) {
  if (value.is_null() || value.is_structured()) return 1;
  if (pointer.find("/factor/scale/") != std::string::npos) return value.get<long>() - 1;
  if (value.is_boolean()) return !value.get<bool>();
  if (value.is_number_integer()) return value.get<long>() + 1;
  if (value.is_number()) return value.get<double>() * (1 - 1e-3);
  const std::string text = value.get<std::string>();
  if (text.rfind("0x", 0) == 0 || text.rfind("-0x", 0) == 0) {  // the first of several: a row of weights
    const std::size_t end = std::min(text.find(' '), text.size());
    const double number = files::parse_hex_float(text.substr(0, end));
    return files::hex_float(number == 0 ? 1.0 : number * (1 - 1e-3)) + text.substr(end);
  }
  std::string other = text;
  if (other.empty()) return "x";
  other[0] = other[0] == 'f' ? '0' : 'f';  // gives another digest or word
  return other;
}

TEST(Checker, AcceptsWhatCertifyWrote) {
  const check::CheckResult result = check(certificate(), network());
  EXPECT_TRUE(result.accepted) << result.reason;
  EXPECT_EQ(result.spectral_norms, 9);
  EXPECT_EQ(result.upper_bounds,
            29);  // 2 phi, 2 rho, 4 sets; position of 6; scaled 3; 2 rho x 2 blocks x 3 laws
  EXPECT_EQ(result.lower_bounds, 17);
}

TEST(Checker, AcceptsItWhateverTheWhiteSpaceAndTheOrderOfMembers) {
  const nlohmann::json sorted = nlohmann::json::parse(certificate().dump());
  const check::CheckResult result = check(Json::parse(sorted.dump(7)), network());
  EXPECT_TRUE(result.accepted) << result.reason;
}

TEST(Checker, RejectsEveryChangedField) {
  int tried = 0;
  for (const std::string& pointer : leaves(certificate())) {
    Json changed = certificate();
    Json& value = changed[Json::json_pointer(pointer)];
    value = altered(value, pointer);
    const check::CheckResult result = check(changed, network());
    EXPECT_FALSE(result.accepted) << pointer << " was changed";
    EXPECT_FALSE(result.reason.empty()) << pointer;
    ++tried;
  }
  std::printf("%d fields changed, all rejected\n", tried);
  EXPECT_GT(tried, 500);
}

TEST(Checker, RejectsEveryChangedFieldEvenWithAForgedContentHash) {
  int tried = 0;
  int rows_seen = 0;
  for (const std::string& pointer : leaves(certificate())) {
    if (pointer == "/tool" || pointer == "/content_sha256")
      continue;  // the former states nothing, the latter is forged
    // How the files were called, read, and what was guessed: not part of what is proved.
    const bool is_of_reading = pointer.rfind("/network/options/", 0) == 0 ||
                               pointer.find("/assumed") != std::string::npos ||
                               pointer.substr(pointer.rfind('/')) == "/file";
    if (is_of_reading) continue;
    if (certificate()[Json::json_pointer(pointer)].is_null()) continue;
    if (certificate()[Json::json_pointer(pointer)].is_structured()) continue;
    // There are many rows, so only every fourth entry is tested.
    if (pointer.find("/factor/rows/") != std::string::npos && ++rows_seen % 4 != 0) continue;
    if (pointer.rfind("/box/", 0) == 0)
      continue;  // with a smaller box that contains the witnesses, the statement is true
    Json changed = certificate();
    Json& value = changed[Json::json_pointer(pointer)];
    value = altered(value, pointer);
    const std::string::size_type rows = pointer.find("/factor/rows/");
    if (rows !=
        std::string::npos) {  // changes many digits, because one last digit may stay within the proof's slack
      value = certificate()[Json::json_pointer(pointer)].get<std::string>() + "7";
    }
    const check::CheckResult result = check(rehashed(changed), network());
    EXPECT_FALSE(result.accepted) << pointer << " was changed";
    EXPECT_EQ(result.reason.find("content_sha256"), std::string::npos) << pointer;
    ++tried;
  }
  std::printf("%d fields changed under a forged hash, all rejected\n", tried);
  EXPECT_GT(tried, 500);
}

TEST(Checker, RejectsAnyClaimBelowWhatIsProved) {
  int tried = 0;
  for (std::size_t i = 0; i < certificate()["bounds"].size(); ++i) {
    for (const double factor : {1 - 1e-6, 1 - 1e-15, 0.5, 0.0}) {
      Json changed = certificate();
      Json& bound = changed["bounds"][i];
      const double claim = bound["upper"].get<double>() * factor;
      bound["upper"] = claim;
      bound["upper_hex"] = files::hex_float(claim);
      EXPECT_FALSE(check(rehashed(changed), network()).accepted) << bound["function"] << " times " << factor;
      ++tried;
    }
  }
  for (std::size_t i = 0; i < certificate()["laws"].size(); ++i) {
    Json changed = certificate();
    Json& law = changed["laws"][i];
    const double claim = law["upper"].get<double>() * (1 - 1e-15);
    law["upper"] = claim;
    law["upper_hex"] = files::hex_float(claim);
    EXPECT_FALSE(check(rehashed(changed), network()).accepted) << law["law"];
    ++tried;
  }
  EXPECT_EQ(tried, 17 * 4 + 12);
}

TEST(Checker, RejectsASmallerRhoWithTheFactorAsItWas) {
  for (const double factor : {1 - 1e-6, 1 - 1e-3}) {
    Json changed = certificate();
    Json& bound = changed["bounds"].back();
    ASSERT_EQ(bound["upper_method"], "sdp");
    const double rho = files::parse_hex_float(bound["proof"]["rho"].get<std::string>()) * factor;
    bound["proof"]["rho"] = files::hex_float(rho);
    bound["upper"] = std::sqrt(rho) * (1 + 1e-12);
    bound["upper_hex"] = files::hex_float(bound["upper"].get<double>());
    const check::CheckResult result = check(rehashed(changed), network());
    EXPECT_FALSE(result.accepted);
    EXPECT_NE(result.reason.find("matrix inequality"), std::string::npos) << result.reason;
  }
}

TEST(Checker, RejectsALowerBoundAboveItsWitness) {
  Json changed = certificate();
  Json& bound = changed["bounds"][0];
  bound["lower"] = bound["lower"].get<double>() * (1 + 1e-9);
  bound["lower_hex"] = files::hex_float(bound["lower"].get<double>());
  EXPECT_FALSE(check(rehashed(changed), network()).accepted);
}

TEST(Checker, RejectsNegativeMultipliers) {
  Json changed = certificate();
  changed["bounds"].back()["proof"]["t"][0] = "-0x1p+0";
  const check::CheckResult result = check(rehashed(changed), network());
  EXPECT_FALSE(result.accepted);
  EXPECT_NE(result.reason.find("negative"), std::string::npos) << result.reason;
}

TEST(Checker, RejectsOtherWeightsPhiForRhoAndAnotherDescription) {
  const auto rejects = [](const std::function<void(Network&)>& change, const std::string& because) {
    Network other = network();
    change(other);
    const check::CheckResult result = check(certificate(), other);
    EXPECT_FALSE(result.accepted) << because;
    EXPECT_NE(result.reason.find(because), std::string::npos) << result.reason;
  };
  rejects([](Network& net) { net.phi["small"].sha256[5] ^= 1; }, "network.weights.phi:small");
  rejects([](Network& net) { net.rho["large"].precision = files::Precision::kFloat64; },
          "network.weights.rho:large");
  rejects([](Network& net) { std::swap(net.rho["small"], net.rho["large"]); }, "network.weights.rho");
  rejects([](Network& net) { net.sha256[0] ^= 1; }, "made for another network");
  rejects([](Network& net) { net.rho.erase("large"); }, "another number of networks");
  rejects([](Network& net) { net.output_unit = "N"; }, "unit");
}

TEST(Checker, RejectsHeavierWeightsUnderTheOldHash) {
  for (std::size_t layer = 0; layer < 3; ++layer) {
    Network other = network();
    for (double& weight : other.phi["small"].layers[layer].weights) weight *= 1 + 1e-6;
    EXPECT_FALSE(check(certificate(), other).accepted) << "layer " << layer;
  }
}

TEST(Checker, RejectsAnotherShapeOfEveryPart) {
  int tried = 0;
  const auto rejects = [&tried](const std::function<void(Json&)>& change, const std::string& because = "") {
    Json changed = certificate();
    change(changed);
    const check::CheckResult result = check(rehashed(changed), network());
    EXPECT_FALSE(result.accepted) << "change number " << tried;
    EXPECT_FALSE(result.reason.empty());
    EXPECT_NE(result.reason.find(because), std::string::npos) << result.reason;
    ++tried;
  };
  const auto bound = [](Json& c, const char* block, bool scaled) -> Json& {
    for (Json& one : c["bounds"])
      if (one["function"] == "set:small:small" && one["block"] == block && one["scale"].empty() != scaled)
        return one;
    throw std::logic_error("no such bound");
  };
  rejects([](Json& c) { c["network"]["as"] = "float16"; }, "network.as is unknown");
  rejects([](Json& c) { c["box"] = nullptr; }, "domain is not global");
  rejects([](Json& c) { c["box"]["phi:small"]["upper"] = Json::array(); });
  rejects(
      [](Json& c) {
        for (Json& x : c["box"]["phi:small"]["upper"]) x = "-0x1p+0";
      },
      "outside of the box");
  rejects([&](Json& c) { bound(c, "position", false)["block"] = "all"; });
  rejects([&](Json& c) { bound(c, "position", false)["block"] = "x7"; }, "has no block");
  rejects([&](Json& c) { bound(c, "all", true)["scale"] = Json::array(); }, "norm is not l2");
  rejects([&](Json& c) { bound(c, "all", true)["scale"].erase(0); }, "scale");
  rejects([&](Json& c) { bound(c, "all", true)["scale"][0] = "0x0p+0"; }, "scale is not positive");
  rejects([&](Json& c) { bound(c, "all", false)["law"] = "own_state"; }, "law is not one_neighbour");
  rejects([](Json& c) { c["laws"][0]["law"] = "any"; }, "unknown law");
  rejects([](Json& c) { c["laws"][0]["block"] = "x1"; });
  rejects([](Json& c) { c["laws"][0]["neighbours"] = Json{{"nobody", 2}}; });
  rejects([](Json& c) { c["laws"][0]["neighbours"] = Json{{"small", 0}}; }, "impossible number");
  rejects([](Json& c) { c["laws"][0]["neighbours"] = Json{{"small", -2}}; }, "impossible number");
  rejects([](Json& c) { c["laws"][0]["neighbours"]["ground"] = 1; }, "the ground is not a neighbour");
  rejects([](Json& c) { c["laws"][0]["rho"] = "nobody"; });
  rejects([](Json& c) { c["laws"][0].erase("rho"); }, "lacks field rho");
  rejects([](Json& c) { c["extra"] = 1; });
  rejects([](Json& c) { c.erase("statement"); });
  rejects([](Json& c) { c.erase("network"); }, "certificate lacks field network");
  rejects([](Json& c) { c["network"] = Json::array(); }, "network is not an object");
  rejects([](Json& c) { c["laws"][0]["neighbours"] = 3; }, "a field is missing or of another type");
  rejects([](Json& c) { c["layers"] = Json::array(); });
  rejects([](Json& c) { c["layers"].push_back(c["layers"][0]); });
  rejects([](Json& c) { std::swap(c["layers"][0], c["layers"][1]); });
  rejects([](Json& c) { c["bounds"] = Json::array(); });
  rejects([](Json& c) { c["bounds"][0] = "text"; });
  rejects([](Json& c) { c["bounds"][0]["function"] = "phi:nobody"; });
  rejects([](Json& c) { c["bounds"][0]["function"] = "nothing"; });
  rejects([](Json& c) { c["bounds"][0]["upper_method"] = "guess"; });
  rejects([](Json& c) { c["bounds"][0]["status"] = "guessed"; });
  rejects([](Json& c) { c["laws"][0]["status"] = nullptr; });
  rejects([](Json& c) { c["bounds"][0]["upper_method"] = "product"; });
  rejects([](Json& c) { c["bounds"].back()["proof"]["t"].erase(0); });
  rejects([](Json& c) { c["bounds"].back()["proof"]["factor"]["rows"].erase(0); });
  rejects([](Json& c) { c["bounds"].back()["proof"]["factor"]["rows"][0] = "1 2 3"; });
  rejects([](Json& c) { c["bounds"].back()["proof"]["factor"]["rows"][0] = std::string(50, '9'); });
  rejects([](Json& c) { c["bounds"].back()["proof"]["factor"]["unit_exponent"] = 1000000000; });
  rejects([](Json& c) { c["bounds"].back()["proof"]["factor"]["scale"][0] = -1000000000; });
  rejects([](Json& c) { c["bounds"].back()["proof"]["rho"] = "0x0p+0"; });
  rejects([](Json& c) { c["bounds"].back()["proof"]["rho"] = "1e5"; });
  rejects([](Json& c) { c["bounds"].back()["lower"] = nullptr; });
  rejects(
      [](Json& c) { c["bounds"].back()["lower_witness"]["y"] = c["bounds"].back()["lower_witness"]["x"]; });
  rejects([](Json& c) { c["bounds"].back()["lower_witness"]["others"] = Json::array(); });
  rejects([](Json& c) { c["bounds"].back()["lower_witness"]["others"][0]["network"] = "rho:small"; });
  rejects([](Json& c) { c["layers"][0]["proof"]["lower_vector"].erase(0); });
  rejects([](Json& c) { c["schema"] = "swarmcert/certificate/1"; });
  EXPECT_EQ(tried, 48);
}

TEST(Checker, RoundsToFloat32WhereTheCertificateSaysSo) {
  Network wide = network();
  for (auto& [kind, weights] : wide.phi) {
    weights.precision = files::Precision::kFloat64;
    for (files::Layer& layer : weights.layers)
      for (double& weight : layer.weights) weight *= 1 + 1e-9;  // not representable in float32
  }
  lipschitz::Certification found = lipschitz::certify(files::as_float32(wide), quick());
  found.as_float32 = true;
  const Json as_float32 = lipschitz::certificate(files::as_float32(wide), found);
  EXPECT_TRUE(check(as_float32, wide).accepted) << check(as_float32, wide).reason;
  Json stored = as_float32;
  stored["network"]["as"] = nullptr;
  EXPECT_FALSE(check(rehashed(stored), wide).accepted);
}

TEST(Checker, AcceptsProductsAndRejectsThemBelowTheNorms) {
  lipschitz::CertifyOptions options = quick();
  options.method = lipschitz::UpperMethod::kProduct;
  options.lower.rounds = 0;
  const Json products = lipschitz::certificate(network(), lipschitz::certify(network(), options));
  EXPECT_TRUE(check(products, network()).accepted) << check(products, network()).reason;
  Json changed = products;
  const double claim = std::nextafter(changed["bounds"][0]["upper"].get<double>(), 0.0);
  changed["bounds"][0]["upper"] = claim;
  changed["bounds"][0]["upper_hex"] = files::hex_float(claim);
  EXPECT_FALSE(check(rehashed(changed), network()).accepted);
}

TEST(Checker, CertificateBytesAreTheSameForAnyNumberOfJobs) {
  std::string first;
  for (const int jobs : {1, 2, 5}) {
    lipschitz::CertifyOptions options = quick();
    options.jobs = jobs;
    const std::string text =
        files::to_text(lipschitz::certificate(network(), lipschitz::certify(network(), options)));
    if (first.empty()) first = text;
    EXPECT_EQ(text, first) << jobs << " jobs";
  }
}

/// P = [[2, 1], [1, 2]] with R from its Cholesky factor, so that E is tiny.
TEST(Checker, FactorMustFitTheMatrix) {
  check::Matrix p(2, 2, {2, 1, 1, 2});
  check::Factor factor;
  factor.unit_exponent = -1;
  factor.scale = {0, 0};
  factor.rows = {{2}, {1, 2}};  // R = [[1, 0], [.5, 1]]: E = [[1, .5], [.5, .75]], diagonally dominant
  EXPECT_TRUE(check::shows_positive_semidefinite(p, factor));
  factor.rows = {{2}, {-2, 2}};  // E = [[1, 2], [2, 0]]
  EXPECT_FALSE(check::shows_positive_semidefinite(p, factor));
  factor.rows = {{2}};
  EXPECT_FALSE(check::shows_positive_semidefinite(p, factor));
}

/// Returns `diagonal` I minus the adjacency matrix of a path. For 2 I, the eigenvalues are 2 - 2 cos(pi k / (n + 1)),
/// the least one about 1e-3 for n = 100.
check::Matrix path_matrix(int n, double diagonal) {
  check::Matrix p(n, n);
  for (int i = 0; i < n; ++i) {
    p(i, i) = diagonal;
    if (i > 0) p(i, i - 1) = p(i - 1, i) = -1.0;
  }
  return p;
}

TEST(Checker, FindsAFactorThatIsLeftOutExactlyWhereThereIsOne) {
  const std::optional<check::Factor> left_out;
  EXPECT_TRUE(check::shows_positive_semidefinite(path_matrix(100, 2), left_out));
  EXPECT_TRUE(check::shows_positive_semidefinite(path_matrix(100, 1.9991), left_out));
  EXPECT_FALSE(check::shows_positive_semidefinite(path_matrix(100, 1.999), left_out));
  EXPECT_FALSE(check::shows_positive_semidefinite(path_matrix(100, -1), left_out));
  EXPECT_TRUE(check::shows_positive_semidefinite(check::Matrix(3, 3), left_out)) << "zero is semidefinite";
}

TEST(Checker, CertificatesOfWideNetworksAreNoLongerThanTwiceTheWeightsAndHold) {
  std::mt19937 generator(8);
  files::Network wide;
  wide.plain = tests::random_network({6, 90, 90, 2}, generator);
  lipschitz::CertifyOptions options;
  options.method = lipschitz::UpperMethod::kEclipseFast;
  options.lower.rounds = 0;
  const files::Json certificate = lipschitz::certificate(wide, lipschitz::certify(wide, options));
  EXPECT_TRUE(certificate["bounds"][0]["proof"]["factor"].is_null());
  std::size_t weights = 0;
  for (const files::Layer& layer : wide.plain->layers) weights += sizeof(double) * layer.weights.size();
  EXPECT_LT(certificate.dump().size(), 2 * weights);
  EXPECT_TRUE(check::check(certificate, wide).accepted) << check::check(certificate, wide).reason;
  files::Json changed = certificate;
  const double smaller = 0.99 * changed["bounds"][0]["upper"].get<double>();
  changed["bounds"][0]["upper"] = smaller;
  changed["bounds"][0]["upper_hex"] = files::hex_float(smaller);
  changed["bounds"][0]["proof"]["rho"] = files::hex_float(smaller * smaller * (1 - 1e-15));
  EXPECT_FALSE(check::check(rehashed(changed), wide).accepted);
}

TEST(Checker, NoFactorShowsAnIndefiniteMatrix) {
  const check::Matrix p(2, 2, {1, 2, 2, 1});  // eigenvalues 3 and -1
  std::mt19937 generator(3);
  for (int round = 0; round < 20000; ++round) {
    check::Factor factor;
    factor.unit_exponent = -8;
    factor.scale = {static_cast<long>(generator() % 5) - 2, static_cast<long>(generator() % 5) - 2};
    const auto entry = [&generator] { return mpz_class(static_cast<long>(generator() % 2048) - 1024); };
    factor.rows = {{entry()}, {entry(), entry()}};
    ASSERT_FALSE(check::shows_positive_semidefinite(p, factor));
  }
}

}  // namespace
}  // namespace swarmcert
