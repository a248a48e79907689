/// @file Progress of tasks that run on several threads.
#pragma once

#include <algorithm>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace swarmcert::lipschitz {

/// Counts finished tasks and reports the name of the task that has been running longest.
class WorkProgress {
 public:
  using Show = std::function<void(int done, int total, const std::string& what)>;

  /// @param show called from any thread, one at a time; empty: nothing is shown.
  WorkProgress(int total, Show show) : total_(total), show_(std::move(show)) {}

  /// Runs `work` under the name `what`.
  template <class Work>
  void run(const std::string& what, const Work& work) {
    change([&] { running_.push_back(what); });
    work();
    change([&] {
      running_.erase(std::find(running_.begin(), running_.end(), what));
      ++done_;
    });
  }

 private:
  template <class Change>
  void change(const Change& apply) {
    const std::lock_guard<std::mutex> lock(mutex_);
    apply();
    if (show_) show_(done_, total_, running_.empty() ? "done" : running_.front());
  }

  std::mutex mutex_;
  int done_ = 0;
  const int total_;
  const Show show_;
  std::vector<std::string> running_;  ///< in the order in which they began
};

}  // namespace swarmcert::lipschitz
