#include "notebooks_cpp/notebook.h"

#include <cstdio>
#include <cstdlib>

#include "nn/base/file_io.h"

namespace swarmcert::notebook {
namespace {

bool is_rendered() { return std::getenv("SWARMCERT_NOTEBOOK") != nullptr; }

}  // namespace

void cell(int index) {
  if (is_rendered()) std::printf("%ccell %d\n", kMark, index);
}

void plot(const std::string& name, const std::string& data, const std::string& script) {
  files::write_file(name + ".dat", data, true);
  files::write_file(name + ".gp", script, true);
  if (is_rendered())
    std::printf("%cplot %s\n", kMark, name.c_str());
  else
    std::printf("plot: gnuplot -p %s.gp\n", name.c_str());
}

}  // namespace swarmcert::notebook
