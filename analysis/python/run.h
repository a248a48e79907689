/// @file Runs one command in this process.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <vector>

namespace swarmcert::python {

/// Runs a command as the tool does, but prints nothing. The command has its own thread and runs without the
/// interpreter lock; the calling thread delivers progress and checks every 20 ms for Ctrl-C, which ends the command.
/// @param words command and arguments.
/// @param network dict for network_of() in place of NET, or None.
/// @param certificate text in place of the file that `check` reads.
/// @param progress callable (done, total, what), or None; an exception raised by it ends the command and is propagated.
/// @return {"code", "result": text of the JSON, "certificate": text or "", "notes": [text]}.
/// @throws files::InputError, analysis::UsageError, and whatever the signal handlers or `progress` raised.
pybind11::dict run(const std::vector<std::string>& words, const pybind11::object& network,
                   const std::optional<std::string>& certificate, const pybind11::object& progress);

}  // namespace swarmcert::python
