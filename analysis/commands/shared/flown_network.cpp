#include "analysis/commands/shared/flown_network.h"

#include "nn/base/input_error.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {

void declare_as(CLI::App& app, std::string& as) {
  app.add_option("--as", as, "float32: round the weights of a float64 file, as certify --as float32 does")
      ->check(CLI::IsMember({"float32"}));
}

files::Network load_flown_net(const files::NetworkArguments& arguments, const std::string& as,
                              bool& is_rounded) {
  files::Network network = load_net(arguments);
  is_rounded = false;
  for (const auto& [part, weights] : files::parts(network)) {
    if (weights->precision == files::Precision::kFloat32) continue;
    if (as != "float32") {
      throw files::InputError({weights->path, "", part.name(), "float64",
                               "flight code is float32: rounding changes the function",
                               "use --as float32, here and in certify"});
    }
    is_rounded = true;
  }
  return is_rounded ? files::as_float32(std::move(network)) : network;
}

}  // namespace swarmcert::analysis
