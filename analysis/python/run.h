/// @file One command in this process.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <vector>

namespace swarmcert::python {

/// Runs a command as the tool does, but prints nothing, on a thread of its own while the interpreter's lock is
/// released; the calling thread delivers progress and asks for Ctrl-C every 20 ms, which ends the command.
/// @param words command and arguments.
/// @param network dict for network_of() in place of NET, or None.
/// @param certificate text, in place of the file that `check` takes.
/// @param progress callable (done, total, what), or None; what it raises ends the command and is raised here.
/// @return {"code", "result": text of the JSON, "certificate": text or "", "notes": [text]}.
/// @throws files::InputError, analysis::UsageError and what the signal handlers or `progress` raised.
pybind11::dict run(const std::vector<std::string>& words, const pybind11::object& network,
                   const std::optional<std::string>& certificate, const pybind11::object& progress);

}  // namespace swarmcert::python
