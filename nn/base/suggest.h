/// @file Spelling suggestions for messages.
#pragma once

#include <string>
#include <vector>

namespace swarmcert::files {

/// Returns the candidate closest to `word` by edit distance, or "" if none is near (more than a third of the letters,
/// or more than three, differ).
std::string nearest(const std::string& word, const std::vector<std::string>& candidates);

/// Returns `did you mean "X"?`, or the list of candidates if none is near.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace swarmcert::files
