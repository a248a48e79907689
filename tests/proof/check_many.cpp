/// The checker of `swarmcert check` for many certificates of one NET in a single process. Reads their names from
/// standard input, one per line, and prints for each the exit code of the command, a tab and the reason.
///   check_many NET [A,B,C] | check_many PHI RHO --pair
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "lipschitz/checker/check.h"
#include "nn/base/input_error.h"

namespace {

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> words;
  std::istringstream text(list);
  for (std::string word; std::getline(text, word, ',');) words.push_back(word);
  return words;
}

swarmcert::files::NetworkArguments arguments(int argc, char** argv) {
  swarmcert::files::NetworkArguments result;
  if (argc == 4) {
    result.phi = argv[1];
    result.rho = argv[2];
  } else {
    result.file = argv[1];
    if (argc == 3) result.order = split(argv[2]);
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) return 2;
  const swarmcert::files::Network network = swarmcert::files::load_any_network(arguments(argc, argv));
  for (std::string path; std::getline(std::cin, path);) {
    int code = 3;
    std::string reason;
    try {
      const auto certificate = swarmcert::files::read_json(path, swarmcert::check::kCertificateSchema);
      const auto verdict = swarmcert::check::check(
          certificate, swarmcert::check::with_stated_activations(certificate, network));
      code = verdict.accepted ? 0 : 1;
      reason = verdict.reason;
    } catch (const swarmcert::files::InputError& error) {
      reason = error.what();
    }
    for (char& c : reason)
      if (c == '\n') c = ' ';
    std::cout << code << '\t' << reason << std::endl;
  }
}
