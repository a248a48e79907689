/// Certificates of networks with activations other than ReLU on a box.
#include <cmath>
#include <cstdlib>

#include "lipschitz/boxes.h"
#include "lipschitz/checker/canonical_network.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/checker/statement.h"
#include "lipschitz/networks.h"
#include "lipschitz/values/value_bounds.h"
#include "nn/base/content_hash.h"
#include "nn/base/json.h"
#include "nn/weights/functions.h"

namespace swarmcert {
namespace {

using files::Activation;
using files::Json;
using files::Network;
using lipschitz::Box;
using lipschitz::Certification;
using lipschitz::CertifyOptions;
using lipschitz::UpperMethod;
using tests::bound_of;
using tests::cube;
using tests::Domain;
using tests::intervals;
using tests::on_box;
using tests::with;

/// A deep set of tanh and GELU on a box, with laws and values.
struct Made {
  Network network;
  Json certificate;
};

const Made& made() {
  static const Made result = [] {
    std::mt19937 generator(87);
    const Network network =
        tests::deep_set(with(tests::random_network({3, 6, 4}, generator), Activation::kTanh),
                        with(tests::random_network({4, 5, 2}, generator), Activation::kGelu));
    CertifyOptions options = on_box({{"phi:default", cube(3, 0.25)}});
    options.neighbours = 2;
    Certification found = certify(network, options);
    const std::map<std::string, double> rho_bound = {
        {"default", bound_of(found, "rho:default").upper.value()}};
    found.values = certified_values(network, options.domain, rho_bound, {2, false, false, 0});
    return Made{network, lipschitz::certificate(network, found)};
  }();
  return result;
}

std::string reason(Json changed) {
  changed["content_sha256"] = files::content_sha256(changed);
  const check::CheckResult result = check::check(changed, made().network);
  return result.accepted ? "accepted" : result.reason;
}

/// Replaces a number by the next double towards `goal`, in decimal and in hex.
void move(Json& entry, const std::string& key, double goal) {
  const double moved = std::nextafter(entry[key].get<double>(), goal);
  entry[key] = moved;
  entry[key + "_hex"] = files::hex_float(moved);
}

TEST(BoxCertificate, IsAcceptedWithBoundsOfTheBox) {
  EXPECT_EQ(reason(made().certificate), "accepted");
  int local = 0;
  for (const Json& bound : made().certificate["bounds"])
    local += bound["upper_method"] == "local_sdp" ? 1 : 0;
  EXPECT_EQ(local, 2);  // phi and the set function
  EXPECT_EQ(made().certificate["laws"][0]["domain"], "box");
  EXPECT_EQ(made().certificate["values"].size(), 2u);  // for one and two neighbours
}

TEST(BoxCertificate, IsRefusedWithAnyBoundOneUnitBelowWhatIsProved) {
  for (const char* const list : {"bounds", "laws"}) {
    for (std::size_t i = 0; i < made().certificate[list].size(); ++i) {
      Json changed = made().certificate;
      move(changed[list][i], "upper", 0);
      EXPECT_NE(reason(changed).find("claims less than"), std::string::npos) << list << " " << i;
    }
  }
  for (std::size_t i = 0; i < made().certificate["bounds"].size(); ++i) {
    const Json& proof = made().certificate["bounds"][i]["proof"];
    if (proof.is_null()) continue;
    Json changed = made().certificate;
    const double rho = files::parse_hex_float(proof["rho"].get<std::string>());
    changed["bounds"][i]["proof"]["rho"] = files::hex_float(rho * (1 - 1e-3));
    EXPECT_NE(reason(changed).find("does not show"), std::string::npos) << i;
  }
}

std::vector<double> numbers(const Json& text) {
  std::vector<double> result;
  const std::string words = text;
  const char* at = words.c_str();
  for (char* end = nullptr;; at = end) {
    const double x = std::strtod(at, &end);
    if (end == at) return result;
    result.push_back(x);
  }
}

Json joined(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + files::hex_float(value);
  return text;
}

TEST(BoxCertificate, IsRefusedWithAnyStatedValueOneUnitInwards) {
  int tried = 0;
  const auto expect_refusal = [&](const std::vector<std::string>& path, const Json& changed_value) {
    Json changed = made().certificate;
    Json* at = &changed["values"][0];
    for (const std::string& key : path)
      at = at->is_array() ? &(*at)[static_cast<std::size_t>(std::stoi(key))] : &(*at)[key];
    *at = changed_value;
    EXPECT_NE(reason(changed), "accepted");
    ++tried;
  };
  const Json& values = made().certificate["values"][0];
  for (const auto& [side, goal] : {std::pair{"lower", 1e9}, {"upper", -1e9}}) {
    for (const auto& [name, layers] : values["networks"].items()) {
      for (std::size_t k = 0; k < layers.size(); ++k) {
        const std::vector<double> stated = numbers(layers[k][side]);
        for (std::size_t i = 0; i < stated.size(); ++i) {
          std::vector<double> moved = stated;
          moved[i] = std::nextafter(moved[i], goal);
          expect_refusal({"networks", name, std::to_string(k), side}, joined(moved));
        }
      }
    }
    for (std::size_t i = 0; i < values[side].size(); ++i) {
      Json moved = values[side];
      moved[i] = files::hex_float(std::nextafter(files::parse_hex_float(moved[i].get<std::string>()), goal));
      expect_refusal({side}, moved);
    }
  }
  EXPECT_EQ(tried, 2 * (6 + 4 + 5 + 2 + 2));
  Json changed = made().certificate;
  move(changed["values"][0], "jump", 0);
  EXPECT_NE(reason(changed).find("claims less than the jump"), std::string::npos);
}

TEST(BoxCertificate, IsRefusedForALargerBoxOrNone) {
  Json changed = made().certificate;
  for (std::string word : {"lower", "upper"})
    for (Json& end : changed["box"]["phi:default"][word])
      end = files::hex_float(8 * files::parse_hex_float(end.get<std::string>()));
  EXPECT_NE(reason(changed).find("does not show"), std::string::npos) << reason(changed);
  for (std::size_t i = 0; i < made().certificate["bounds"].size(); ++i) {
    if (made().certificate["bounds"][i]["upper_method"] != "local_sdp") continue;
    changed = made().certificate;
    changed["bounds"][i]["domain"] = "global";
    EXPECT_NE(reason(changed).find("of a bound without one"), std::string::npos) << reason(changed);
    changed = made().certificate;
    changed["bounds"][i]["upper_method"] = "sdp";
    EXPECT_NE(reason(changed).find("does not show"), std::string::npos) << reason(changed);
    changed = made().certificate;
    changed["bounds"][i]["upper_method"] = "branch";
    EXPECT_NE(reason(changed).find(".proof"), std::string::npos) << reason(changed);
  }
  changed = made().certificate;
  for (Json& law : changed["laws"]) law["domain"] = "global";
  EXPECT_NE(reason(changed).find("holds on a box only"), std::string::npos) << reason(changed);
}

TEST(BoxCertificate, SaysNothingOfFloat32) {
  Json changed = made().certificate;
  changed["values"][0]["input_error"] = {{"phi:default", {"0x0p+0", "0x0p+0", "0x0p+0"}}};
  EXPECT_NE(reason(changed).find("float32"), std::string::npos) << reason(changed);
}

/// A proof for one order of the activations is refused for another, because each layer is checked with its own.
TEST(BoxCertificate, IsRefusedWithTheActivationsInAnotherOrder) {
  std::mt19937 generator(94);
  Network network = tests::plain(tests::random_network({3, 8, 8, 2}, generator));
  network.plain->set_activations({Activation::kTanh, Activation::kSilu});
  const Domain domain = {{"network", cube(3, 0.3)}};
  Certification found = certify(network, on_box(domain));
  found.values = certified_values(network, domain, {}, {1, false, false, 0});
  const Json made = lipschitz::certificate(network, found);
  EXPECT_TRUE(check::check(made, network).accepted);
  Network other = network;
  other.plain->set_activations({Activation::kSilu, Activation::kTanh});
  const auto refusal = [&](Json changed) {
    Json& steps = changed["network"]["weights"]["network"]["chain"];
    std::swap(steps[1]["op"], steps[3]["op"]);
    changed["content_sha256"] = files::content_sha256(changed);
    return check::check(changed, other).reason;
  };
  EXPECT_NE(refusal(made).find("does not show"), std::string::npos) << refusal(made);
  Json values = made;  // with the bounds of the other network, so that only the values are wrong
  values["bounds"] = lipschitz::certificate(other, certify(other, on_box(domain)))["bounds"];
  EXPECT_NE(refusal(values).find("the values leave the bounds"), std::string::npos) << refusal(values);
}

TEST(BoxCertificate, HoldsForAnIntervalOfOnePoint) {
  std::mt19937 generator(88);
  const Network network = tests::plain(with(tests::random_network({2, 6, 1}, generator), Activation::kSilu));
  const Box point = {{0.25, -1.5}, {0.25, -1.5}};
  const Certification found = certify(network, on_box({{"network", point}}));
  Json written = lipschitz::certificate(network, found);
  EXPECT_TRUE(check::check(written, network).accepted) << check::check(written, network).reason;
  EXPECT_EQ(bound_of(found, "network").method, UpperMethod::kLocalSdp);
}

}  // namespace
}  // namespace swarmcert
