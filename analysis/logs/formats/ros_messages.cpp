#include "analysis/logs/formats/ros_messages.h"

#include "analysis/logs/dictionary.h"

namespace swarmcert::logs {

std::vector<RosMessageText> builtin_ros_definitions(const std::string& name) {
  constexpr std::string_view kStart = "\nMSG: ";
  const std::string_view all = dictionary_text("ros_messages.msg");
  std::vector<RosMessageText> found;
  for (std::size_t at = all.find(kStart); at < all.size();) {
    const std::size_t begin = at + kStart.size(), end = all.find('\n', begin);
    at = std::min(all.find(kStart, begin), all.size());
    const std::string_view text = all.substr(end, at - end);
    if (all.substr(begin, end - begin) == name)
      found.push_back({text, text.find("\n# ...") != std::string_view::npos});
  }
  return found;
}

}  // namespace swarmcert::logs
