/// @file The result of an experiment: numbers as JSON, tables and figures for readers.
#pragma once

#include <string>
#include <vector>

#include "nn/base/json.h"

namespace swarmcert::reproduction {

struct Table {
  std::string title;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
};

struct Figure {
  std::string name, data;  ///< NAME.dat
  std::string script;      ///< gnuplot, reads 'NAME.dat'
  std::string caption;
};

struct Finding {
  files::Json json;                 ///< fields of the result, without its head
  std::vector<std::string> inputs;  ///< recorded files on which it depends
  std::vector<std::string> notes;
  std::vector<Table> tables;
  std::vector<Figure> figures;
};

}  // namespace swarmcert::reproduction
