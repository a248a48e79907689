/// @file Numbers of things in words.
#pragma once

#include <cstddef>
#include <string>

namespace swarmcert::analysis {

/// "1 flight", "3 flights": for nouns whose plural ends in s.
inline std::string counted(std::size_t number, const char* noun) {
  return std::to_string(number) + " " + noun + (number == 1 ? "" : "s");
}

}  // namespace swarmcert::analysis
