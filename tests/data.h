/// @file Locations of recorded data that is not part of the project.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace swarmcert::tests {

/// Path of `relative` below the folder of recorded data, e.g. "weights/zip_f32/phi_L.pth".
inline std::string data_path(const std::string& relative) {
  return std::string(SWARMCERT_DATA_DIR) + "/" + relative;
}

inline bool data_is_present() { return std::filesystem::exists(SWARMCERT_DATA_DIR); }

/// Returns a path below the source tree.
inline std::string source_path(const std::string& relative) {
  return std::string(SWARMCERT_SOURCE_DIR) + "/" + relative;
}

}  // namespace swarmcert::tests

/// Skips the test with a message if the recorded data is missing; fails with -DSWARMCERT_REQUIRE_DATA=ON.
#define SWARMCERT_NEEDS_DATA()                                                               \
  do {                                                                                       \
    if (!swarmcert::tests::data_is_present()) {                                              \
      if (SWARMCERT_REQUIRE_DATA) FAIL() << "recorded data is missing: " SWARMCERT_DATA_DIR; \
      GTEST_SKIP() << "recorded data is missing: " SWARMCERT_DATA_DIR;                       \
    }                                                                                        \
  } while (false)
