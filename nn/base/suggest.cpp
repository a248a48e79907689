#include "nn/base/suggest.h"

#include <algorithm>
#include <numeric>

#include "nn/base/input_error.h"

namespace swarmcert::files {
namespace {

/// Longer words are not misspelled keys, and the cost of the distance is the product of the lengths.
constexpr std::size_t kLongestWord = 100;
constexpr std::size_t kLongestList = 20;

/// Returns the minimum number of insertions, deletions, substitutions and transpositions of adjacent letters that turn
/// `a` into `b` (the restricted Damerau-Levenshtein distance, in which no substring is edited twice).
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1), before, last;
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    before = std::move(last);
    last = row;
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      row[j + 1] = std::min({last[j] + (a[i] == b[j] ? 0 : 1), last[j + 1] + 1, row[j] + 1});
      if (i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j])
        row[j + 1] = std::min(row[j + 1], before[j - 1] + 1);
    }
  }
  return row.back();
}

}  // namespace

std::string nearest(const std::string& word, const std::vector<std::string>& candidates) {
  if (word.size() > kLongestWord) return "";
  std::string best;
  std::size_t best_distance = std::min<std::size_t>(3, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    if (candidate.size() > kLongestWord) continue;
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates) {
  const std::string best = nearest(word, candidates);
  if (!best.empty()) return "did you mean " + in_quotes(best) + "?";
  if (candidates.empty()) return "";
  std::string list = "allowed: ";
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (i == kLongestList) return list + ", and " + std::to_string(candidates.size() - i) + " more";
    list += (i == 0 ? "" : ", ") + candidates[i];
  }
  return list;
}

}  // namespace swarmcert::files
