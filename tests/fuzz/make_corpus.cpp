/// make_corpus OUT [DATA]: writes seed files for the fuzz targets below OUT, including the published networks in DATA.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>

#include "analysis/log_writer.h"
#include "data.h"
#include "logs/dataflash_writer.h"
#include "logs/mcap_writer.h"
#include "logs/rosbag_writer.h"
#include "logs/ulog_writer.h"
#include "nn/hdf5_writer.h"
#include "nn/onnx_writer.h"
#include "nn/pth_writer.h"
#include "nn/weights/safetensors.h"
#include "nn/weights/weights.h"

namespace {

namespace fs = std::filesystem;
using namespace swarmcert::tests;

class Corpus {
 public:
  explicit Corpus(fs::path folder) : folder_(std::move(folder)) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }

  /// Adds `bytes`, and copies of it with one byte changed, truncated, and with a piece repeated.
  void add(const std::string& bytes) {
    write(bytes);
    for (int i = 0; i < 4 && !bytes.empty(); ++i) {
      std::string changed = bytes;
      changed[random() % bytes.size()] = static_cast<char>(random());
      write(changed);
    }
    write(bytes.substr(0, bytes.size() / 2 + random() % (bytes.size() / 2 + 1)));
    const std::size_t at = random() % (bytes.size() + 1);
    write(bytes.substr(0, at) + bytes.substr(at / 2));
  }

 private:
  std::size_t random() { return generator_(); }
  void write(const std::string& bytes) {
    std::ofstream(folder_ / std::to_string(count_++), std::ios::binary) << bytes;
  }

  fs::path folder_;
  std::mt19937 generator_{1};
  int count_ = 0;
};

void add_samples(Corpus& corpus) {
  corpus.add("x0,x1,y\n1,2,3\n4,5,-0.5\n");
  corpus.add("# numpy.savetxt\n1.0e+00 2 3\n");
  corpus.add(R"({"schema": "swarmcert/samples/1", "inputs": [[1, 2]], "outputs": [3]})");
  const auto npy = [](const std::string& shape, const std::vector<double>& numbers) {
    const std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': " + shape + ", }\n";
    return "\x93NUMPY\x01" + std::string(1, '\0') + little_endian(header.size(), 2) + header +
           raw_numbers(numbers);
  };
  const std::string inputs = npy("(2, 2)", {1, 2, 4, 5}), outputs = npy("(2, 1)", {3, -0.5});
  corpus.add(inputs);
  corpus.add(zip({{"inputs.npy", inputs}, {"outputs.npy", outputs}}));
}

/// The first byte selects the key in the fuzz target.
std::string with_key(char choice, const std::string& bytes) { return choice + bytes; }

void add_weights(Corpus& corpus, const std::string& data) {
  corpus.add(with_key(0, small_zip()));
  corpus.add(with_key(0, small_legacy()));
  const swarmcert::files::Weights weights = swarmcert::files::parse_weights(small_zip(), "small");
  corpus.add(with_key(0, swarmcert::files::safetensors_bytes(weights)));
  corpus.add(with_key(0, small_mat73()));

  OnnxModel model;
  model.nodes = {onnx_node("Gemm", {"x", "w", "b"}, {"h"}, {onnx_integer("transB", 1)}),
                 onnx_node("Relu", {"h"}, {"r"}), onnx_node("MatMul", {"r", "v"}, {"m"}),
                 onnx_node("Add", {"c", "m"}, {"y"})};
  model.tensors = {onnx_raw("w", {2, 2}, {1, 2, 3, 4}), onnx_floats("b", {2}, {1, 2}),
                   onnx_raw("v", {2, 1}, {1, 2}), onnx_raw("c", {1}, {3})};
  corpus.add(with_key(0, model.bytes()));
  corpus.add(
      with_key(0,
               "struct A {float fc1_weight[2][1]; float fc1_bias[1];}; static const struct A weights_A = "
               "{.fc1_weight = {{1},{-2.5e0f}}, .fc1_bias = {.5},};"));

  std::vector<TensorSpec> tensors = small_tensors();
  for (TensorSpec& tensor : tensors) tensor.is_parameter = true;
  tensors[0].strides = {1, 3};  // transposed
  const std::string state = state_dict_op(tensors, false);
  corpus.add(
      with_key(0, zip_file(pickle(state), small_storages<float>(), {{"archive/byteorder", "little"}})));
  const std::string nested = "}(" + text_op("epoch") + "K\7" + text_op("model") + state + "u";
  corpus.add(with_key(1, zip_file(pickle(nested), small_storages<float>())));
  const std::string deeper = "}(" + text_op("model") + "}(" + text_op("net") + state + "uu";
  corpus.add(with_key(2, zip_file(pickle(deeper), small_storages<float>())));

  for (const auto& entry : fs::directory_iterator(source_path("tests/nn/files"))) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(file), {});
    if (entry.path().extension() != ".py" && entry.path().extension() != ".json")
      corpus.add(with_key(0, bytes));
  }
  corpus.add(with_key(0, "// nnet\n1,2,1,2,\n2,1,\n0,\n-1,-2,\n1,2,\n0,0.5,0,\n1,2,1,\n1,-1,\n0.5,\n"));
  if (data.empty() || !fs::exists(data)) return;
  for (const char* const folder : {"zip_f32", "legacy_f64"}) {
    for (const auto& entry : fs::directory_iterator(fs::path(data) / "weights" / folder)) {
      std::ifstream file(entry.path(), std::ios::binary);
      corpus.add(with_key(0, std::string(std::istreambuf_iterator<char>(file), {})));
    }
  }
}

void add_networks(Corpus& corpus) {
  const std::string minimal =
      "schema = \"swarmcert/network/1\"\n[phi.small]\nweights = \"6x20\"\n[rho.small]\nweights = \"20x1\"\n";
  corpus.add(minimal);
  corpus.add("# \xc3\xa4\n" + minimal + "[phi.\"\xe2\x82\xac\"]\nweights = \"\xc3\xbc/6x20\"\n");
  corpus.add(minimal + "[phi.ground]\nweights = \"4x20\"\n[phi.large]\nweights = \"6x20\"\n");
  corpus.add(
      "schema = \"swarmcert/network/1\"\n"
      "output = { quantity = \"force_z\", unit = \"gf\" }\n"
      "gamma = { value = 3.0, scope = \"layer\", mode = \"clip\" }\n"
      "[input]\norder = [\"a\", \"b\", \"c\", \"d\", \"e\", \"f\"]\n"
      "clamp = { lower = [-1,-1,-1,-2,-2,-2.5], upper = [1,1,1,2,2,2e0] }\n"
      "[phi.small]\nweights = \"6x20\"\n[rho.small]\nweights = \"20x1\"\n");
}

void add_json(Corpus& corpus) {
  corpus.add(
      "{\"schema\": \"swarmcert/certificate/1\", \"list\": [1, -2.5e3, true, null, {\"x\": \"\\u00e9\"}]}");
  corpus.add("[[[[]]], {}, \"a\\n\", 18446744073709551615, 1e-400]");
  corpus.add("0x1.91eb851eb851fp+1");
  corpus.add("-0x0.0000000000001p-1022");
}

void add_logs(Corpus& corpus, const std::string& data) {
  corpus.add(small_usd());
  corpus.add(small_events(1));
  corpus.add(small_events(2));
  corpus.add("# time[ms],x[m],y[m],z[m],vx[m/s],vy[m/s],vz[m/s]\n1e4,0,0,1,0,0,0\n2e4,0,0,1,0,0,0\n");
  const fs::path log = fs::path(data) / "flights/development/21_swap_ss/cf50_00";
  if (data.empty() || !fs::exists(log)) return;
  std::string bytes(6000, '\0');
  std::ifstream(log, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  corpus.add(bytes);
}

void add_log_formats(Corpus& corpus) {
  corpus.add(small_ulog());
  corpus.add(ulog_head() + ulog_flags(1, 1, {150}) + ulog_count_definitions() + ulog_counts(0, 5));
  corpus.add(small_mcap());
  corpus.add(small_rosbag());
  corpus.add(small_dataflash());
  corpus.add("Timestamp,stabilizer.roll,pm.vbat[V]\n10,0.5,3.7\n20,text,\n30,1e-3,nan\n");
  for (const char* const name : {"reference_zstd.mcap", "reference_lz4.mcap"}) {
    std::ifstream file(std::string(SWARMCERT_SOURCE_DIR "/tests/logs/data/") + name, std::ios::binary);
    corpus.add(std::string(std::istreambuf_iterator<char>(file), {}));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: make_corpus OUT [DATA]\n";
    return 2;
  }
  const fs::path out = argv[1];
  Corpus weights(out / "weights");
  add_weights(weights, argc > 2 ? argv[2] : "");
  Corpus networks(out / "network");
  add_networks(networks);
  Corpus logs(out / "log");
  add_logs(logs, argc > 2 ? argv[2] : "");
  Corpus log_formats(out / "log_formats");
  add_log_formats(log_formats);
  Corpus samples(out / "samples");
  add_samples(samples);
  Corpus json(out / "json");
  add_json(json);
  return 0;
}
