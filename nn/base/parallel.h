/// @file Independent work items on several threads.
#pragma once

#include <functional>

namespace swarmcert::files {

/// `jobs`, or as many threads as the machine has where it is 0 or less.
int thread_count(int jobs);

/// Calls work(0) .. work(count - 1), each once, on up to `jobs` threads; returns when all have ended. Results must
/// not depend on which thread runs a piece or when.
/// @param jobs see thread_count().
/// @throws what a piece threw, of the lowest such index, after all running pieces ended; pieces not yet begun are
///   then left out.
void parallel_for(int count, int jobs, const std::function<void(int)>& work);

}  // namespace swarmcert::files
