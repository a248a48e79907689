/// @file Flight logs and residuals as numpy arrays.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

namespace swarmcert::python {

/// Reads a log in SI units: {"path", "format", "signals": {name: array [n] or [n, k]}, "sources": [{...}],
/// "findings": [text], "interpretation": [text], "judged_force": [axis]}. Every array owns its memory.
/// @param columns columns.toml for a CSV file; "": columns are recognised by name.
/// @throws files::InputError as logs::read_log().
pybind11::dict read_log(const std::string& path, const std::string& columns);

/// Returns the residuals used by compare: one dict per vehicle and flight for which a force can be judged, with
/// arrays over its records.
/// @param words models, then flights. fleet, columns, network: as --flights, --columns, --network; "" if not given.
/// @throws files::InputError as residuals::read_inputs().
pybind11::list residuals(const std::vector<std::string>& words, const std::string& fleet,
                         const std::string& columns, const std::string& network);

}  // namespace swarmcert::python
