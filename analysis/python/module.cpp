#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <filesystem>

#include "analysis/cli/bundled.h"
#include "analysis/cli/command.h"
#include "analysis/commands/commands.h"
#include "analysis/python/flights.h"
#include "analysis/python/network.h"
#include "analysis/python/run.h"
#include "nn/base/input_error.h"

namespace py = pybind11;

namespace swarmcert::python {
namespace {

/// Raises `swarmcert.NAME`, which is defined in Python code.
void raise(const char* name, const py::args& arguments) {
  const py::object type = py::module_::import("swarmcert._errors").attr(name);
  PyErr_SetObject(type.ptr(), type(*arguments).ptr());
}

void translate(std::exception_ptr pointer) {
  try {
    if (pointer) std::rethrow_exception(pointer);
  } catch (const files::InputError& error) {
    const files::InputFault& fault = error.fault();
    raise("InputError", py::make_tuple(error.what(), fault.file, fault.where, fault.field, fault.value,
                                       fault.what, fault.hint));
  } catch (const analysis::UsageError& error) {
    raise("UsageError", py::make_tuple(error.what()));
  } catch (const std::filesystem::filesystem_error& error) {
    const std::string message = error.path1().string() + ": " + error.code().message();
    PyErr_SetString(PyExc_OSError, message.c_str());
  }
}

/// Returns the declared options by command, without dashes, and whether each takes a value.
py::dict options() {
  py::dict result;
  for (const analysis::Command& command : analysis::commands()) {
    CLI::App app;
    command.declare(app);
    py::dict of;
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames())
        if (name != "help") of[name.c_str()] = option->get_expected_max() > 0;
    }
    result[command.name.c_str()] = of;
  }
  return result;
}

}  // namespace
}  // namespace swarmcert::python

PYBIND11_MODULE(_core, module) {
  using namespace swarmcert::python;
  module.doc() = "What the package swarmcert calls; not for direct use.";
  module.attr("version") = SWARMCERT_VERSION;
  py::register_exception_translator(translate);
  module.def("run", run, py::arg("words"), py::arg("network") = py::none(),
             py::arg("certificate") = py::none(), py::arg("progress") = py::none());
  module.def("options", options);
  module.def("read_log", read_log, py::arg("path"), py::arg("columns") = "");
  module.def("residuals", residuals, py::arg("words"), py::arg("fleet") = "", py::arg("columns") = "",
             py::arg("network") = "");
  module.def("save_network", save_network, py::arg("source"), py::arg("folder"), py::arg("overwrite"));
  module.def(
      "bundled_files_beside",
      [](const std::string& folder) {
        swarmcert::analysis::bundled_files_beside(folder);
        swarmcert::analysis::add_bundled_programs_to_path();
      },
      py::arg("folder"));
}
