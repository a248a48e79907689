/// @file The Crazyflie app in a linked image, on QEMU's Cortex-M4: controllerOutOfTree() and appMain() themselves are
/// called, as the firmware calls them.
///
/// The few functions of the firmware that they ask (time, battery, neighbours, the estimator's log variables) are
/// replaced in memory by jumps to code that reads the answers of a Tick; waiting for the next period ends a call of
/// the task.
#pragma once

#include <string>
#include <vector>

#include "analysis/firmware/cortex_m.h"
#include "analysis/firmware/elf_image.h"
#include "analysis/firmware/golden_flight.h"

namespace swarmcert::firmware {

/// Loads the segments of an image into the machine.
/// @throws NotRun if they do not fit.
void load(CortexM& target, const ElfImage& image);

/// Whether the app's code is examined by this name: a function or object of the app, or a function of the firmware that
/// is replaced.
bool is_name_of_app(const std::string& name);

/// True if the image contains any function or object of the app.
bool holds_app(const ElfImage& image);

class AppInImage {
 public:
  /// @param image must outlive this.
  /// @throws NotRun with the reason if the app cannot be called, such as a missing symbol.
  explicit AppInImage(const ElfImage& image);

  /// As AppOnHost::run(). @throws NotRun
  TickResult run(const Tick& tick);

  /// The parameters as the image starts with them.
  AppParameters parameters_at_start() const { return at_start_; }
  /// `count` words of the controller's settings, after its initialisation.
  std::vector<std::uint32_t> settings(std::size_t count);
  /// Result of controllerOutOfTreeTest(), with a self-test that has not run yet.
  bool passes_test();

  CortexM& machine() { return machine_; }

 private:
  std::uint32_t address(const char* name) const;
  std::string inputs_of(const Tick& tick) const;

  const ElfImage& image_;
  CortexM machine_;
  std::vector<std::uint32_t> layout_;
  AppParameters at_start_;
  std::uint32_t delay_ = 0;
};

}  // namespace swarmcert::firmware
