#include "analysis/cli/host.h"

#include <fmt/core.h>

namespace swarmcert::analysis {
namespace {

thread_local Host* host_of_thread = nullptr;

}  // namespace

Host* host() { return host_of_thread; }

HostScope::HostScope(Host& host) { host_of_thread = &host; }

HostScope::~HostScope() { host_of_thread = nullptr; }

void note(const std::string& line) {
  if (host() != nullptr)
    host()->notes.push_back(line);
  else
    fmt::print(stderr, "{}\n", line);
}

}  // namespace swarmcert::analysis
