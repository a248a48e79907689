/// @file Reports: one HTML file that needs nothing else, with plots drawn by gnuplot from data files kept beside it.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace swarmcert::analysis {

/// Force residuals of one vehicle over time.
struct TimeSeries {
  std::string name;
  /// Time in s; x, y, z; z without effects; z of another model, NaN without one. NaN breaks the curves.
  std::vector<std::array<float, 6>> rows;
  struct Mark {
    float time_s;  ///< of a row
    int rank;
    double size;  ///< in the unit of the rows
  };
  std::vector<Mark> marks;
};

/// A flight in space.
struct Replay {
  std::string name;
  struct Vehicle {
    std::string name;
    /// Time in s; place in m; force before; force after. NaN: not known.
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
  std::string size;  ///< in words, with its unit
};

/// One bar with its interval; NaN for an end that is not known.
struct Bar {
  std::string name;  ///< may come from users
  double value, lower, upper;
};

/// Collects text, tables and figures, then writes a folder. Text is escaped: pass it as people should read it.
///
/// The page loads nothing: its policy admits its own style and scripts by their hashes. It depends on what it was given
/// and on gnuplot, not on the folder or the machine.
class Report {
 public:
  explicit Report(std::string title);

  /// The result as JSON goes into the page.
  void result(const nlohmann::ordered_json& result);

  /// The command that made it, as a line for a shell; the page shows it.
  void made_by(const std::string& command);

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// @param rows cells as text, as many per row as `header` has.
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);
  /// @param name   file name without ending: NAME.dat and NAME.gp are written, NAME.svg is drawn.
  /// @param data   what the script plots; names that come from users belong here, as plot_field(), never in the script.
  /// @param script gnuplot commands that read 'NAME.dat'; terminal, key, grid, line types and the palette
  ///               viridis are set before it, `set palette @signed_colours` is one for signed values. It runs
  ///               a second time for narrow screens, on which the variable `narrow` exists.
  /// @param caption says in words what the plot shows: it is the plot's text for those who do not see it.
  /// @param height of the drawing of width 800
  void figure(const std::string& name, const std::string& data, const std::string& script,
              const std::string& caption, int height = 420);

  /// Horizontal bars with intervals, the first on top.
  /// @param quantity of the axis, with its unit in brackets
  void bars(const std::string& name, const std::vector<Bar>& bars, const std::string& quantity,
            const std::string& caption);

  /// Curves with zoom, one vehicle at a time; at most once per report. Where the tool was built without dygraphs, the
  /// report says so.
  /// @param unit of the forces
  void time_series(const std::vector<TimeSeries>& all, const std::string& unit, const std::string& caption);

  /// Flights in space with a slider over time; at most once per report. Where the tool was built without three.js, the
  /// report says so.
  /// @param unit of the forces
  void replay(const std::vector<Replay>& flights, const std::string& unit, const std::string& caption);

  /// A table of moments; a button in each row moves the time series and the replay there.
  void moments(const std::vector<ShownMoment>& moments);

  /// Writes FOLDER/`page` and the figures' files; returns the page's path. Without gnuplot, or where it
  /// fails, the report says so in the figure's place and the data stay.
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
  int tables_ = 0;                 ///< so far: landmarks of a page need different names
  std::vector<std::string> body_;  ///< HTML; "" where the next figure goes
  std::vector<Figure> figures_;
};

}  // namespace swarmcert::analysis
