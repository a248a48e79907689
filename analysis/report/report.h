/// @file Reports: one self-contained HTML file, with plots drawn by gnuplot from data files stored next to it.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "analysis/report/table.h"

namespace swarmcert::analysis {

/// Signals of flights, for figures that scripts draw: curves over time, and vehicles in space.
struct Flown {
  struct Group {
    std::string name, unit;
    std::vector<std::string> columns;
  };
  struct Log {
    std::string flight, vehicle;
    /// [1 + columns of all groups][rows]: time in s, then the groups; NaN: unknown, interrupts curves.
    std::vector<std::vector<float>> columns;
  };
  struct Mark {
    std::string flight, vehicle;
    double time_s;
    int rank;
    double size;  ///< in force_unit
  };
  std::vector<Group>
      groups;  ///< with "position", "velocity" and "residual"; also "set point", "residual after", ...
  std::vector<Log> logs;  ///< those of one flight follow each other
  std::vector<Mark> marks;
  std::string force_unit;
  int axis = 2;  ///< of the residual that is shown at first
};

/// A moment that the figures of Flown can jump to.
struct ShownMoment {
  std::string flight, vehicle;
  double time_s, log_time_s;  ///< in the flight, and on the clock of the log
  std::string size;           ///< text with its unit
};

/// One bar with its interval; NaN for an unknown end.
struct Bar {
  std::string name;  ///< may come from users
  double value, lower, upper;
};

/// Collects text, tables and figures, then writes a folder. Text is escaped: pass it as it should be read.
///
/// The page loads nothing: its content security policy admits only its own styles and scripts, by their hashes. The
/// output depends on the input and on gnuplot, not on the folder or the machine.
class Report {
 public:
  explicit Report(std::string title);

  /// Embeds the JSON result in the page.
  void result(const nlohmann::ordered_json& result);
  void result(const files::Node& result);

  /// Sets the command that made the report, as a shell line shown on the page.
  void made_by(const std::string& command);

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// Equations and commands: in a typeface of fixed width, in lines as given.
  void literal(const std::string& text);
  /// Names with what is to be said of each.
  void facts(const std::vector<std::pair<std::string, std::string>>& facts);
  /// @param rows cells as text, as many per row as `header` has.
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);
  /// A table of a described result.
  void table(const Table& table) { this->table(table.header, table.rows); }
  /// @param name   file name without ending: NAME.dat and NAME.gp are written, NAME.svg is drawn.
  /// @param data   data read by the script; user-supplied names belong here, as plot_field(), never in the script.
  /// @param script gnuplot commands that read 'NAME.dat'. Terminal, key, grid, line types and the palette viridis are
  ///               set before it; `set palette @signed_colours` selects a palette for signed values. The script runs
  ///               a second time for narrow screens, with the variable `narrow` defined.
  /// @param caption describes what the plot shows; it is also the text alternative of the image.
  /// @param height height of the drawing, whose width is 800
  void figure(const std::string& name, const std::string& data, const std::string& script,
              const std::string& caption, int height = 420);

  /// Horizontal bars with intervals, the first on top.
  /// @param quantity axis label with its unit in brackets
  void bars(const std::string& name, const std::vector<Bar>& bars, const std::string& quantity,
            const std::string& caption);

  /// Adds signals over time and the vehicles in space, each under a heading; at most once per report. What the tool was
  /// built without (dygraphs, three.js) is said instead.
  void flown(const Flown& flown, const std::string& over_time, const std::string& in_space);

  /// Adds a table of moments; a button in each row moves the figures of flown() to that moment, if there are any.
  void moments(const std::vector<ShownMoment>& moments);

  /// Writes FOLDER/`page` and the files of the figures, and returns the path of the page. If gnuplot is missing or
  /// fails, the report says so in place of the figure; the data files are kept.
  /// @throws files::InputError if the folder exists, is not empty, and `overwrite` is false.
  std::string write(const std::string& folder, bool overwrite, const std::string& page = "report.html") const;

 private:
  struct Figure {
    std::string name, data, script, caption;
    int height;
  };
  std::string drawn(const Figure& figure, const std::string& folder) const;

  std::string title_;
  std::string result_json_, command_;
  bool has_time_series_ = false, has_replay_ = false;
  int tables_ = 0;                 ///< number of tables so far: landmarks of a page need different names
  std::vector<std::string> body_;  ///< HTML; an empty string marks the position of the next figure
  std::vector<Figure> figures_;
};

}  // namespace swarmcert::analysis
