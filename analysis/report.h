/// @file Reports: one HTML file that needs nothing else, with plots drawn by gnuplot from data files kept beside it.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace swarmcert::analysis {

/// Force residuals of one vehicle over time.
struct TimeSeries {
  std::string name;
  std::vector<std::array<float, 5>> rows;  ///< time in s, x, y, z, z without effects; NaN breaks the curves
  struct Mark {
    float time_s;  ///< of a row
    int rank;
    double size_gf;
  };
  std::vector<Mark> marks;
};

/// Collects text, tables and figures, then writes a folder. Text is escaped: pass it as people should read it.
class Report {
 public:
  explicit Report(std::string title);

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// @param rows cells as text, as many per row as `header` has.
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);
  /// @param name   file name without ending: NAME.dat and NAME.gp are written, NAME.svg is drawn.
  /// @param data   what the script plots; names that come from users belong here, never in the script.
  /// @param script gnuplot commands that read 'NAME.dat'; terminal and output are set before it.
  void figure(const std::string& name, const std::string& data, const std::string& script,
              const std::string& caption);

  /// Curves with zoom, one vehicle at a time; at most once per report. Where the tool was built without dygraphs, the
  /// report says so.
  void time_series(const std::vector<TimeSeries>& all, const std::string& caption);

  /// Writes FOLDER/report.html and the figures' files; returns the path of report.html. Without gnuplot, or where it
  /// fails, the report says so in the figure's place and the data stay.
  /// @throws files::InputError if the folder exists, is not empty, and `overwrite` is false.
  std::string write(const std::string& folder, bool overwrite) const;

 private:
  struct Figure {
    std::string name, data, script, caption;
  };
  std::string title_;
  bool has_script_ = false;
  std::vector<std::string> body_;  ///< HTML; "" where the next figure goes
  std::vector<Figure> figures_;
};

}  // namespace swarmcert::analysis
