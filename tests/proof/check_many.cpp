/// The checker of `swarmcert check` for many certificates of one NET in a single process. Reads their names from
/// standard input, one per line, and prints for each the exit code of the command, a tab and the reason.
///   check_many NET CERTIFICATE | check_many PHI RHO --pair CERTIFICATE
/// CERTIFICATE states how NET is read.
#include <iostream>
#include <string>

#include "lipschitz/checker/check.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

int main(int argc, char** argv) {
  using namespace swarmcert;
  if (argc != 3 && argc != 5) return 2;
  files::NetworkArguments named;
  if (argc == 3) {
    named.file = argv[1];
  } else {
    named.phi = argv[1];
    named.rho = argv[2];
  }
  const std::string original = argv[argc - 1];
  const files::Network network = files::load_any_network(
      check::with_stated_options(check::parse_certificate(files::read_file(original), original), named));
  for (std::string path; std::getline(std::cin, path);) {
    int code = 3;
    std::string reason;
    try {
      const auto verdict = check::check(check::parse_certificate(files::read_file(path), path), network);
      code = verdict.accepted ? 0 : 1;
      reason = verdict.reason;
    } catch (const files::InputError& error) {
      reason = error.what();
    }
    for (char& c : reason)
      if (c == '\n') c = ' ';
    std::cout << code << '\t' << reason << std::endl;
  }
}
