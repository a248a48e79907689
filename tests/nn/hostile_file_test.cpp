/// Malicious files: decompression bombs, cycles and every small damage. Each must end in an InputError or a valid
/// network, within bounded memory. The sanitizer builds run these as well.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>

#include "hdf5_writer.h"
#include "nn/weights/hdf5.h"
#include "nn/weights/safetensors.h"
#include "nn/weights/weights.h"
#include "pth_writer.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using namespace tests;

testing::AssertionResult archive_is_refused(const std::string& bytes,
                                            const std::vector<std::string>& pieces) {
  return refuses([&] { parse_weights(bytes, "hostile.pth"); }, pieces);
}
std::string small_program(const std::string& ops) { return zip_file(pickle(ops), small_storages<float>()); }

std::string repeated(const std::string& text, std::size_t times) {
  std::string result;
  for (std::size_t i = 0; i < times; ++i) result += text;
  return result;
}

/// Returns the peak memory of this process in bytes. Under a sanitizer this would include the sanitizer's own memory.
[[maybe_unused]] std::size_t peak_memory_bytes() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) << 10;
}

/// Counts how many inputs were rejected and how many gave a network.
struct Outcomes {
  int refused = 0;
  int loaded = 0;
};

/// Loads `bytes`; a loaded network must satisfy the invariant of Weights.
void try_to_load(const std::string& bytes, Outcomes& outcomes) {
  try {
    const Weights weights = parse_weights(bytes, "damaged");
    ++outcomes.loaded;
    ASSERT_FALSE(weights.layers.empty());
    int width = weights.inputs();
    for (const Layer& layer : weights.layers) {
      ASSERT_GT(layer.outputs, 0);
      ASSERT_EQ(layer.inputs, width);
      ASSERT_EQ(layer.weights.size(),
                static_cast<std::size_t>(layer.outputs) * static_cast<std::size_t>(layer.inputs));
      ASSERT_EQ(layer.biases.size(), static_cast<std::size_t>(layer.outputs));
      for (const double number : layer.weights) ASSERT_TRUE(std::isfinite(number));
      for (const double number : layer.biases) ASSERT_TRUE(std::isfinite(number));
      width = layer.outputs;
    }
  } catch (const InputError&) {
    ++outcomes.refused;
  }
}

struct Sample {
  const char* name;
  std::string bytes;
};
std::vector<Sample> samples() {
  const Weights small = parse_weights(small_zip(), "small");
  return {{"zip", small_zip()},
          {"legacy", small_legacy()},
          {"safetensors", safetensors_bytes(small)},
          {"mat 7.3", small_mat73()}};
}

/// Every n-th damage of a sample is tried. Reading HDF5 takes a process each time: of those files all damages are tried
/// only by hand.
using Stride = std::size_t (*)(const Sample&);
std::size_t every(const Sample&) { return 1; }
std::size_t some_of_hdf5(const Sample& sample) { return looks_like_hdf5(sample.bytes) ? 29 : 1; }

void truncate_all(Stride stride) {
  for (const Sample& sample : samples()) {
    SCOPED_TRACE(sample.name);
    Outcomes outcomes;
    for (std::size_t size = 0; size < sample.bytes.size(); size += stride(sample)) {
      try_to_load(sample.bytes.substr(0, size), outcomes);
      EXPECT_EQ(outcomes.loaded, 0) << "cut to " << size << " of " << sample.bytes.size();
    }
    try_to_load(sample.bytes, outcomes);
    EXPECT_EQ(outcomes.loaded, 1);
  }
}

void flip_all(Stride stride) {
  for (const Sample& sample : samples()) {
    SCOPED_TRACE(sample.name);
    Outcomes outcomes;
    for (std::size_t bit = 0; bit < 8 * sample.bytes.size(); bit += stride(sample)) {
      std::string bytes = sample.bytes;
      bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ 1 << bit % 8);
      try_to_load(bytes, outcomes);
    }
    EXPECT_GT(static_cast<std::size_t>(outcomes.refused) * stride(sample), 1000u);
  }
}

void overwrite_all(Stride stride) {
  // Alone, the process may use 300 MB; after other tests, at most 100 MB more than they used.
  [[maybe_unused]] const std::size_t before = std::max(peak_memory_bytes(), std::size_t{200} << 20);
  Outcomes outcomes;
  for (const Sample& sample : samples()) {
    for (std::size_t at = 0; at + 8 <= sample.bytes.size(); at += stride(sample)) {
      for (const char fill : {'\xff', '\x7f'}) {
        std::string bytes = sample.bytes;
        bytes.replace(at, 8, std::string(8, fill));
        try_to_load(bytes, outcomes);
      }
    }
  }
  EXPECT_GT(outcomes.refused, 1000);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__clang__)
  EXPECT_LT(peak_memory_bytes(), before + (std::size_t{100} << 20));
#endif
}

TEST(HostileFile, EveryTruncationIsRefused) { truncate_all(some_of_hdf5); }
TEST(HostileFile, EveryFlippedBitIsRefusedOrGivesASoundNetwork) { flip_all(some_of_hdf5); }
TEST(HostileFile, EveryDamagedSmallFileStaysSmallInMemory) { overwrite_all(some_of_hdf5); }

TEST(HostileFile, EveryDamageOfHdf5IsRefusedOrGivesASoundNetwork_slow) {
  truncate_all(every);
  flip_all(every);
  overwrite_all(every);
}

TEST(HostileFile, CompressedEntriesAreRefusedUnread) {
  const std::string bomb = zip({{"archive/data.pkl", std::string(1000, 'x'), 8, 0xfffffffe}});
  EXPECT_TRUE(archive_is_refused(bomb, {"archive/data.pkl", "compressed", "save again with torch.save"}));
  std::vector<ZipEntry> entries = {{"archive/data.pkl", pickle(state_dict_op(small_tensors(), false))}};
  for (const auto& [key, raw] : small_storages<float>())
    entries.push_back({"archive/data/" + key, raw, 8, 1 << 30});
  EXPECT_TRUE(archive_is_refused(zip(entries), {"archive/data/0", "compressed"}));
}

TEST(HostileFile, EntriesLargerThanTheFileAreRefused) {
  EXPECT_TRUE(archive_is_refused(zip({{"archive/data.pkl", "x", 0, 0xfffffff0}}), {"hostile.pth"}));
  EXPECT_TRUE(archive_is_refused(zip({{"archive/data.pkl", "x", 0, 1000}}), {"archive/data.pkl"}));
}

TEST(HostileFile, ManyEntriesAreRefused) {
  std::vector<ZipEntry> entries(10'001, ZipEntry{"a", ""});
  EXPECT_TRUE(archive_is_refused(zip(entries), {"more than 10000 entries"}));
}

TEST(HostileFile, ADirectoryThatDeclaresABillionEntriesIsRefused) {
  // A zip64 end record with its locator in front of the ordinary end record.
  const std::string good = zip({{"archive/data.pkl", "x"}});
  const std::size_t end = good.size() - 22;
  for (const std::uint64_t count : {std::uint64_t{1'000'000'000}, ~std::uint64_t{0}}) {
    const std::string record = "PK\6\6" + little_endian(44, 8) + little_endian(45, 2) + little_endian(45, 2) +
                               little_endian(0, 8) + little_endian(count, 8) + little_endian(count, 8) +
                               good.substr(end + 12, 4) + little_endian(0, 4) + good.substr(end + 16, 4) +
                               little_endian(0, 4);
    const std::string locator = "PK\6\7" + little_endian(0, 4) + little_endian(end, 8) + little_endian(1, 4);
    std::string bytes = good;
    bytes.insert(end, record + locator);
    EXPECT_TRUE(archive_is_refused(bytes, {"more than 10000 entries"}));
  }
}

TEST(HostileFile, APickleThatContainsItselfEndsInARefusal) {
  EXPECT_TRUE(archive_is_refused(small_program(std::string("]q\0h\0a", 6)), {"not a state dict"}));
  const std::string itself =
      small_program(std::string("}q\0", 3) + text_op("model") + std::string("h\0", 2) + "s");
  EXPECT_TRUE(archive_is_refused(itself, {"\"model\" = a dict", "is not a tensor"}));
  EXPECT_TRUE(refuses([&] { parse_weights(itself, "x", "model.model.model"); }, {"\"model\" = a dict"}));
}

TEST(HostileFile, DeepNestingNeedsNoDeepStack) {
  EXPECT_TRUE(archive_is_refused(small_program(repeated("(", 300'000) + repeated("t", 300'000)),
                                 {"not a state dict"}));
  EXPECT_TRUE(archive_is_refused(small_program(repeated("]", 300'000) + repeated("a", 299'999)),
                                 {"not a state dict"}));
}

TEST(HostileFile, EndlessOpcodesAreRefused) {
  EXPECT_TRUE(archive_is_refused(small_program(repeated("N", 1'100'000)),
                                 {"more opcodes than any state dict needs"}));
}

TEST(HostileFile, ALargeTupleIsNotCopiedByEveryCallThatGetsIt) {
  EXPECT_TRUE(archive_is_refused(
      small_program("(" + repeated("N", 100'000) + std::string("tq\0", 3) +
                    global_op("torch._utils", "_rebuild_tensor_v2") + std::string("h\0R", 3)),
      {"more than 8 arguments"}));
}

TEST(HostileFile, MalformedPicklesAreRefusedAtTheirOffset) {
  const std::vector<std::pair<std::string, std::string>> programs = {
      {"", "too few values"},
      {"NN", "leaves values on its stack"},
      {"(N", "leaves values on its stack"},
      {"t", "no mark"},
      {"(\x85", "too few values"},
      {"\x87", "too few values"},
      {"h\5", "never stored"},
      {"q\5", "too few values"},
      {"Na", "too few values"},
      {"NNa", "not a list"},
      {"NNNs", "not a dict"},
      {"}(Nu", "a key without a value"},
      {"NNb", "not a dict"},
      {"NNR", "not a function of torch"},
      {"NQ", "not a torch storage"},
      {"NN\x93", "a name is not text"},
      {"X\xff\xff\xff\x7f", "ends prematurely"},
      {"\x8d" + std::string(8, '\xff'), "ends prematurely"},
      {"\x80\x09N", "newer than 5"},
      {"ctorch", "a name is not terminated"},
      {global_op("torch._utils", "_rebuild_tensor_v2") + ")R", "has no storage"},
      {global_op("torch._utils", "_rebuild_parameter") + ")R", "has no tensor"},
      {"(" + text_op("storage") + global_op("torch", "FloatStorage") + text_op("0") + text_op("cpu") + "NtQ",
       "the size of a storage is not an integer"},
      {"(" + text_op("storage") + global_op("torch", "FloatStorage") + text_op("0") + text_op("cpu") +
           "K\1K\1tQ",
       "a view of another storage"},
      {"i", "0x69: this pickle opcode is not part of a state dict"}};
  for (const auto& [ops, piece] : programs) {
    const std::string bytes = zip({{"archive/data.pkl", pickle(ops)}});
    EXPECT_TRUE(archive_is_refused(bytes, {"hostile.pth: offset ", "archive/data.pkl", piece})) << piece;
  }
}

TEST(HostileFile, ADictionaryFromArgumentsHoldsNoTensors) {
  const std::string ops = global_op("collections", "OrderedDict") + "(NtR";
  EXPECT_TRUE(
      archive_is_refused(zip({{"archive/data.pkl", pickle(ops)}}), {"hostile.pth", "empty state dict"}));
}

TEST(HostileFile, LegacyHeadersAreChecked) {
  const std::string magic = small_legacy().substr(0, 15);
  EXPECT_TRUE(archive_is_refused(magic + pickle(integer_op(1002)), {"protocol version", "must be 1001"}));
  EXPECT_TRUE(archive_is_refused(magic + pickle("N"), {"protocol version"}));
  EXPECT_TRUE(archive_is_refused(magic + pickle(integer_op(1001)) + pickle("N"), {"little_endian"}));
  const std::string system = pickle("}(" + text_op("little_endian") + "\x88u");
  EXPECT_TRUE(archive_is_refused(magic + pickle(integer_op(1001)) + system + pickle("}") + pickle("N"),
                                 {"list of storages", "is not a list"}));
}

}  // namespace
}  // namespace swarmcert::files
