#include "nn/weights/samples.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/weights/npy.h"
#include "nn/weights/record_samples.h"
#include "pth_writer.h"
#include "random_network.h"
#include "refusal.h"
#include "temp_folder.h"

namespace swarmcert::files {
namespace {

using tests::refuses;

/// Returns an array as numpy.save writes it, format version 1.
template <typename Scalar>
std::string npy(const std::string& shape, const std::vector<Scalar>& numbers, const std::string& more = "",
                const std::string& type = sizeof(Scalar) == 4 ? "<f4" : "<f8",
                const std::string& fortran_order = "False") {
  const std::string header = "{'descr': '" + type + "', 'fortran_order': " + fortran_order +
                             ", 'shape': " + shape + ", " + more + "}\n";
  return "\x93NUMPY\x01" + std::string(1, '\0') + tests::little_endian(header.size(), 2) + header +
         tests::raw_numbers(numbers);
}

std::string npz(const std::string& inputs, const std::string& outputs) {
  return tests::zip({{"inputs.npy", inputs}, {"outputs.npy", outputs}});
}

/// Parses samples of a network with two inputs and one output.
Samples parsed(const std::string& bytes) { return parse_samples(bytes, "samples", 2, 1); }
testing::AssertionResult samples_are_refused(const std::string& bytes,
                                             const std::vector<std::string>& pieces) {
  return refuses([&] { parsed(bytes); }, pieces);
}

void expect_two_samples(const Samples& samples) {
  EXPECT_EQ(samples.count(), 2u);
  EXPECT_EQ(samples.x, (std::vector<double>{1, 2, 4, 5}));
  EXPECT_EQ(samples.y, (std::vector<double>{3, -0.5}));
}

TEST(Samples, EveryFormatGivesTheSame) {
  expect_two_samples(parsed("1,2,3\n4,5,-0.5\n"));
  expect_two_samples(parsed("\xEF\xBB\xBFx0;x1;y\r\n1; 2;3\r\n\r\n4;5;-5e-1"));
  expect_two_samples(parsed("# written by numpy.savetxt\n1.0e+00  2.0e+00 3\n4 5 -0.5\n"));
  expect_two_samples(parsed(R"({"inputs": [[1, 2], [4, 5]], "outputs": [[3], [-0.5]]})"));
  expect_two_samples(
      parsed(R"({"schema": "swarmcert/samples/1", "inputs": [[1,2],[4,5]], "outputs": [3, -0.5]})"));
  expect_two_samples(parsed(npz(npy<double>("(2, 2)", {1, 2, 4, 5}), npy<float>("(2, 1)", {3, -0.5f}))));
  expect_two_samples(parsed(npz(npy<float>("(2, 2)", {1, 2, 4, 5}), npy<double>("(2,)", {3, -0.5}))));
}

TEST(Samples, ABadCsvIsRefusedWithItsLineAndColumn) {
  EXPECT_TRUE(samples_are_refused("", {"samples", "holds no sample"}));
  EXPECT_TRUE(samples_are_refused("x0,x1,y\n", {"holds no sample"}));
  EXPECT_TRUE(
      samples_are_refused("1,2,3\n4,5\n", {"line 2", "2 columns", "2 inputs and 1 outputs", "makes 3"}));
  EXPECT_TRUE(samples_are_refused("1,2,3,4\n", {"line 1", "4 columns"}));
  EXPECT_TRUE(samples_are_refused("1,2,3\n4,nan,6\n", {"line 2", "input 1", "nan", "not finite"}));
  EXPECT_TRUE(samples_are_refused("1,2,-inf\n", {"line 1", "output 0", "-inf"}));
  EXPECT_TRUE(samples_are_refused("1,2,1e999\n", {"line 1", "output 0"}));
  EXPECT_TRUE(samples_are_refused("1,2,3\n4,x,6\n", {"line 2", "input 1", "\"x\"", "is not a number"}));
  EXPECT_TRUE(samples_are_refused("1,,3\n", {"line 1", "input 1", "is not a number"}));
  EXPECT_TRUE(samples_are_refused(std::string("1,2,3\n\0,5,6\n", 12), {"line 2", "is not a number"}));
}

TEST(Samples, ABadJsonIsRefusedWithItsSample) {
  EXPECT_TRUE(
      samples_are_refused(R"({"inputs": [[1, 2]], "outputs": []})", {"outputs", "0 samples", "there are 1"}));
  EXPECT_TRUE(samples_are_refused(R"({"inputs": [[1, 2], [3]], "outputs": [[1], [2]]})",
                                  {"sample 1", "inputs", "1 numbers"}));
  EXPECT_TRUE(samples_are_refused(R"({"inputs": [[1, "a"]], "outputs": [[1]]})",
                                  {"sample 0", "inputs[1]", "not a number"}));
  EXPECT_TRUE(samples_are_refused(R"({"inputs": [[1, 2]]})", {"outputs", "is not a list"}));
  EXPECT_TRUE(samples_are_refused(R"({"inputs": [], "outputs": []})", {"holds no sample"}));
  EXPECT_TRUE(samples_are_refused(R"({"inputs": [[1, 2]], "outputs": [[1]], "output": 1})",
                                  {"\"output\"", "not a known key"}));
  EXPECT_TRUE(samples_are_refused(R"({"schema": "swarmcert/box/1", "inputs": [[1, 2]], "outputs": [[1]]})",
                                  {"schema"}));
  EXPECT_TRUE(samples_are_refused("{\"inputs\": [[1, 2]", {"line"}));
}

TEST(Samples, ABadNpzIsRefusedWithItsArray) {
  const std::string two = npy<double>("(1, 2)", {1, 2}), one = npy<double>("(1, 1)", {3});
  EXPECT_NO_THROW(parsed(npz(two, one)));
  EXPECT_TRUE(samples_are_refused(npz(npy<double>("(1, 3)", {1, 2, 3}), one),
                                  {"inputs.npy", "[1, 3]", "[samples, 2]"}));
  EXPECT_TRUE(samples_are_refused(npz(npy<double>("(2,)", {1, 2}), one), {"inputs.npy", "[samples, 2]"}));
  EXPECT_TRUE(
      samples_are_refused(npz(two, npy<double>("(2, 1)", {3, 4})), {"outputs", "2 samples", "there are 1"}));
  EXPECT_TRUE(
      samples_are_refused(npz(npy<double>("(0, 2)", {}), npy<double>("(0, 1)", {})), {"holds no sample"}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(samples_are_refused(npz(npy<double>("(1, 2)", {1, nan}), one), {"inputs.npy[0,1]", "nan"}));
  EXPECT_TRUE(samples_are_refused(tests::zip({{"x.npy", two}, {"y.npy", one}}),
                                  {"\"inputs\"", "no such array", "\"x.npy\""}));
  EXPECT_TRUE(samples_are_refused(tests::zip({{"inputs.npy", two, 8, 200}, {"outputs.npy", one}}),
                                  {"inputs.npy", "compressed", "numpy.savez"}));
}

TEST(Npy, ReadsTheVersionsThatNumpyWrites) {
  const std::string first = npy<double>("(2, 1)", {1, 2});
  const std::string header = first.substr(10, first.size() - 10 - 16);
  for (const char version : {'\2', '\3'}) {
    const std::string bytes = std::string("\x93NUMPY") + version + std::string(1, '\0') +
                              tests::little_endian(header.size(), 4) + header +
                              tests::raw_numbers<double>({1, 2});
    const NpyArray array = parse_npy(bytes, "a.npz", "x.npy");
    EXPECT_EQ(array.shape, (std::vector<std::uint64_t>{2, 1}));
    EXPECT_EQ(array.numbers, (std::vector<double>{1, 2}));
  }
  EXPECT_EQ(parse_npy(npy<float>("()", {7}), "a.npz", "x.npy").numbers, (std::vector<double>{7}));
}

TEST(Npy, RefusesWhatItDoesNotReadAndWhatContradictsItself) {
  const auto refused = [](const std::string& bytes, const std::vector<std::string>& pieces) {
    return refuses([&] { parse_npy(bytes, "a.npz", "x.npy"); }, pieces);
  };
  const std::vector<double> two = {1, 2};
  EXPECT_TRUE(refused("", {"a.npz", "x.npy", "not a .npy"}));
  EXPECT_TRUE(refused("\x93NUMPY\x04" + std::string(8, '\0'), {"4", "unknown version"}));
  EXPECT_TRUE(
      refused("\x93NUMPY\x01" + std::string(1, '\0') + "\xff\xff{}", {"65535 bytes", "header is longer"}));
  EXPECT_TRUE(refused(npy("(2,)", two, "", "<f8", "True"), {"fortran_order", "ascontiguousarray"}));
  EXPECT_TRUE(refused(npy("(2,)", two, "", "<i8"), {"\"<i8\"", "float32 or float64"}));
  EXPECT_TRUE(refused(npy("(2,)", two, "", ">f8"), {"\">f8\"", "little-endian"}));
  EXPECT_TRUE(refused(npy("(2,)", two, "", "|O"), {"\"|O\""}));
  EXPECT_TRUE(refused(npy("(3,)", two), {"[3]", "16 bytes"}));
  EXPECT_TRUE(refused(npy("(1,)", two), {"[1]", "16 bytes"}));
  EXPECT_TRUE(refused(npy("(4294967296, 4294967296)", two), {"more than"}));
  EXPECT_TRUE(refused(npy("(99999999999999999999,)", two), {"not a list of sizes"}));
  EXPECT_TRUE(refused(npy("(-1,)", two), {"not a list of sizes"}));
  EXPECT_TRUE(refused(npy("(1,1,1,1,1,1,1,1,2)", two), {"8 dimensions"}));
  EXPECT_TRUE(refused(npy("(2,)", two, "'extra': 1"), {"\"extra\"", "not a key"}));
  EXPECT_TRUE(refused(npy("(2,)", two, "'shape': (2,)"), {"\"shape\"", "twice"}));
}

class HeldAgainst : public testing::Test {
 protected:
  HeldAgainst() {
    std::mt19937 generator(7);
    network_.plain = tests::random_network({3, 16, 16, 16, 2}, generator);
  }
  Samples recorded() const { return record_samples(network_, float32_output(network_), 50, 1).at("network"); }
  Network network_;
};

TEST_F(HeldAgainst, Float32RecordingsAreReproducedWithRoomToSpare) {
  std::mt19937 generator(3);
  double worst = 0;
  for (const std::vector<int>& sizes :
       {std::vector<int>{6, 40, 40, 40, 20}, {2, 320, 320, 1}, {1, 5, 1}, std::vector<int>(66, 40)}) {
    network_.plain = tests::random_network(sizes, generator);
    const SampleAgreement agreement = hold_against(network_, "network", recorded());
    EXPECT_EQ(agreement.count, 50u);
    EXPECT_GT(agreement.tolerance, 0);
    worst = std::max(worst, agreement.largest_deviation / agreement.tolerance);
  }
  EXPECT_GT(worst, 0);  // float32 rounds
  EXPECT_LT(worst, 0.5);
}

TEST_F(HeldAgainst, AnotherOrderAnotherActivationAndASkipConnectionAreRefused) {
  const Samples in_order = recorded();
  Network other = network_;
  std::swap(other.plain->layers[1], other.plain->layers[2]);
  EXPECT_TRUE(
      refuses([&] { hold_against(other, "network", in_order); },
              {"sample ", "output ", "worst of 50 samples", "tolerance", "--order", "skip connection"}));
  const auto refused_for = [&](const std::function<double(double)>& last) {
    Samples samples = recorded();
    for (double& y : samples.y) y = last(y);
    return refuses([&] { hold_against(network_, "network", samples); }, {"--activation"});
  };
  EXPECT_TRUE(refused_for([](double y) { return y > 0 ? y : 0.01 * y; }));
  Samples skip = recorded();
  for (std::size_t i = 0; i < skip.count(); ++i) skip.y[2 * i] += 0.01 * skip.x[3 * i];
  EXPECT_TRUE(refuses([&] { hold_against(network_, "network", skip); }, {"skip connection"}));
}

TEST_F(HeldAgainst, TheWorstSampleIsNamedWithItsInputsAndBothOutputs) {
  Samples samples = recorded();
  samples.lines.resize(samples.count());
  for (std::size_t i = 0; i < samples.count(); ++i) samples.lines[i] = static_cast<int>(2 + i);
  samples.y[2 * 10] += 1;
  samples.y[2 * 30 + 1] = 99;
  samples.x[3 * 30] = 0.25;
  samples.path = "samples.csv";
  EXPECT_TRUE(refuses([&] { hold_against(network_, "network", samples); },
                      {"samples.csv: line 32", "output 1 = 99", "gives", "(0.25, "}));
}

TEST_F(HeldAgainst, NumbersThatOverflowAreRefused) {
  Samples samples = recorded();
  samples.x[0] = 1e308;
  samples.x[1] = -1e308;
  for (files::Layer& layer : network_.plain->layers)
    for (double& w : layer.weights) w *= 1e150;
  EXPECT_TRUE(refuses([&] { hold_against(network_, "network", samples); }, {"sample"}));
}

TEST_F(HeldAgainst, TheClampIsPartOfTheFunction) {
  std::mt19937 generator(5);
  Network set;
  set.phi["small"] = tests::random_network({2, 4}, generator);
  set.rho["small"] = tests::random_network({4, 1}, generator);
  set.clamp = InputClamp{{-1, -1}, {1, 1}};
  const std::map<std::string, Samples> inside = record_samples(set, float32_output(set), 20, 1);
  EXPECT_NO_THROW(hold_against(set, "phi:small", inside.at("phi:small")));
  Samples outside = inside.at("phi:small");
  outside.x[0] = 3;
  outside.y = {};
  const Evaluator<double> phi(set.phi.at("small"));
  for (std::size_t i = 0; i < outside.count(); ++i) {
    for (const double y : phi({outside.x[2 * i], outside.x[2 * i + 1]})) outside.y.push_back(y);
  }
  EXPECT_TRUE(refuses([&] { hold_against(set, "phi:small", outside); }, {"sample 0", "outside input.clamp"}));
}

TEST(ReadSamples, OfADeepSetNamesItsParts) {
  const tests::TempFolder folder;
  std::mt19937 generator(5);
  Network set;
  set.phi["default"] = tests::random_network({2, 4}, generator);
  set.rho["default"] = tests::random_network({4, 1}, generator);
  const std::map<std::string, Samples> recorded = record_samples(set, float32_output(set), 20, 1);
  write_file(folder / "all.json", to_text(samples_json(recorded)), false);
  const std::map<std::string, Samples> all = read_samples(folder / "all.json", set);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all.at("phi:default").x, recorded.at("phi:default").x);
  EXPECT_EQ(all.at("rho:default").y, recorded.at("rho:default").y);
  write_file(folder / "rho.csv", "1,2,3,4,5\n", false);
  EXPECT_EQ(read_samples("rho=" + (folder / "rho.csv"), set).count("rho:default"), 1u);
  EXPECT_EQ(read_samples("rho:default=" + (folder / "rho.csv"), set).count("rho:default"), 1u);
  EXPECT_TRUE(refuses([&] { read_samples(folder / "rho.csv", set); }, {"does not state to which part"}));
  EXPECT_TRUE(refuses([&] { read_samples("phi:large=" + (folder / "rho.csv"), set); },
                      {"\"phi:large\"", "not a part", "phi:default, rho:default"}));
}

}  // namespace
}  // namespace swarmcert::files
