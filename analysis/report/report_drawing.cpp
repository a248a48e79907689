#include "analysis/report/report_drawing.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

extern char** environ;

namespace swarmcert::analysis {

std::string plot_script(const std::string& commands, int height) {
  // The colours of Okabe and Ito, darkest first; dash patterns distinguish curves without colour.
  return fmt::format(
             "set encoding utf8\n"
             "if (exists('narrow')) {{\n"
             "  set terminal svg size 400,{} dynamic noenhanced font 'sans-serif,13'\n"
             "  set key tmargin left Left reverse vertical maxcols 1\n"
             "}} else {{\n"
             "  set terminal svg size 800,{} dynamic noenhanced font 'sans-serif,14'\n"
             "  set key outside top center horizontal\n"
             "}}\n",
             std::max(340, height), height) +
         "set linetype 1 linecolor rgb '#0072b2' linewidth 2 dashtype 1 pointtype 7\n"
         "set linetype 2 linecolor rgb '#d55e00' linewidth 2 dashtype 2 pointtype 5\n"
         "set linetype 3 linecolor rgb '#009e73' linewidth 2 dashtype 4 pointtype 9\n"
         "set linetype 4 linecolor rgb '#cc79a7' linewidth 2 dashtype 5 pointtype 13\n"
         "set linetype 5 linecolor rgb '#e69f00' linewidth 2 dashtype 3 pointtype 11\n"
         "set linetype 6 linecolor rgb '#56b4e9' linewidth 2 dashtype 1 pointtype 6\n"
         "set linetype cycle 6\n"
         "set grid linecolor rgb '#888888'\n"
         "set tics nomirror\n"
         // viridis, which gnuplot knows by name only from version 6; and blue over white to vermilion for signed
         // values.
         "set palette defined (0 '#440154', 1 '#482878', 2 '#3e4a89', 3 '#31688e', 4 '#26828e', 5 '#1f9e89', "
         "6 '#35b779', 7 '#6ece58', 8 '#b5de2b', 9 '#fde725')\n"
         "signed_colours = \"defined (-2 '#003f63', -1 '#0072b2', 0 '#f4f4f4', 1 '#d55e00', 2 "
         "'#763400')\"\n" +
         commands;
}

double tick_step(double length) {
  if (!(length > 0) || !std::isfinite(length)) return 1;
  const double power = std::pow(10, std::floor(std::log10(length / 3)));
  const double steps = length / 3 / power;
  return power * (steps >= 5 ? 5 : steps >= 2 ? 2 : 1);
}

namespace {

/// Replaces what gnuplot 5.4 writes into text although XML forbids it there: browsers would not show such an image.
std::string well_formed(std::string svg) {
  const std::pair<const char*, const char*> kReplaced[] = {
      {"]]>", "]]&gt;"}, {"\xEF\xBF\xBE", "\xEF\xBF\xBD"}, {"\xEF\xBF\xBF", "\xEF\xBF\xBD"}};
  for (const auto& [from, to] : kReplaced) {
    for (std::size_t at = svg.find(from); at != std::string::npos; at = svg.find(from, at))
      svg.replace(at, 3, to);
  }
  return svg;
}

}  // namespace

std::string draw(const std::string& folder, const std::string& script, bool is_narrow) {
  int pipe_ends[2];
  if (pipe2(pipe_ends, O_CLOEXEC) != 0) return "";
  std::vector<const char*> arguments = {"gnuplot", "-d"};
  if (is_narrow) arguments.insert(arguments.end(), {"-e", "narrow = 1"});
  arguments.insert(arguments.end(), {script.c_str(), nullptr});
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_adddup2(&actions, pipe_ends[1], 1);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int failed =
      posix_spawnp(&child, "gnuplot", &actions, nullptr, const_cast<char* const*>(arguments.data()), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(pipe_ends[1]);
  std::string svg;
  std::array<char, 65536> buffer;
  for (ssize_t n = 1; failed == 0 && n > 0;) {
    n = read(pipe_ends[0], buffer.data(), buffer.size());
    if (n > 0) svg.append(buffer.data(), static_cast<std::size_t>(n));
  }
  close(pipe_ends[0]);
  int status = 0;
  if (failed != 0 || waitpid(child, &status, 0) != child) return "";
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return "";
  // Cells of heat maps are neither blurred nor separated by gaps.
  const std::size_t head = svg.find("<title>");
  if (head == std::string::npos) return "";
  svg.insert(head, "<style>image{image-rendering:pixelated}polygon{shape-rendering:crispEdges}</style>\n");
  return well_formed(std::move(svg));
}

}  // namespace swarmcert::analysis
