/// @file Text encoding of a proof by parts. Not for users.
#pragma once

#include <string>

#include "lipschitz/checker/box_states.h"

namespace swarmcert::check {

/// One word; see TreeProof for the meaning of the letters.
struct Word {
  char kind = ' ';         ///< s, t, q, r or d
  std::size_t index = 0;   ///< for s, t and q
  Decision decision = {};  ///< for d
};

/// Reads a text word by word: single spaces between words, none at either end.
class Words {
 public:
  explicit Words(const std::string& text) : at_(text.data()), end_(at_ + text.size()) {}
  bool are_left() const { return at_ != end_; }
  /// @returns false if the next word is malformed.
  bool read(Word& word);

 private:
  const char *at_, *end_;
};

/// Returns the word for a decision, such as "d17+5": neuron 17 is on, proved by the slopes of corner 5.
std::string word_of(const Decision& decision);

}  // namespace swarmcert::check
