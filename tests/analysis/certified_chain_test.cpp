/// The function to which a certificate refers: the order of layers, blocks, and samples of the trained network.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <set>

#include "analysis/run.h"
#include "data.h"
#include "nn/base/json.h"
#include "nn/pth_writer.h"
#include "nn/weights/weights.h"

namespace swarmcert {
namespace {

using files::Json;
using tests::Outcome;
using tests::read_text;
using tests::write_text;

class CertifiedChain : public tests::CommandLineTest {
 protected:
  /// A state dict of layers without biases, registered in this order. "shrink" followed by "grow" has slope 0,
  /// because the output of the first ReLU is multiplied by 0. The opposite order is steep.
  void write_square(const std::string& first, const std::string& second) {
    const std::vector<tests::TensorSpec> tensors = {{"head.weight", "0", 2, {2, 1}, {1, 1}},
                                                    {first + ".weight", "1", 4, {2, 2}, {2, 1}},
                                                    {second + ".weight", "2", 4, {2, 2}, {2, 1}},
                                                    {"tail.weight", "3", 2, {1, 2}, {2, 1}}};
    const std::string steep = tests::raw_numbers<float>({0, 10, 0, 0}),
                      zero = tests::raw_numbers<float>({0, 0, 10, 0});
    write_text(folder_ / "net.pth", tests::zip_file(tensors, {{"0", tests::raw_numbers<float>({0, 10})},
                                                              {"1", first == "steep" ? steep : zero},
                                                              {"2", second == "steep" ? steep : zero},
                                                              {"3", tests::raw_numbers<float>({0, 10})}}));
  }
};

TEST_F(CertifiedChain, AFileWithSeveralOrdersIsRefusedAndTheGivenOrderIsCertified) {
  write_square("turn", "steep");
  expect("certify net.pth", 3,
         {"net.pth", "more than one fits", "head,turn,steep,tail (as registered)", "head,steep,turn,tail",
          "--order"});
  expect("certify net.pth --order head,steep,turn,tail --json steep.json", 0,
         {"verdict: proved for head - ReLU - steep - ReLU - turn - ReLU - tail", "order as given"});
  expect("certify net.pth --order=head,turn,steep,tail --json turned.json", 0,
         {"verdict: proved for head - ReLU - turn - ReLU - steep - ReLU - tail"});
  const auto upper = [&](const std::string& file) {
    return Json::parse(read_text(folder_ / file))["bounds"][0]["upper"].get<double>();
  };
  // |x| -> 10 relu(x) -> steep keeps the second component, times 10, in the first place -> turn puts it back -> tail:
  // 10^4.
  EXPECT_GE(upper("steep.json"), 1e4);
  EXPECT_LT(upper("turned.json"), 1);  // the other order is constant
}

TEST_F(CertifiedChain, CheckSaysHowTheFileWasReadAsCertifyDoes) {
  const std::string relu6 = tests::source_path("tests/nn/files/torch_half.pth") + " --activation relu6";
  const std::string piecewise = "piecewise linear activations of relu6 are written with ReLU";
  expect("certify " + relu6 + " --nodes 1 -o cert.json", 0,
         {"\n    stored as float16", "\n    " + piecewise});
  expect("check cert.json " + relu6, 0, {"\n  network: stored as float16", "\n  network: " + piecewise});
  const std::string folded = tests::source_path("tests/nn/files/torch_weight_norm.pth");
  const std::string rounded = "hold for the exact ones";
  expect("certify " + folded + " --nodes 1 -o folded.json", 0, {"g v / |v|", rounded});
  expect("check folded.json " + folded, 0, {"network: fc1.weight is computed from its weight_norm", rounded});
}

TEST_F(CertifiedChain, JsonAndCertificateListTheOperationsAndCheckInsistsOnThem) {
  write_square("turn", "steep");
  ASSERT_EQ(
      run("certify net.pth --order head,steep,turn,tail --nodes 1 --json out.json -o cert.json").exit_code,
      0);
  const Json result = Json::parse(read_text(folder_ / "out.json"));
  ASSERT_EQ(result["chain"].size(), 7u);
  EXPECT_EQ(result["chain"][0],
            Json::parse(R"({"op":"linear","layer":"head","inputs":1,"outputs":2,"network":"network"})"));
  EXPECT_EQ(result["chain"][1],
            Json::parse(R"({"op":"relu","layer":null,"inputs":2,"outputs":2,"network":"network"})"));
  EXPECT_EQ(result["chain"][2]["layer"], "steep");
  EXPECT_EQ(result["chain_source"]["network"]["order"], "user");
  EXPECT_EQ(result["chain_source"]["network"]["activation"], "assumed");
  const Json stated = Json::parse(read_text(folder_ / "cert.json"))["network"]["weights"]["network"];
  EXPECT_EQ(stated["chain"].size(), 7u);
  EXPECT_TRUE(stated["samples"].is_null());
  expect("check cert.json net.pth --order head,steep,turn,tail", 0,
         {"accepted", "for head - ReLU - steep - ReLU - turn - ReLU - tail"});
  expect("check cert.json net.pth --order head,turn,steep,tail", 1,
         {"rejected", "steep: net.pth holds another tensor, turn.weight"});
  expect("check cert.json net.pth", 0, {"accepted"});  // the certificate states the order
}

TEST_F(CertifiedChain, OrdersThatDoNotFitTheCommandAreUsageErrors) {
  write_square("turn", "steep");
  expect("certify net.pth --order phi=head,steep", 2, {"--phi"});
  expect("certify --phi net.pth --rho net.pth --order head,steep", 2, {"phi=fc1,fc2"});
  expect("certify net.pth --order ''", 2, {"--order"});
  expect("certify net.pth --order head,tail", 3, {"left out"});
  expect("certify net.pth --activation mish", 2, {"--activation mish", "silu"});
}

TEST_F(CertifiedChain, SamplesMustBeReproducedAndTheCertificateNamesThem) {
  write_square("turn", "steep");
  // head: (0, 10 x); steep: (100 relu(x), 0); turn: (0, 1000 relu(x)); tail: 10^4 relu(x).
  write_text(folder_ / "good.csv", "x,y\n-1,0\n0.5,5000\n2,20000\n");
  const std::string certify = "certify net.pth --nodes 1 ";
  expect(certify + "--order head,steep,turn,tail --samples good.csv -o cert.json --json out.json", 0,
         {"reproduces 3 samples of good.csv"});
  const Json samples =
      Json::parse(read_text(folder_ / "cert.json"))["network"]["weights"]["network"]["samples"];
  EXPECT_EQ(samples["count"], 3);
  EXPECT_EQ(samples["largest_deviation"], 0.0);
  EXPECT_EQ(samples["sha256"].get<std::string>().size(), 64u);
  EXPECT_EQ(Json::parse(read_text(folder_ / "out.json"))["samples"][0]["sha256"], samples["sha256"]);
  expect("check cert.json net.pth --order head,steep,turn,tail", 0, {"accepted"});
  expect(certify + "--order head,turn,steep,tail --samples good.csv", 3,
         {"good.csv: line 4", "output 0 = 20000", "gives 0", "at the inputs (2)", "--order"});
  write_text(folder_ / "gelu.csv", "-1,-1586.6\n0.5,3457.3\n2,19545\n");  // 10^4 GELU(x)
  expect(certify + "--order head,steep,turn,tail --samples gelu.csv", 3, {"gelu.csv: line 1", "activation"});
  expect(certify + "--order head,steep,turn,tail --samples gelu.csv --samples-tolerance 0.1", 0,
         {"tolerance"});
  write_text(folder_ / "ragged.csv", "1,2\n3\n");
  expect(certify + "--order head,steep,turn,tail --samples ragged.csv", 3,
         {"ragged.csv: line 2", "1 columns"});
}

TEST_F(CertifiedChain, SamplesOfAnExportAreReproduced) {
  const std::string net = std::string(SWARMCERT_SOURCE_DIR) + "/nn/networks/demo/network.toml";
  ASSERT_EQ(run("export " + net + " -o firmware").exit_code, 0);
  expect("certify " + net + " --samples firmware/samples.json --nodes 0 --method product", 0,
         {"reproduces 64 samples of firmware/samples.json"});
}

TEST_F(CertifiedChain, ASmoothActivationIsCertifiedCheckedAndHeldAgainstSamples) {
  write_square("turn", "steep");
  const std::string net = "net.pth --order head,steep,turn,tail";
  const std::string chain = "for head - tanh - steep - tanh - turn - tanh - tail";
  expect("certify " + net + " --activation tanh -o cert.json --json out.json", 0,
         {"verdict: proved " + chain, "activation as given"});
  const Json result = Json::parse(read_text(folder_ / "out.json"));
  EXPECT_EQ(result["chain"][1]["op"], "tanh");
  EXPECT_EQ(result["chain_source"]["network"]["activation"], "user");
  EXPECT_FALSE(result["bounds"][0].contains("lower_reason"));
  EXPECT_FALSE(result["bounds"][0].contains("slope_estimate"));
  EXPECT_GE(result["bounds"][0]["upper"].get<double>(), 1e4);  // all slopes are 1 at the origin
  const double lower = result["bounds"][0]["lower"];
  EXPECT_LE(lower, 1e4);
  EXPECT_GE(lower, 0.9999e4);  // at 1.25e-5 the last tanh has input t = 1/80, and tanh(t) / t > 1 - t^2 / 3
  expect("check cert.json " + net, 0, {"accepted", "1 lower bounds", chain});  // as stated by the certificate
  expect("certify " + net + " --activation tanh --max-lipschitz 9000", 1, {"verdict: refuted"});
  expect("check cert.json " + net + " --activation tanh", 0, {"accepted", chain});
  expect("check cert.json " + net + " --activation relu", 1,
         {"rejected", "net.pth holds another operation of the chain after it"});
  expect("certify " + net + " --activation sigmoid --max-lipschitz 160", 0,
         {"verdict: proved"});  // 10^4 / 4^3
  expect("certify " + net + " --activation sigmoid --max-lipschitz 150", 4, {"verdict: inconclusive"});
  // head: (0, 10 x), and so on as above, with tanh: 10 tanh(10 tanh(10 tanh(10 x))).
  write_text(folder_ / "tanh.csv", "0.01,9.9999950\n-0.002,-9.6210649\n0.1,10.0\n");
  expect("certify " + net + " --activation tanh --samples tanh.csv", 0, {"reproduces 3"});
  expect("certify " + net + " --activation relu --samples tanh.csv", 3, {"--activation"});
}

TEST_F(CertifiedChain, SeveralActivationsAndOneAtTheEndAreCertifiedCheckedAndHeldAgainstSamples) {
  write_square("turn", "steep");
  const std::string net = "net.pth --order head,steep,turn,tail",
                    given = " --activation relu,tanh,relu,sigmoid";
  const std::string chain = "for head - ReLU - steep - tanh - turn - ReLU - tail - sigmoid - layer5";
  // sigmoid(10 relu(10 tanh(10 relu(10 x)))), whose largest slope is 10^4 / 4, at 0.
  expect("certify " + net + given + " --max-lipschitz 2501 -o cert.json --json out.json", 0,
         {"verdict: proved", "activation as given", "ends in sigmoid, which an identity layer follows"});
  const Json bound = Json::parse(read_text(folder_ / "out.json"))["bounds"][0];
  EXPECT_GE(bound["upper"].get<double>(), 2500);
  EXPECT_LE(bound["lower"].get<double>(), bound["upper"].get<double>());
  EXPECT_GT(bound["lower"].get<double>(), 2400);  // within 1e-5 of 0: the sigmoid's input is at most 1/10
  expect("certify " + net + given + " --max-lipschitz 2400", 1, {"verdict: refuted"});
  expect("check cert.json " + net, 0, {"accepted", chain});
  expect("check cert.json " + net + given, 0, {"accepted", chain});
  expect("check cert.json " + net + " --activation tanh,relu,relu,sigmoid", 1, {"rejected", "chain"});
  expect("check cert.json " + net + " --activation relu,tanh,relu", 1, {"rejected"});
  write_text(folder_ / "ends.csv", "0,0.5\n-1,0.5\n0.0001,0.7310520251105632\n");
  expect("certify " + net + given + " --samples ends.csv", 0, {"reproduces 3"});
  expect("certify " + net + " --activation relu,tanh,relu --samples ends.csv", 3, {"--activation"});
  expect("certify " + net + " --activation relu,tanh", 3,
         {"net.pth", "names 2 activations for 4 layers: name one, or 3 for those between the layers, or 4"});
  expect("certify " + net + " --activation relu,mish,relu", 2, {"\"mish\"", "silu"});
  expect("inspect " + net + given, 0, {"2 -> 2, tanh", "2 -> 1, sigmoid", "layer5"});
}

TEST_F(CertifiedChain, TheTextShowsHowFarTheBoundOfASmoothNetworkIsFromTheSlopeFound) {
  write_square("turn", "steep");
  const Outcome outcome =
      run("certify net.pth --order head,steep,turn,tail --activation softplus --json out.json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const Json bound = Json::parse(read_text(folder_ / "out.json"))["bounds"][0];
  const double ratio = bound["upper"].get<double>() / bound["lower"].get<double>();
  EXPECT_GE(ratio, 1);
  char shown[32];
  std::snprintf(shown, sizeof shown, " %.3f ", ratio);
  EXPECT_NE(outcome.output.find(shown), std::string::npos) << outcome.output;
}

TEST_F(CertifiedChain, InspectShowsTheActivationAfterEveryLayerButTheLast) {
  write_square("turn", "steep");
  expect("inspect net.pth --order head,steep,turn,tail --json out.json", 0, {"1 -> 2, relu", "2 -> 2, relu"});
  const Json layers =
      Json::parse(read_text(folder_ / "out.json"))["files"][0]["networks"]["network"]["layers"];
  ASSERT_EQ(layers.size(), 4u);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(layers[k]["activation"], "relu");
  EXPECT_TRUE(layers[3]["activation"].is_null());
  const std::string inspect = "inspect net.pth --order head,steep,turn,tail --activation ";
  expect(inspect + "tanh", 0, {"1 -> 2, tanh", "2 -> 2, tanh"});
  expect(inspect + "mish", 2, {"--activation mish", "silu"});
}

TEST_F(CertifiedChain, OnABoxASmoothNetworkHasASmallerBoundAndARange) {
  write_square("turn", "steep");
  // Far from the origin every tanh is flat: the input of the first one is between 10 and 11, where its slope is at
  // most 8.3e-9.
  write_text(folder_ / "box.toml", "schema = \"swarmcert/box/1\"\nlower = [1]\nupper = [1.1]\n");
  const std::string net = "net.pth --order head,steep,turn,tail --activation tanh";
  expect("certify " + net + " --domain box.toml -o cert.json --json out.json", 0,
         {"over the box", "Range over the box", "This says nothing about a float32 evaluation"});
  const Json result = Json::parse(read_text(folder_ / "out.json")), bound = result["bounds"][0];
  EXPECT_EQ(bound["domain"], "box");
  EXPECT_LT(bound["upper"].get<double>(), 1e-2);
  const Json range = result["range"][0];
  // 10 tanh(10 tanh(10 tanh(10 x))) = 10 to 8 digits
  EXPECT_NEAR(range["lower"].get<double>(), 10, 1e-6);
  EXPECT_NEAR(range["upper"].get<double>(), 10, 1e-6);
  EXPECT_LE(range["lower"].get<double>(), range["lower_witness"]["value"].get<double>());
  EXPECT_GE(range["upper"].get<double>(), range["upper_witness"]["value"].get<double>());
  EXPECT_TRUE(result["float32_error"].empty());
  expect("check cert.json " + net, 0, {"accepted"});
  // A different activation after each layer, and one at the end.
  const std::string mixed = "net.pth --order head,steep,turn,tail --activation relu,tanh,gelu,sigmoid";
  expect("certify " + mixed + " --domain box.toml -o mixed.json", 0, {"over the box", "Range over the box"});
  expect("check mixed.json " + mixed, 0, {"accepted"});
}

TEST_F(CertifiedChain, WhatIsForReluRefusesASmoothActivation) {
  write_square("turn", "steep");
  write_text(folder_ / "box.toml", "schema = \"swarmcert/box/1\"\nlower = [-1]\nupper = [1]\n");
  const std::string net = " net.pth --order head,steep,turn,tail --activation tanh";
  for (const char* const option : {"--input-step 0.1", "--explain", "--method branch"})
    expect("certify" + net + " " + option, 3, {"\"tanh\"", "net.pth", "is for ReLU networks"});
  expect("export" + net + " -o firmware", 3, {"\"tanh\"", "ReLU networks"});
}

TEST_F(CertifiedChain, BlocksTakeTheirValueWithAndWithoutAnEqualsSign) {
  const std::string net = std::string(SWARMCERT_SOURCE_DIR) + "/nn/networks/demo/network.toml";
  const std::string tail = " --nodes 0 --method product -q --force --json out.json";
  const auto blocks = [&](const std::string& arguments) {
    const Outcome outcome = run("certify " + arguments + tail);
    EXPECT_EQ(outcome.exit_code, 0) << arguments << "\n" << outcome.output;
    const Json result = Json::parse(read_text(folder_ / "out.json"));
    std::set<std::string> found;
    for (const Json& bound : result["bounds"]) found.insert(bound["block"]);
    return found;
  };
  const std::set<std::string> position = {"all", "position"};
  EXPECT_EQ(blocks(net + " --blocks position"), position);
  EXPECT_EQ(blocks(net + " --blocks=position"), position);
  EXPECT_EQ(blocks("--blocks position " + net), position);
  const std::set<std::string> every = blocks(net + " --blocks");
  EXPECT_GT(every.size(), 8u);
  EXPECT_EQ(blocks("--blocks " + net), every);
  EXPECT_EQ(blocks(net), (std::set<std::string>{"all"}));
  expect("certify " + net + " --blocks postion", 2, {"--blocks postion"});
  expect("certify " + net + " --blocks x9", 2, {"x9"});
}

TEST_F(CertifiedChain, BlocksOfANetworkWithOneInputAreNone) {
  files::Weights weights;
  weights.layers = {{"fc1", 2, 1, {1, -1}, {0, 0}}, {"fc2", 1, 2, {1, 1}, {0}}};
  files::save_safetensors(weights, folder_ / "net.safetensors", true);
  expect("certify net.safetensors --blocks", 0, {"verdict: proved for fc1 - ReLU - fc2"});
}

}  // namespace
}  // namespace swarmcert
