/// @file An assertion for all readers: an input is rejected with a helpful message.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "nn/base/input_error.h"

namespace swarmcert::tests {

/// Succeeds if `action` throws an InputError whose one-line message contains each of `pieces`.
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
