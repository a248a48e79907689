/// @file One claim for all readers: this input is refused, with a message that helps.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "nn/base/input_error.h"

namespace swarmcert::tests {

/// Holds if `action` throws InputError whose one-line message has every one of `pieces`.
template <typename Action>
testing::AssertionResult refuses(const Action& action, const std::vector<std::string>& pieces) {
  try {
    action();
  } catch (const files::InputError& error) {
    const std::string message = error.what();
    for (const std::string& piece : pieces) {
      if (message.find(piece) == std::string::npos) {
        return testing::AssertionFailure() << "\"" << piece << "\" is missing in: " << message;
      }
    }
    return testing::AssertionSuccess() << message;
  }
  return testing::AssertionFailure() << "no error";
}

}  // namespace swarmcert::tests
