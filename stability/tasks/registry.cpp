#include <functional>
#include <stdexcept>

#include "stability/tasks/circle.h"
#include "stability/tasks/hover.h"
#include "stability/tasks/random_walk.h"
#include "stability/tasks/swap.h"
#include "stability/tasks/takeoff.h"
#include "stability/tasks/task.h"

namespace swarmcert::stability {
namespace {

struct Entry {
  std::string name, summary;
  std::function<std::unique_ptr<Task>(const TaskOptions&)> make;
};

template <typename T>
Entry entry() {
  return {T::kName, T::kSummary, [](const TaskOptions& options) { return std::make_unique<T>(options); }};
}

/// A new task is one line here.
const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = {entry<Hover>(), entry<Swap>(), entry<RandomWalk>(), entry<Circle>(),
                                         entry<Takeoff>()};
  return all;
}

const Entry& find(const std::string& name) {
  for (const Entry& entry : entries()) {
    if (entry.name == name) return entry;
  }
  throw std::invalid_argument("there is no task named " + name);
}

}  // namespace

std::optional<SetpointRange> Task::over(int, double, double) const { return std::nullopt; }

std::vector<std::string> task_names() {
  std::vector<std::string> names;
  for (const Entry& entry : entries()) names.push_back(entry.name);
  return names;
}

std::string task_summary(const std::string& name) { return find(name).summary; }

std::unique_ptr<Task> make_task(const std::string& name, const TaskOptions& options) {
  if (options.vehicles < 1 || options.duration_s < 0) {
    throw std::invalid_argument("make_task: vehicles must be at least 1 and the duration not negative");
  }
  return find(name).make(options);
}

}  // namespace swarmcert::stability
