#include "lipschitz/checker/tree_words.h"

#include <algorithm>
#include <charconv>

namespace swarmcert::check {
namespace {

/// Largest number of digits of a number in a tree.
constexpr std::ptrdiff_t kMostDigits = 15;

template <class Number>
bool read_number(const char*& at, const char* end, Number& number) {
  const auto [rest, error] = std::from_chars(at, end, number);
  const bool is_short = rest - at <= kMostDigits;
  at = rest;
  return error == std::errc() && is_short;
}

}  // namespace

bool Words::read(Word& word) {
  const char* const stop = std::find(at_, end_, ' ');
  const char* at = at_;
  at_ = stop;
  if (stop != end_ && ++at_ == end_) return false;  // a space at the end
  if (at == stop) return false;
  word.kind = *at++;
  if (word.kind == 'r') return at == stop;
  if (word.kind == 's' || word.kind == 't' || word.kind == 'q')
    return read_number(at, stop, word.index) && at == stop;
  if (word.kind != 'd' || !read_number(at, stop, word.decision.neuron) || at == stop ||
      (*at != '+' && *at != '-'))
    return false;
  word.decision.is_on = *at++ == '+';
  return read_number(at, stop, word.decision.corner) && at == stop;
}

std::string word_of(const Decision& decision) {
  return "d" + std::to_string(decision.neuron) + (decision.is_on ? "+" : "-") +
         std::to_string(decision.corner);
}

}  // namespace swarmcert::check
