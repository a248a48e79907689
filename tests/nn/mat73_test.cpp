/// MAT files of version 7.3: exact values, omitted variables, and rejection of damaged and malicious files. Files
/// written by h5py are tested in foreign_files_test.
#include <gtest/gtest.h>

#include <cmath>

#include "hdf5_writer.h"
#include "nn/weights/weights.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using namespace tests;

testing::AssertionResult mat_file_is_refused(const std::string& bytes,
                                             const std::vector<std::string>& pieces) {
  return refuses([&] { parse_weights(bytes, "net.mat"); }, pieces);
}

/// Returns a file with one matrix W1, with `layout` and `filters` for its elements, and sizes as HDF5 states them.
std::string file_of(Mat73Writer& writer, const std::string& layout, const std::string& filters = "",
                    const std::vector<std::uint64_t>& sizes = {2, 3}) {
  return writer.file_with({{"W1", writer.add(hdf5_object(hdf5_shape(sizes) + hdf5_double() + layout +
                                                         filters + hdf5_class("double")))}});
}

TEST(Mat73, NumbersAreReadColumnByColumn) {
  const Weights weights = parse_weights(small_mat73(), "net.mat");
  ASSERT_EQ(weights.layers.size(), 2u);
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{1, 3, 2, 4}));
  EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{0.5, -0.5}));
  EXPECT_EQ(weights.layers[1].weights, (std::vector<double>{5, 6}));
  EXPECT_EQ(weights.precision, Precision::kFloat64);
}

TEST(Mat73, ChunksCompressedOrNotGiveTheSameNumbers) {
  // HDF5's 2 x 3 elements are a 3 x 2 matrix in MATLAB.
  const std::vector<double> padded = {1, 2, 4, 5}, rest = {3, 99, 6, 99};
  for (const bool is_compressed : {false, true}) {
    Mat73Writer writer;
    std::vector<Hdf5Chunk> chunks;
    for (const std::vector<double>& numbers : {padded, rest}) {
      const std::string raw = is_compressed ? deflated(raw_numbers(numbers)) : raw_numbers(numbers);
      chunks.push_back({{0, 2 * chunks.size()}, writer.add(raw), raw.size()});
    }
    const std::uint64_t leaf = writer.add(hdf5_chunk_tree(chunks));
    const std::uint64_t tree = writer.add(hdf5_chunk_tree({{{0, 0}, leaf, 0}}, 1));
    const Weights weights = parse_weights(
        file_of(writer, hdf5_chunked(tree, {2, 2}), is_compressed ? hdf5_filters({1}) : ""), "net.mat");
    EXPECT_EQ(weights.layers.at(0).weights, (std::vector<double>{1, 4, 2, 5, 3, 6}));
    EXPECT_EQ(weights.layers.at(0).outputs, 3);
  }
}

TEST(Mat73, WhatIsNoNetworkIsRefusedByName) {
  Mat73Writer writer;
  const std::uint64_t text = writer.add(hdf5_object(hdf5_shape({1}) + hdf5_double() + hdf5_class("char")));
  EXPECT_TRUE(mat_file_is_refused(writer.file_with({{"comment", text}}), {"neither a cell array", "-v7"}));
  Mat73Writer cells;
  const std::uint64_t inner = cells.add(hdf5_object(hdf5_shape({1}) + hdf5_double() + hdf5_class("char")));
  const std::uint64_t reference = cells.add(little_endian(inner, 8));
  const std::uint64_t weights = cells.add(hdf5_object(hdf5_shape({1, 1}) + hdf5_reference() +
                                                      hdf5_contiguous(reference, 8) + hdf5_class("cell")));
  EXPECT_TRUE(mat_file_is_refused(cells.file_with({{"weights", weights}}),
                                  {"\"weights\"", "cell 1 is not a numeric array"}));
  const std::string good = small_mat73();
  EXPECT_TRUE(
      mat_file_is_refused(good.substr(0, 200), {"address", "beyond the end of the file", "copy it again"}));
  EXPECT_TRUE(mat_file_is_refused(good.substr(0, good.size() - 1),
                                  {"end of the file", "beyond the end", "copy it again"}));
  std::string other = good;
  other[520] = '\1';
  EXPECT_TRUE(
      mat_file_is_refused(other, {"offset 521", "superblock version = 1", "only 0, 2 and 3", "-v7'"}));
}

TEST(Mat73, LayoutsAndFiltersThatAreNotReadAreNamed) {
  Mat73Writer writer;
  const std::string version5 = hdf5_message(8, std::string("\5\1") + std::string(16, '\0'));
  EXPECT_TRUE(mat_file_is_refused(file_of(writer, version5), {"layout version = 5", "only 1 to 4", "-v7"}));
  const std::string newer = hdf5_message(8, std::string("\4\2") + std::string(16, '\0'));
  EXPECT_TRUE(mat_file_is_refused(file_of(writer, newer), {"layout version of chunks = 4", "-v7"}));
  EXPECT_TRUE(mat_file_is_refused(file_of(writer, hdf5_chunked(0, {2, 2}), hdf5_filters({32000})),
                                  {"filter = 32000", "only deflate and shuffle"}));
  EXPECT_TRUE(mat_file_is_refused(file_of(writer, hdf5_chunked(0, {2, 2}), hdf5_filters({1, 1})),
                                  {"filter = 1", "once"}));
  EXPECT_TRUE(
      mat_file_is_refused(file_of(writer, hdf5_contiguous(~std::uint64_t{0}, 48)), {"address = undefined"}));
  EXPECT_TRUE(
      mat_file_is_refused(file_of(writer, hdf5_contiguous(48, 40)), {"shape = [2, 3]", "does not fit"}));
  const std::string outside = hdf5_message(7, std::string(24, '\0'));
  EXPECT_TRUE(
      mat_file_is_refused(file_of(writer, hdf5_contiguous(48, 48) + outside), {"stored in another file"}));
  const std::string link = writer.file(writer.add(hdf5_object(hdf5_link("W1", 0, 64))));
  EXPECT_TRUE(mat_file_is_refused(link, {"link = \"W1\"", "only hard links"}));
  const std::string dense =
      hdf5_message(2, std::string(2, '\0') + little_endian(48, 8) + little_endian(48, 8));
  EXPECT_TRUE(mat_file_is_refused(writer.file(writer.add(hdf5_object(dense))), {"fractal heap", "-v7"}));
  EXPECT_TRUE(mat_file_is_refused(file_of(writer, hdf5_message(8, "", 2)), {"header message = 8", "shared"}));
}

TEST(Mat73, CyclesAndRepetitionsAreRefused) {
  Mat73Writer tree;
  const std::uint64_t itself = tree.end();
  tree.add(hdf5_chunk_tree({{{0, 0}, itself, 0}}, 1));
  EXPECT_TRUE(mat_file_is_refused(file_of(tree, hdf5_chunked(itself, {2, 2})),
                                  {"level of a B-tree's node = 1", "not one below its parent's"}));
  Mat73Writer deep;
  EXPECT_TRUE(mat_file_is_refused(
      file_of(deep, hdf5_chunked(deep.add(hdf5_chunk_tree({{{0, 0}, 0, 0}}, 200)), {2, 2})),
      {"level of a B-tree's node = 200", "more than 16"}));
  Mat73Writer continued;
  const std::uint64_t block = continued.end();
  continued.add("OCHK" + hdf5_continuation(block, 28) + little_endian(0, 4));
  EXPECT_TRUE(mat_file_is_refused(continued.file(continued.add(hdf5_object(hdf5_continuation(block, 28)))),
                                  {"more than 64 continuations"}));
  Mat73Writer many;
  std::string links;
  for (int k = 0; k < 1100; ++k) links += hdf5_link("W", 48);
  EXPECT_TRUE(mat_file_is_refused(many.file(many.add(hdf5_object(links))), {"more than 1024 messages"}));
}

TEST(Mat73, ChunksThatOverlapOrAreMissingAreRefused) {
  const auto with = [](const std::vector<std::vector<std::uint64_t>>& corners) {
    Mat73Writer writer;
    const std::uint64_t raw = writer.add(raw_numbers(std::vector<double>{1, 2, 3, 4}));
    std::vector<Hdf5Chunk> chunks;
    for (const std::vector<std::uint64_t>& corner : corners) chunks.push_back({corner, raw, 32});
    const std::uint64_t tree = writer.add(hdf5_chunk_tree(chunks));
    return file_of(writer, hdf5_chunked(tree, {2, 2}));
  };
  EXPECT_EQ(parse_weights(with({{0, 0}, {0, 2}}), "net.mat").layers.size(), 1u);
  EXPECT_TRUE(mat_file_is_refused(with({{0, 0}, {0, 0}}), {"corner of a chunk = [0, 0]", "overlap"}));
  EXPECT_TRUE(mat_file_is_refused(with({{0, 0}, {0, 1}}), {"corner of a chunk = [0, 1]", "not a multiple"}));
  EXPECT_TRUE(
      mat_file_is_refused(with({{0, 0}, {2, 0}}), {"corner of a chunk = [2, 0]", "inside the dataset"}));
  EXPECT_TRUE(mat_file_is_refused(with({{0, 0}}), {"chunks = 1", "lacks 1 of its chunks"}));
}

TEST(Mat73, MoreNumbersThanTheFileCanHoldAreRefusedUnread) {
  Mat73Writer writer;
  const auto refused = [&writer](const std::string& layout, const std::vector<std::uint64_t>& sizes,
                                 const std::vector<std::string>& pieces, const std::string& filters = "") {
    return mat_file_is_refused(file_of(writer, layout, filters, sizes), pieces);
  };
  const std::uint64_t most = ~std::uint64_t{0};
  EXPECT_TRUE(refused(hdf5_contiguous(48, most), {most, most}, {"more than 33554432 numbers"}));
  EXPECT_TRUE(
      refused(hdf5_contiguous(48, 8 << 20), {1 << 10, 1 << 10}, {"too small for this number of elements"}));
  EXPECT_TRUE(refused(hdf5_chunked(48, {1, 1}), {300, 300}, {"too small for such chunks"}));
  EXPECT_TRUE(refused(hdf5_chunked(48, {1 << 12, 1 << 12}), {2, 2}, {"too small for such chunks"}));
  EXPECT_TRUE(refused(hdf5_chunked(48, {0, 2}), {2, 2}, {"shape of chunks = [0, 2]", "empty or too large"}));
}

TEST(Mat73, AMatrixOfManyRowsWithoutColumnsCostsNoTime) {
  Mat73Writer writer;
  EXPECT_TRUE(mat_file_is_refused(file_of(writer, hdf5_contiguous(48, 0), "", {0, std::uint64_t{1} << 60}),
                                  {"layer1.weight = [1152921504606846976, 0]", "dimension of size 0"}));
}

TEST(Mat73, ABombOfZerosIsRefused) {
  // A chunk of 1 MiB compressed to 1 KiB, to which 200 matrices of four numbers refer.
  Mat73Writer writer;
  const std::uint64_t side = 362;
  const std::string packed = deflated(std::string(8 * side * side, '\0'));
  const std::uint64_t raw = writer.add(packed);
  const std::uint64_t tree = writer.add(hdf5_chunk_tree({{{0, 0}, raw, packed.size()}}));
  const std::uint64_t matrix =
      writer.add(hdf5_object(hdf5_shape({2, 2}) + hdf5_double() + hdf5_chunked(tree, {side, side}) +
                             hdf5_filters({1}) + hdf5_class("double")));
  EXPECT_EQ(parse_weights(writer.file_with({{"W1", matrix}}), "net.mat").layers.size(), 1u);
  std::vector<std::pair<std::string, std::uint64_t>> links;
  for (int k = 1; k <= 200; ++k) links.emplace_back("W" + std::to_string(k), matrix);
  EXPECT_TRUE(mat_file_is_refused(writer.file_with(links), {"more than 128 MiB", "-v6"}));
}

TEST(Mat73, ReferencesToTheSameObjectCostNoMoreThanALargeNetwork) {
  // 4096 cells, each of which refers to the same matrix of 64 KiB.
  Mat73Writer writer;
  const std::uint64_t matrix = writer.add_matrix({1, 8192}, std::vector<double>(8192, 1.0));
  const std::uint64_t cells = writer.add(raw_numbers(std::vector<std::uint64_t>(4096, matrix)));
  const std::uint64_t weights = writer.add(hdf5_object(
      hdf5_shape({4096, 1}) + hdf5_reference() + hdf5_contiguous(cells, 8 * 4096) + hdf5_class("cell")));
  EXPECT_TRUE(mat_file_is_refused(writer.file_with({{"weights", weights}}), {"more than 128 MiB", "-v6"}));
}

}  // namespace
}  // namespace swarmcert::files
