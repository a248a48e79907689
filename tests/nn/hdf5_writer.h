/// @file Writes HDF5 files by the HDF5 library: MAT files of version 7.3 and Keras models.
#pragma once

#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace swarmcert::tests {

class Hdf5Writer {
 public:
  /// @param user_block  bytes before the HDF5 part: 512 for MATLAB's header.
  explicit Hdf5Writer(hsize_t user_block = 0)
      : path_((std::filesystem::temp_directory_path() / ("writer" + std::to_string(getpid()) + ".h5"))
                  .string()),
        user_block_(user_block) {
    const hid_t create = H5Pcreate(H5P_FILE_CREATE);
    H5Pset_userblock(create, user_block);
    file_ = H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, create, H5P_DEFAULT);
    H5Pclose(create);
  }
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;
  ~Hdf5Writer() {
    if (file_ >= 0) H5Fclose(file_);
    std::filesystem::remove(path_);
  }

  /// Adds a dataset of numbers, row by row; with `chunk` in compressed chunks of this shape.
  void add(const std::string& name, const std::vector<hsize_t>& shape, const std::vector<double>& numbers,
           hid_t type = H5T_IEEE_F64LE, const std::vector<hsize_t>& chunk = {}) {
    const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
    if (!chunk.empty()) {
      H5Pset_chunk(layout, static_cast<int>(chunk.size()), chunk.data());
      H5Pset_deflate(layout, 9);
    }
    const hid_t links = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(links, 1);
    const hid_t data = H5Dcreate2(file_, name.c_str(), type, space, links, layout, H5P_DEFAULT);
    if (!numbers.empty()) H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data());
    H5Dclose(data);
    H5Pclose(links);
    H5Pclose(layout);
    H5Sclose(space);
  }

  /// Adds a matrix as MATLAB does: `sizes` as MATLAB states them, the numbers column by column.
  void add_matrix(const std::string& name, const std::vector<hsize_t>& sizes,
                  const std::vector<double>& numbers, const std::string& matlab_class = "double") {
    add(name, {sizes.rbegin(), sizes.rend()}, numbers,
        matlab_class == "char" ? H5T_STD_U16LE : H5T_IEEE_F64LE);
    set_text(name, "MATLAB_class", {matlab_class});
  }

  /// Adds a cell array [1 x count] of these objects.
  void add_cells(const std::string& name, const std::vector<std::string>& objects) {
    std::vector<hobj_ref_t> references(objects.size());
    for (std::size_t k = 0; k < objects.size(); ++k)
      H5Rcreate(&references[k], file_, objects[k].c_str(), H5R_OBJECT, -1);
    const hsize_t shape[] = {objects.size(), 1};
    const hid_t space = H5Screate_simple(2, shape, nullptr);
    const hid_t data =
        H5Dcreate2(file_, name.c_str(), H5T_STD_REF_OBJ, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(data, H5T_STD_REF_OBJ, H5S_ALL, H5S_ALL, H5P_DEFAULT, references.data());
    H5Dclose(data);
    H5Sclose(space);
    set_text(name, "MATLAB_class", {"cell"});
  }

  /// Sets an attribute: one text, or a list of texts.
  void set_text(const std::string& object, const std::string& attribute,
                const std::vector<std::string>& texts) {
    std::size_t size = 1;
    for (const std::string& text : texts) size = std::max(size, text.size());
    std::string padded;
    for (std::string text : texts) {
      text.resize(size, '\0');
      padded += text;
    }
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, size);
    const hsize_t count[] = {texts.size()};
    const hid_t space = texts.size() == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, count, nullptr);
    const hid_t at = H5Oopen(file_, object.c_str(), H5P_DEFAULT);
    const hid_t stored = H5Acreate2(at, attribute.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(stored, type, padded.data());
    H5Aclose(stored);
    H5Oclose(at);
    H5Sclose(space);
    H5Tclose(type);
  }

  /// Makes `name` another link to `object`.
  void link(const std::string& object, const std::string& name) {
    H5Lcreate_hard(file_, object.c_str(), file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
  }
  void link_to_file(const std::string& file, const std::string& name) {
    H5Lcreate_external(file.c_str(), "/x", file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
  }

  /// Closes the file and returns its bytes, with MATLAB's header if there is a user block.
  std::string bytes() {
    H5Fclose(std::exchange(file_, -1));
    std::ifstream stream(path_, std::ios::binary);
    std::string all((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    if (user_block_ == 0) return all;
    std::string head = "MATLAB 7.3 MAT-file";
    head.resize(124, ' ');
    head += std::string("\0\2IM", 4);
    return all.replace(0, head.size(), head);
  }

 private:
  std::string path_;
  hsize_t user_block_;
  hid_t file_ = -1;
};

/// Returns a MAT file with two layers, 2-2-1, as the cell arrays "weights" and "biases".
inline std::string small_mat73() {
  Hdf5Writer writer(512);
  writer.add_matrix("#refs#/a", {2, 2}, {1, 2, 3, 4});
  writer.add_matrix("#refs#/b", {1, 2}, {5, 6});
  writer.add_matrix("#refs#/c", {2, 1}, {0.5, -0.5});
  writer.add_matrix("#refs#/d", {1, 1}, {0.25});
  writer.add_cells("weights", {"#refs#/a", "#refs#/b"});
  writer.add_cells("biases", {"#refs#/c", "#refs#/d"});
  return writer.bytes();
}

/// Returns a Keras model 2-3-1 of Dense layers with this activation between them. Kernels are [inputs x outputs].
inline std::string small_keras(const std::string& activation) {
  Hdf5Writer writer;
  const std::vector<std::string> kernels = {"dense/dense/kernel:0", "dense_1/dense_1/kernel:0"};
  writer.add("model_weights/" + kernels[0], {2, 3}, {1, 2, 3, 4, 5, 6}, H5T_IEEE_F32LE);
  writer.add("model_weights/dense/dense/bias:0", {3}, {0.5, 0.25, 0.125}, H5T_IEEE_F32LE);
  writer.add("model_weights/" + kernels[1], {3, 1}, {1, -1, 2}, H5T_IEEE_F32LE);
  writer.set_text("model_weights", "layer_names", {"dense", "dense_1"});
  writer.set_text("model_weights/dense", "weight_names", {"dense/kernel:0", "dense/bias:0"});
  writer.set_text("model_weights/dense_1", "weight_names", {"dense_1/kernel:0"});
  writer.set_text("/", "model_config",
                  {R"({"class_name": "Sequential", "config": {"name": "s", "layers": [
    {"class_name": "InputLayer", "config": {"name": "x"}},
    {"class_name": "Dense", "config": {"name": "dense", "activation": ")" +
                   activation + R"("}},
    {"class_name": "Dropout", "config": {"name": "dropout"}},
    {"class_name": "Dense", "config": {"name": "dense_1", "activation": "linear"}}]}})"});
  return writer.bytes();
}

}  // namespace swarmcert::tests
