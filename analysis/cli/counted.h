/// @file Counts with their noun, singular or plural.
#pragma once

#include <cstddef>
#include <string>

namespace swarmcert::analysis {

/// Returns "1 flight" or "3 flights"; for nouns whose plural ends in s.
inline std::string counted(std::size_t number, const char* noun) {
  return std::to_string(number) + " " + noun + (number == 1 ? "" : "s");
}

}  // namespace swarmcert::analysis
