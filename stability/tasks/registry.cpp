#include <stdexcept>

#include "stability/tasks/task_entry.h"

namespace swarmcert::stability {
namespace {

/// Each task is one line.
const std::vector<TaskEntry>& task_entries() {
  static const std::vector<TaskEntry> all = {tasks::hover(), tasks::swap(), tasks::random_walk(),
                                             tasks::circle(), tasks::takeoff()};
  return all;
}

const TaskEntry& find_task(const std::string& name) {
  for (const TaskEntry& entry : task_entries()) {
    if (entry.name == name) return entry;
  }
  throw std::invalid_argument("there is no task named " + name);
}

}  // namespace

std::optional<SetpointRange> Task::over(int, double, double) const { return std::nullopt; }

std::vector<std::string> task_names() {
  std::vector<std::string> names;
  for (const TaskEntry& entry : task_entries()) names.push_back(entry.name);
  return names;
}

std::string task_summary(const std::string& name) { return find_task(name).summary; }

std::unique_ptr<Task> make_task(const std::string& name, const TaskOptions& options) {
  if (options.vehicles < 1 || options.duration_s < 0) {
    throw std::invalid_argument("make_task: vehicles must be at least 1 and the duration not negative");
  }
  return find_task(name).make(options);
}

}  // namespace swarmcert::stability
