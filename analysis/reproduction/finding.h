/// @file The result of an experiment: described numbers, and the tables and figures that show them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "analysis/report/table.h"
#include "nn/base/record.h"

namespace swarmcert::reproduction {

struct Table {
  std::string title;
  analysis::Table cells;
};

struct Figure {
  std::string name, data;  ///< NAME.dat
  std::string script;      ///< gnuplot, reads 'NAME.dat'
  std::string caption;
};

struct Finding {
  files::Node fields;               ///< of the result, without its head
  std::vector<std::string> inputs;  ///< recorded files on which it depends
  std::vector<std::string> notes;
  std::vector<Table> tables;
  std::vector<Figure> figures;

  /// Adds a table unless it is empty.
  void add(std::string title, analysis::Table cells) {
    if (!cells.rows.empty()) tables.push_back({std::move(title), std::move(cells)});
  }
  /// Likewise, of the list with this name.
  void show(std::string title, const char* list, const std::vector<analysis::Column>& columns) {
    const files::Node* const rows = fields.find(list);
    if (rows != nullptr) add(std::move(title), analysis::table(*rows, columns));
  }
};

}  // namespace swarmcert::reproduction
