/// @file Did-you-mean.
#pragma once

#include <string>
#include <vector>

namespace swarmcert::files {

/// The candidate closest to `word` by edit distance, or "" if none is near (more than a third of the letters, or
/// more than three, differ).
std::string nearest(const std::string& word, const std::vector<std::string>& candidates);

/// `did you mean "X"?`, or a list of what is allowed where nothing is near.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace swarmcert::files
