/// @file What the registry knows of a task. The classes are seen by their own files only.
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

/// Each in the file of its name.
namespace tasks {
TaskEntry circle();
TaskEntry hover();
TaskEntry random_walk();
TaskEntry swap();
TaskEntry takeoff();
}  // namespace tasks

}  // namespace swarmcert::stability
