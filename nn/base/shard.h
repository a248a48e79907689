/// @file Work that is cut into parts for several machines.
#pragma once

namespace swarmcert::files {

/// Part `index` of `count`: the units whose number leaves this remainder, so that all parts cover each unit once.
struct Shard {
  int index = 0, count = 1;

  bool is_whole() const { return count == 1; }
  bool has(long unit) const { return unit % count == index; }
};

}  // namespace swarmcert::files
