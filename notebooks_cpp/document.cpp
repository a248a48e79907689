#include "notebooks_cpp/document.h"

#include <openssl/evp.h>

#include <sstream>

namespace swarmcert::notebook {
namespace {

std::string base64(const std::string& bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3), '\0');
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                  reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
  return text;
}

/// As notebooks keep text: a list of lines with their ends.
files::Json lines_of(const std::string& text) {
  files::Json lines = files::Json::array();
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(stream.eof() ? line : line + "\n");
  return lines;
}

files::Json json_of(const Output& output) {
  if (!output.is_plot())
    return {{"name", "stdout"}, {"output_type", "stream"}, {"text", lines_of(output.text)}};
  files::Json data = files::Json::object();
  if (!output.svg.empty()) data["image/svg+xml"] = lines_of(output.svg);
  if (!output.png.empty()) data["image/png"] = base64(output.png);
  data["text/plain"] = lines_of(output.text);
  return {{"data", std::move(data)},
          {"metadata", {{"swarmcert", {{"data", lines_of(output.data)}}}}},
          {"output_type", "display_data"}};
}

}  // namespace

files::Json to_ipynb(const std::vector<RunCell>& cells) {
  files::Json list = files::Json::array();
  int executed = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string id = "cell-" + std::to_string(i);
    if (!cells[i].is_code) {
      list.push_back({{"cell_type", "markdown"},
                      {"id", id},
                      {"metadata", files::Json::object()},
                      {"source", lines_of(cells[i].text)}});
      continue;
    }
    files::Json outputs = files::Json::array();
    for (const Output& output : cells[i].outputs) outputs.push_back(json_of(output));
    list.push_back({{"cell_type", "code"},
                    {"execution_count", ++executed},
                    {"id", id},
                    {"metadata", files::Json::object()},
                    {"outputs", std::move(outputs)},
                    {"source", lines_of(cells[i].text)}});
  }
  return {{"cells", std::move(list)},
          {"metadata",
           {{"kernelspec", {{"display_name", "C++17"}, {"language", "C++17"}, {"name", "xcpp17"}}},
            {"language_info", {{"file_extension", ".cpp"}, {"mimetype", "text/x-c++src"}, {"name", "c++"}}}}},
          {"nbformat", 4},
          {"nbformat_minor", 5}};
}

std::string first_difference(const files::Json& committed, const files::Json& fresh) {
  const auto without_images = [](files::Json cell, int& images) {
    if (!cell.contains("outputs")) return cell;
    for (files::Json& output : cell["outputs"]) {
      if (!output.contains("data")) continue;
      for (const char* kind : {"image/svg+xml", "image/png"})
        images += static_cast<int>(output["data"].erase(kind));
    }
    return cell;
  };
  const files::Json &old_cells = committed["cells"], &new_cells = fresh["cells"];
  if (old_cells.size() != new_cells.size())
    return std::to_string(old_cells.size()) + " cells are committed, " + std::to_string(new_cells.size()) +
           " ran";
  for (std::size_t i = 0; i < old_cells.size(); ++i) {
    int old_images = 0, new_images = 0;
    const files::Json before = without_images(old_cells[i], old_images);
    const files::Json now = without_images(new_cells[i], new_images);
    if (before != now)
      return "cell " + std::to_string(i) + "\ncommitted: " + before.dump(1) + "\nfresh: " + now.dump(1);
    if (old_images != new_images)
      return "cell " + std::to_string(i) + ": " + std::to_string(old_images) + " images are committed, " +
             std::to_string(new_images) + " were drawn (gnuplot)";
  }
  return "";
}

}  // namespace swarmcert::notebook
