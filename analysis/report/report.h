/// @file Reports: one self-contained HTML file, with plots drawn by gnuplot from data files stored next to it.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "analysis/report/table.h"

namespace swarmcert::analysis {

/// Force residuals of one vehicle over time.
struct TimeSeries {
  std::string name;
  /// Time in s; x, y, z; z without effects; z of another model, NaN if there is none. NaN interrupts the curves.
  std::vector<std::array<float, 6>> rows;
  struct Mark {
    float time_s;  ///< of a row
    int rank;
    double size;  ///< in the unit of the rows
  };
  std::vector<Mark> marks;
};

/// A flight for the 3D replay.
struct Replay {
  std::string name;
  struct Vehicle {
    std::string name;
    /// Time in s; position in m; force before; force after. NaN: unknown.
    std::vector<std::array<float, 10>> rows;
  };
  std::vector<Vehicle> vehicles;
};

/// A moment that the time series and the replay can jump to.
struct ShownMoment {
  std::string series;  ///< name of a TimeSeries
  double series_time_s;
  std::string flight;  ///< name of a Replay
  double flight_time_s;
  std::string size;  ///< text with its unit
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

  /// Adds curves with zoom, one vehicle at a time; at most once per report. If the tool was built without dygraphs,
  /// the report says so.
  /// @param unit unit of the forces
  void time_series(const std::vector<TimeSeries>& all, const std::string& unit, const std::string& caption);

  /// Adds flights in space with a time slider; at most once per report. If the tool was built without three.js, the
  /// report says so.
  /// @param unit unit of the forces
  void replay(const std::vector<Replay>& flights, const std::string& unit, const std::string& caption);

  /// Adds a table of moments; a button in each row moves the time series and the replay to that moment.
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
