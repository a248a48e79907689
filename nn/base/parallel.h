/// @file Independent work items on several threads.
#pragma once

#include <functional>

namespace swarmcert::files {

/// Returns `jobs` if positive, else the number of hardware threads.
int thread_count(int jobs);

/// Calls work(0) .. work(count - 1) once each, on up to `jobs` threads, and returns when all have finished. Results
/// must not depend on which thread runs an item or when.
/// @param jobs see thread_count().
/// @throws the exception of the failed item with the lowest index, after all running items have finished; items that
///   have not been started by then are skipped.
void parallel_for(int count, int jobs, const std::function<void(int)>& work);

}  // namespace swarmcert::files
