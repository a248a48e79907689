/// @file Registry entries of tasks, whose classes are local to their source files.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "stability/tasks/task.h"

namespace swarmcert::stability {

struct TaskEntry {
  std::string name, summary;
  std::function<std::unique_ptr<Task>(const TaskOptions&)> make;
};

template <typename T>
TaskEntry task_entry() {
  return {T::kName, T::kSummary, [](const TaskOptions& options) { return std::make_unique<T>(options); }};
}

/// Each is defined in the source file of the same name.
namespace tasks {
TaskEntry circle();
TaskEntry hover();
TaskEntry random_walk();
TaskEntry swap();
TaskEntry takeoff();
}  // namespace tasks

}  // namespace swarmcert::stability
