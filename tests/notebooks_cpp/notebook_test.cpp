#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "notebooks_cpp/cells.h"
#include "notebooks_cpp/document.h"

namespace swarmcert::notebook {
namespace {

using files::Json;

const char* const kGuide =
    "// %% [markdown]\n// # Title\n//\n//     a <= b\n\n// %%\n#include <x>\nint main() {\n  one();\n\n"
    "  // %% [markdown]\n  // More.\n\n  // %%\n  if (two()) {\n    three();\n  }\n}\n";

TEST(Cells, AreCutAtTheirMarks) {
  const std::vector<Cell> cells = parse_cells(kGuide, "guide.cpp");
  ASSERT_EQ(cells.size(), 4u);
  EXPECT_FALSE(cells[0].is_code);
  EXPECT_EQ(cells[0].text, "# Title\n\n    a <= b");
  EXPECT_EQ(cells[1].text, "#include <x>\nint main() {\n  one();");
  EXPECT_EQ(cells[2].text, "More.");
  EXPECT_EQ(cells[3].text, "  if (two()) {\n    three();\n  }\n}")
      << "the closing brace of main has no indent";
}

TEST(Cells, OfAFunctionLoseTheIndentTheyShare) {
  const std::vector<Cell> cells = parse_cells("// %%\n  a();\n\n    b();\n// %%\n}\n", "guide.cpp");
  EXPECT_EQ(cells[0].text, "a();\n\n  b();");
}

TEST(Cells, MarksReplaceLinesAndMoveNone) {
  const std::string marked = with_marks(kGuide, "guide.cpp");
  EXPECT_EQ(marked,
            "// %% [markdown]\n// # Title\n//\n//     a <= b\n\n// %%\n#include <x>\n"
            "int main() { swarmcert::notebook::cell(1);\n  one();\n\n"
            "  // %% [markdown]\n  // More.\n\nswarmcert::notebook::cell(3);\n  if (two()) {\n    three();\n "
            " }\n}\n");
}

TEST(Cells, RefuseTextThatBelongsNowhere) {
  EXPECT_THROW(parse_cells("int a;\n// %%\n", "guide.cpp"), files::InputError);
  EXPECT_THROW(parse_cells("// %% [markdown]\n// text\nint a;\n", "guide.cpp"), files::InputError);
  EXPECT_THROW(with_marks("// %%\nint a;\n", "guide.cpp"), files::InputError);
}

std::vector<RunCell> run_guide() {
  Output text, plot;
  text.text = "x = 1 & <2>\nlast";
  plot.text = "plot it";
  plot.data = "0 1\n1 2\n";
  plot.svg = "<svg></svg>";
  plot.png = "\x89PNG";
  return {{{false, "# Title"}, {}}, {{true, "int a;"}, {text, plot}}};
}

TEST(Notebook, HasTextAndPlotInTheFormOfTheStandard) {
  const Json notebook = to_ipynb(run_guide());
  EXPECT_EQ(notebook["nbformat"], 4);
  EXPECT_EQ(notebook["nbformat_minor"], 5);
  const Json& outputs = notebook["cells"][1]["outputs"];
  EXPECT_EQ(outputs[0]["text"], Json({"x = 1 & <2>\n", "last"}));
  EXPECT_EQ(outputs[1]["data"]["image/svg+xml"], Json({"<svg></svg>"}));
  EXPECT_EQ(outputs[1]["data"]["image/png"], "iVBORw==");
}

TEST(Notebook, ComparisonSeesNumbersAndPlotsAndForgivesImageBytes) {
  const Json committed = to_ipynb(run_guide());
  std::vector<RunCell> other = run_guide();
  other[1].outputs[1].svg = "<svg><!-- another gnuplot --></svg>";
  EXPECT_EQ(first_difference(committed, to_ipynb(other)), "");
  other[1].outputs[1].data = "0 1\n1 3\n";
  EXPECT_NE(first_difference(committed, to_ipynb(other)), "") << "plotted data";
  other = run_guide();
  other[1].outputs[0].text = "x = 2";
  EXPECT_NE(first_difference(committed, to_ipynb(other)), "") << "printed text";
  other = run_guide();
  other[1].outputs[1].png.clear();
  EXPECT_NE(first_difference(committed, to_ipynb(other)), "") << "a missing image";
  other = run_guide();
  other[1].text = "int b;";
  EXPECT_NE(first_difference(committed, to_ipynb(other)), "") << "code";
}

TEST(Notebook, EveryCommittedOneHasTheFieldsOfItsFormat) {
  int notebooks = 0, plots = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SWARMCERT_SOURCE_DIR "/notebooks_cpp")) {
    if (entry.path().extension() != ".ipynb") continue;
    SCOPED_TRACE(entry.path().string());
    ++notebooks;
    const Json notebook = files::parse_json(files::read_file(entry.path().string()), entry.path().string());
    ASSERT_EQ(notebook["nbformat"], 4);
    ASSERT_EQ(notebook["nbformat_minor"], 5);
    ASSERT_TRUE(notebook["metadata"].is_object());
    std::set<std::string> ids;
    for (const Json& cell : notebook["cells"]) {
      EXPECT_TRUE(ids.insert(cell["id"].get<std::string>()).second) << cell["id"];
      EXPECT_TRUE(cell["metadata"].is_object() && cell["source"].is_array());
      if (cell["cell_type"] == "markdown") continue;
      ASSERT_EQ(cell["cell_type"], "code");
      EXPECT_TRUE(cell["execution_count"].is_number_integer());
      for (const Json& output : cell["outputs"]) {
        if (output["output_type"] == "stream") continue;
        ++plots;
        // The guides in C++ use the library's own display, which stores a text beside the figure.
        const bool is_python = notebook["metadata"]["language_info"]["name"] == "python";
        for (const char* kind : {"image/png", "image/svg+xml", "text/plain"})
          EXPECT_TRUE(output["data"].contains(kind) || (is_python && kind != std::string("image/png")))
              << kind;
      }
    }
  }
  EXPECT_GE(notebooks, 7);
  EXPECT_GE(plots, 7);
}

}  // namespace
}  // namespace swarmcert::notebook
