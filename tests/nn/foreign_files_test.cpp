/// Files written by PyTorch, onnx, SciPy, NumPy and h5py (files/make_files.py, make_mat_files.py), with the outputs
/// that these programs compute; .nnet files written by hand; and damaged files.
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <functional>
#include <set>

#include "data.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "nn/weights/activation.h"
#include "nn/weights/hdf5.h"
#include "nn/weights/weights.h"
#include "pth_writer.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using namespace tests;

std::string foreign(const std::string& name) { return source_path("tests/nn/files/" + name); }

testing::AssertionResult foreign_is_refused(const std::string& bytes,
                                            const std::vector<std::string>& pieces) {
  return refuses([&] { parse_weights(bytes, "net"); }, pieces);
}

TEST(ForeignFiles, GiveWhatTheProgramsThatWroteThemCompute) {
  const Json expected = parse_json(read_file(foreign("expected.json")), "expected.json");
  std::set<std::string> formats;
  for (const auto& [name, cases] : expected.items()) {
    const Weights weights = load_weights(foreign(name));
    const Evaluator<double> f(weights);
    formats.insert(name.substr(name.find('.')));
    ASSERT_GE(cases.size(), 6u);
    double largest = 0;
    for (const Json& one : cases) {
      const auto y = f(one["x"].get<std::vector<double>>());
      const auto truth = one["y"].get<std::vector<double>>();
      ASSERT_EQ(y.size(), truth.size());
      for (std::size_t i = 0; i < y.size(); ++i) {
        EXPECT_NEAR(y[i], truth[i], 1e-12 * (1 + std::fabs(truth[i]))) << name;
        largest = std::fmax(largest, std::fabs(truth[i]));
      }
    }
    EXPECT_GT(largest, 0.01) << name << " is not compared with anything but 0";
  }
  EXPECT_EQ(formats, (std::set<std::string>{".mat", ".npz", ".onnx", ".pth"}));
  EXPECT_EQ(expected.size(), 19u);
}

TEST(ForeignFiles, WhatWasComputedOrAssumedIsSaid) {
  const auto notes_of = [](const std::string& name) {
    std::string all;
    for (const std::string& note : load_weights(foreign(name)).notes) all += note + "\n";
    return all;
  };
  const auto says = [](const std::string& text, const std::string& piece) {
    return text.find(piece) != std::string::npos;
  };
  EXPECT_TRUE(says(notes_of("torch_spectral_old.pth"), "fc1.weight is computed from its spectral_norm"));
  EXPECT_TRUE(says(notes_of("torch_spectral_new.pth"), "fc2.weight is computed from its spectral_norm"));
  EXPECT_TRUE(says(notes_of("torch_weight_norm.pth"), "weight_norm, g v / |v|"));
  EXPECT_TRUE(says(notes_of("torch_half.pth"), "stored as float16"));
  EXPECT_TRUE(says(notes_of("torch_image.onnx"), "batch normalization in inference is folded"));
  EXPECT_TRUE(says(notes_of("torch_series.onnx"), "one layer"));
  EXPECT_TRUE(says(notes_of("onnx_digits.onnx"), "Softmax is omitted"));
  EXPECT_TRUE(says(notes_of("h5py_struct.mat"), "the network is the struct \"net\""));
  EXPECT_TRUE(says(notes_of("scipy_struct.mat"), "the network is the struct \"net\""));
  EXPECT_EQ(load_weights(foreign("h5py_struct.mat")).precision, Precision::kFloat32);
  const Weights cells = load_weights(foreign("h5py_cells.mat"));
  EXPECT_EQ(cells.unused, std::vector<std::string>{"comment: not known"});
  EXPECT_TRUE(says(cells.assumed.at(0), "\"comment\" does not bear on the function"));
  EXPECT_EQ(notes_of("onnx_acas.onnx"), "");
}

TEST(ForeignFiles, FoldedWeightsThatAreNoDoublesWidenTheSlope) {
  for (const char* const name : {"torch_image.onnx", "torch_residual.onnx", "onnx_digits.onnx",
                                 "torch_spectral_new.pth", "torch_weight_norm.pth"}) {
    const double rounding = rounding_of_slope(load_weights(foreign(name)));
    EXPECT_GT(rounding, 0) << name;
    EXPECT_LT(rounding, 1e-11) << name;
  }
  for (const char* const name : {"onnx_acas.onnx", "torch_half.pth", "scipy_weights.mat"})
    EXPECT_EQ(rounding_of_slope(load_weights(foreign(name))), 0) << name;
}

const char kNnet[] =
    "// A network with 2 inputs and 1 output\n"
    "2,2,1,2,\n2,2,1,\n0,\n-1.0,-2.0,\n1.0,2.0,\n0.5,1.0,10.0,\n2.0,4.0,8.0,\n"
    "1.0,-1.0,\n0.5,2.0,\n0.25,\n-0.5,\n2.0,-3.0,\n1.5,\n";

TEST(Activation, OfAStateDictIsTheSameFunctionWithRelu) {
  const Weights plain = load_weights(foreign("numpy_list.npz"));
  struct Case {
    std::string name;
    std::function<double(double)> function;
  };
  const std::vector<Case> cases = {{"leaky_relu", [](double x) { return x < 0 ? 0.01 * x : x; }},
                                   {"leaky_relu:-0.5", [](double x) { return x < 0 ? -0.5 * x : x; }},
                                   {"relu6", [](double x) { return std::fmin(std::fmax(x, 0), 6); }},
                                   {"hardtanh", [](double x) { return std::fmin(std::fmax(x, -1), 1); }}};
  for (const Case& one : cases) {
    ASSERT_TRUE(is_activation(one.name));
    const Evaluator<double> f(with_activation(plain, one.name));
    for (const std::vector<double>& x : {std::vector<double>{3, -1, 0.5}, {-9, 8, 20}, {0.1, 0.2, -0.3}}) {
      std::vector<double> h = x;
      for (const Layer& layer : plain.layers) {
        std::vector<double> next = layer.biases;
        for (std::size_t i = 0; i < next.size(); ++i)
          for (std::size_t j = 0; j < h.size(); ++j) next[i] += layer.weights[i * h.size() + j] * h[j];
        if (&layer != &plain.layers.back())
          for (double& value : next) value = one.function(value);
        h = next;
      }
      const std::vector<double> y = f(x);
      for (std::size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(y[i], h[i], 1e-12) << one.name;
    }
  }
  for (const char* const name : {"mish", "leaky_relu:", "leaky_relu:x", "leaky_relux", ""})
    EXPECT_FALSE(is_activation(name)) << name;
  EXPECT_TRUE(refuses([] { with_activation(load_weights(foreign("onnx_acas.onnx")), "relu6"); },
                      {"--activation", "the file itself states"}));
}

TEST(Nnet, NormalizationIsFolded) {
  const Weights weights = parse_weights(kNnet, "net.nnet");
  ASSERT_EQ(weights.layers.size(), 2u);
  const Evaluator<double> f(weights);
  for (const double x : {-1.0, 0.5, 3.0}) {
    for (const double z : {-2.0, 1.0, 6.0}) {
      const double u = (x - 0.5) / 2, v = (z - 1) / 4;
      const double h = std::fmax(u - v + 0.25, 0), g = std::fmax(0.5 * u + 2 * v - 0.5, 0);
      EXPECT_EQ(f({x, z})[0], (2 * h - 3 * g + 1.5) * 8 + 10);  // every number is a multiple of 1/16
    }
  }
  EXPECT_EQ(rounding_of_slope(weights), 0);
  EXPECT_EQ(weights.order_source, OrderSource::kFile);
}

TEST(Nnet, DamagedLinesAreRefusedByNumber) {
  const std::string text = kNnet;
  const auto with = [&](const std::string& from, const std::string& to) {
    return std::string(text).replace(text.find(from), from.size(), to);
  };
  EXPECT_TRUE(foreign_is_refused(with("2,2,1,\n0", "2,3,1,\n0"), {"line 11", "expected 2 numbers"}));
  EXPECT_TRUE(foreign_is_refused(with("2.0,4.0,8.0", "0.0,4.0,8.0"), {"line 8", "a range is 0"}));
  EXPECT_TRUE(foreign_is_refused(with("0.5,2.0", "0.5,nan"), {"line 10", "finite number"}));
  EXPECT_TRUE(foreign_is_refused(with("2,2,1,\n0", "2,2,2,\n0"), {"line 3", "inconsistent"}));
  EXPECT_TRUE(foreign_is_refused(with("2,2,1,2", "99999999,2,1,2"), {"line 2", "expected a count"}));
  EXPECT_TRUE(foreign_is_refused(text.substr(0, text.size() - 5), {"ends early"}));
}

TEST(MatFile, OtherVersionsAreRefusedWithTheCallThatMendsThem) {
  const std::string good = read_file(foreign("scipy_weights.mat"));
  std::string newer = good;
  newer[125] = '\3';
  EXPECT_TRUE(foreign_is_refused(newer, {"a version other than 5 and 7.3", "-v7"}));
  std::string big_endian = good;
  big_endian.replace(126, 2, "MI");
  EXPECT_TRUE(foreign_is_refused(big_endian, {"not little-endian"}));
}

TEST(Hdf5, FilesThatEndBehindTheirSignatureAreRefusedAsIncomplete) {
  const std::string hdf5 = std::string("\x89HDF\r\n\x1a\n", 8) + std::string(100, '\0');
  EXPECT_TRUE(foreign_is_refused(hdf5, {"HDF5", "copy it again"}));
  EXPECT_TRUE(foreign_is_refused(std::string(1024, '#') + hdf5, {"HDF5", "copy it again"}));
  EXPECT_TRUE(foreign_is_refused(std::string(700, '#') + hdf5, {"is neither"}));  // no valid HDF5 offset
}

TEST(MatFile, ABombOfZerosIsRefused) {
  const std::string header = read_file(foreign("scipy_weights.mat")).substr(0, 128);
  std::string packed(std::size_t{1} << 20, '\0'), zeros(std::size_t{1} << 20, '\0');
  z_stream stream{};
  ASSERT_EQ(deflateInit(&stream, Z_BEST_SPEED), Z_OK);
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  constexpr int kMebibytes = 140;
  for (int i = 0; i < kMebibytes; ++i) {
    stream.next_in = reinterpret_cast<Bytef*>(zeros.data());
    stream.avail_in = static_cast<uInt>(zeros.size());
    const bool is_last = i + 1 == kMebibytes;
    ASSERT_EQ(deflate(&stream, is_last ? Z_FINISH : Z_NO_FLUSH), is_last ? Z_STREAM_END : Z_OK);
  }
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  EXPECT_TRUE(foreign_is_refused(header + little_endian(15, 4) + little_endian(packed.size(), 4) + packed,
                                 {"more than 128 MiB", "-v6"}));
}

/// @param hdf5_step  every n-th of these damages is tried of HDF5 files, which take a process each time.
void damage_files(std::size_t hdf5_step) {
  int refused = 0, loaded = 0;
  const auto try_to_load = [&](const std::string& bytes) {
    try {
      const Weights weights = parse_weights(bytes, "damaged");
      for (const Layer& layer : weights.layers) {
        for (const double number : layer.weights) ASSERT_TRUE(std::isfinite(number));
        for (const double number : layer.biases) ASSERT_TRUE(std::isfinite(number));
        ASSERT_GE(layer.weight_rounding, 0);
      }
      for (std::size_t k = 1; k < weights.layers.size(); ++k)
        ASSERT_EQ(weights.layers[k].inputs, weights.layers[k - 1].outputs);
      ++loaded;
    } catch (const InputError&) {
      ++refused;
    }
  };
  for (const char* const name :
       {"onnx_digits.onnx", "scipy_weights.mat", "scipy_biases.mat", "scipy_struct.mat", "numpy_list.npz",
        "h5py_cells.mat", "h5py_chunked.mat", "h5py_struct.mat"}) {
    const std::string good = read_file(foreign(name));
    const std::size_t step = looks_like_hdf5(good) ? hdf5_step : 1;
    for (std::size_t size = 0; size < good.size(); size += 3 * step) try_to_load(good.substr(0, size));
    for (std::size_t bit = 0; bit < 8 * good.size(); bit += 5 * step) {
      std::string bytes = good;
      bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ 1 << bit % 8);
      try_to_load(bytes);
    }
  }
  EXPECT_GT(refused, 1000);
  EXPECT_GT(loaded, 100);
}

TEST(ForeignFiles, EveryTruncationAndManyFlippedBitsAreRefusedOrGiveASoundNetwork) { damage_files(61); }

TEST(ForeignFiles, EveryTruncationAndManyFlippedBitsOfHdf5AreRefusedOrGiveASoundNetwork_slow) {
  damage_files(1);
}

}  // namespace
}  // namespace swarmcert::files
