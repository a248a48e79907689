/// @file The only exception that a user's file can cause. The command line turns it into exit code 3.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace swarmcert::files {

/// Describes what is wrong with an input, in the parts that a user needs to correct it. Empty parts are omitted from
/// the message.
struct InputFault {
  std::string file;   ///< path as the user gave it
  std::string where;  ///< "offset 132" in a binary file, "line 7" in a text file
  std::string field;  ///< tensor name, archive entry or key, e.g. "fc2.weight" or "gamma.value"
  std::string value;  ///< the offending value as text
  std::string what;   ///< the rule that the value violates
  std::string hint;   ///< what the user can do to fix it
};

/// Thrown by every reader. what() is one line: "FILE: WHERE: FIELD = VALUE: WHAT; HINT". Control characters, which a
/// hostile file could put into a name, are shown as "?".
class InputError : public std::runtime_error {
 public:
  explicit InputError(InputFault fault);
  const InputFault& fault() const { return fault_; }

 private:
  InputFault fault_;
};

/// Hint for a binary file that ends early or is inconsistent.
inline constexpr char kCopyAgain[] = "the file is truncated or damaged: copy it again";

/// Returns `text` in double quotes, truncated with "..." after 80 bytes: for text from untrusted files.
std::string in_quotes(std::string_view text);

}  // namespace swarmcert::files
