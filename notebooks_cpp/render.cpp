/// @file Makes notebooks of guides.
///
///   notebook_renderer mark SOURCE OUTPUT
///     writes the source that is compiled: it says on standard output where each cell begins.
///   notebook_renderer render SOURCE PROGRAM PROJECT FOLDER [COMMITTED]
///     runs PROGRAM in FOLDER/NAME, with the project's folders beside it; writes FOLDER/NAME.ipynb, and fails
///     where COMMITTED differs in anything but the images' bytes.
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <stdexcept>

#include "nn/base/file_io.h"
#include "notebooks_cpp/document.h"
#include "notebooks_cpp/notebook.h"

namespace {

namespace fs = std::filesystem;
namespace files = swarmcert::files;
using namespace swarmcert::notebook;

/// Quoted for a shell.
std::string quoted(const fs::path& path) {
  std::string result = "'";
  for (const char c : path.string()) result += c == '\'' ? "'\\''" : std::string(1, c);
  return result + "'";
}

/// Standard output of `command`, run by a shell in `folder`.
std::string output_of(const std::string& command, const fs::path& folder) {
  FILE* pipe = popen(("cd " + quoted(folder) + " && " + command).c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("no shell");
  std::string output;
  std::array<char, 4096> block{};
  for (std::size_t count; (count = std::fread(block.data(), 1, block.size(), pipe)) > 0;)
    output.append(block.data(), count);
  const int status = pclose(pipe);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error("failed: " + command + "\n" + output);
  return output;
}

/// An empty folder in which a guide finds the project's files under the names that its readers use.
void prepare(const fs::path& folder, const fs::path& project) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  for (const char* name : {"analysis", "controller", "nn", "stability"})
    fs::create_directory_symlink(project / name, folder / name);
  fs::create_directory_symlink(project.parent_path() / "shared" / "data", folder / "data");  // may be missing
}

/// SVG and PNG of NAME.gp; stay empty where gnuplot is missing or fails.
void draw(Output& plot, const std::string& name, const fs::path& folder) {
  for (const auto& [ending, terminal, image] :
       {std::tuple{"svg", "svg noenhanced size 720,400 dynamic font 'sans-serif,13' background '#ffffff'",
                   &plot.svg},
        std::tuple{"png", "png noenhanced size 720,400 font ',11'", &plot.png}}) {
    const std::string script = name + "-" + ending + ".gp";
    files::write_file((folder / script).string(),
                      "set terminal " + std::string(terminal) + "\nset output '" + name + "." + ending +
                          "'\nset encoding utf8\n" + files::read_file((folder / (name + ".gp")).string()),
                      true);
    try {
      output_of("gnuplot " + script + " 2>gnuplot.log", folder);
      *image = files::read_file((folder / (name + "." + ending)).string());
    } catch (const std::runtime_error& error) {
      std::fprintf(stderr, "%s: not drawn: %s\n", name.c_str(), error.what());
    }
  }
}

/// Gives each cell what `output` says between its marks.
std::vector<RunCell> run_cells(const std::vector<Cell>& cells, const std::string& output,
                               const fs::path& folder) {
  std::vector<RunCell> run;
  for (const Cell& cell : cells) run.push_back({cell, {}});
  std::size_t current = cells.size();
  const auto print = [&](const std::string& text) {
    if (text.empty()) return;
    if (current >= run.size()) throw std::runtime_error("output outside of main(): " + text);
    std::vector<Output>& outputs = run[current].outputs;
    if (outputs.empty() || outputs.back().is_plot()) outputs.emplace_back();
    outputs.back().text += text;
  };
  for (std::size_t at = 0; at < output.size();) {
    const std::size_t mark = std::min(output.find(kMark, at), output.size());
    print(output.substr(at, mark - at));
    if (mark == output.size()) break;
    const std::size_t end = output.find('\n', mark);
    const std::string words = output.substr(mark + 1, end - mark - 1);
    if (words.rfind("cell ", 0) == 0) {
      current = static_cast<std::size_t>(std::stoi(words.substr(5)));
    } else {
      const std::string name = words.substr(words.find(' ') + 1);
      Output plot;
      plot.text = "plot " + name;
      plot.data = files::read_file((folder / (name + ".dat")).string());
      draw(plot, name, folder);
      run.at(current).outputs.push_back(std::move(plot));
    }
    at = end + 1;
  }
  return run;
}

int render(const fs::path& source, const fs::path& program, const fs::path& project, const fs::path& folder,
           const char* committed) {
  const std::string name = source.stem().string();
  const fs::path scratch = folder / name;
  prepare(scratch, project);
  const std::vector<Cell> cells = parse_cells(files::read_file(source.string()), source.string());
  const std::string output = output_of("SWARMCERT_NOTEBOOK=1 " + quoted(fs::absolute(program)), scratch);
  const files::Json notebook = to_ipynb(run_cells(cells, output, scratch));
  files::write_file((folder / (name + ".ipynb")).string(), notebook.dump(1) + "\n", true);
  if (committed == nullptr) return 0;
  const std::string difference =
      first_difference(files::parse_json(files::read_file(committed), committed), notebook);
  if (difference.empty()) return 0;
  std::fprintf(stderr,
               "%s is not what a fresh run gives: %s\nIf that is meant: cmake --build --preset dev -t "
               "update_notebooks\n",
               committed, difference.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::string verb = argc > 1 ? argv[1] : "";
    if (verb == "mark" && argc == 4) {
      files::write_file(argv[3], with_marks(files::read_file(argv[2]), argv[2]), true);
      return 0;
    }
    if (verb == "render" && (argc == 6 || argc == 7))
      return render(argv[2], argv[3], fs::absolute(argv[4]), fs::absolute(argv[5]),
                    argc == 7 ? argv[6] : nullptr);
    std::fprintf(
        stderr,
        "usage: notebook_renderer mark SOURCE OUTPUT\n       notebook_renderer render SOURCE PROGRAM "
        "PROJECT FOLDER [COMMITTED]\n");
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "notebook_renderer: %s\n", error.what());
    return 1;
  }
}
