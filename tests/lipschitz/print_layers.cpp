/// Prints what the readers of `swarmcert check` make of weight files, for the tests of the other readers. Reads their
/// names from standard input, one per line, and prints for each a line of JSON: {"refused": MESSAGE}, or the precision
/// and the layers, every number as a hexadecimal float.
#include <cstdio>
#include <iostream>
#include <string>

#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/weights/weights.h"

namespace {

using swarmcert::files::Json;

Json hex_numbers(const std::vector<double>& numbers) {
  Json result = Json::array();
  for (const double number : numbers) {
    char text[40];
    std::snprintf(text, sizeof text, "%a", number);
    result.push_back(text);
  }
  return result;
}

Json read_by_cpp(const std::string& path) {
  try {
    const swarmcert::files::Weights weights = swarmcert::files::load_weights(path);
    Json layers = Json::array();
    for (const swarmcert::files::Layer& layer : weights.layers)
      layers.push_back({layer.name, layer.outputs, layer.inputs, hex_numbers(layer.weights),
                        hex_numbers(layer.biases), op_after(layer)});
    return {{"precision", name(weights.precision)}, {"layers", std::move(layers)}};
  } catch (const swarmcert::files::InputError& refused) {
    return {{"refused", refused.what()}};
  }
}

}  // namespace

int main() {
  for (std::string path; std::getline(std::cin, path);)
    std::cout << read_by_cpp(path).dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
}
