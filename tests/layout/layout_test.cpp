// The layout of the source tree: allowed includes between folders, and a README in each folder.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "stability/effects/registry.h"

namespace swarmcert {
namespace {

namespace fs = std::filesystem;

/// A library, or several folders that form one, and what they may include besides themselves. A folder that is not
/// listed belongs to its nearest listed parent.
struct Layer {
  std::string folder;
  std::vector<std::string> may_include;
};

const std::vector<Layer>& layers() {
  static const std::vector<Layer> all = {
      // From the bottom up. A layer may include only layers above it in this list; the first test checks that.
      {"nn", {}},
      {"nn/base", {}},
      {"nn/weights", {"nn", "nn/base"}},
      {"nn/networks", {"nn/base", "nn/weights"}},
      {"nn/training", {"nn/base", "nn/weights"}},
      {"controller", {"nn"}},
      {"controller/rounding", {"controller"}},
      {"controller/crazyflie", {"controller"}},
      {"lipschitz/checker", {"nn/base", "nn/weights"}},
      {"lipschitz/base", {"lipschitz/checker", "nn/base", "nn/weights"}},
      {"lipschitz/solver", {"lipschitz/base", "lipschitz/checker", "nn/base"}},
      {"lipschitz/upper",
       {"lipschitz/base", "lipschitz/checker", "lipschitz/solver", "nn/base", "nn/weights"}},
      {"lipschitz/values",
       {"lipschitz/base", "lipschitz/checker", "lipschitz/solver", "lipschitz/upper", "nn", "nn/base",
        "nn/weights"}},
      {"lipschitz/branch",
       {"lipschitz/base", "lipschitz/checker", "lipschitz/solver", "lipschitz/upper", "lipschitz/values",
        "nn/base", "nn/weights"}},
      {"lipschitz/lower",
       {"lipschitz/base", "lipschitz/checker", "lipschitz/solver", "lipschitz/values", "nn/base",
        "nn/weights"}},
      {"lipschitz",
       {"lipschitz/base", "lipschitz/branch", "lipschitz/checker", "lipschitz/lower", "lipschitz/upper",
        "lipschitz/values", "nn/base", "nn/weights"}},
      {"stability/checker", {"nn/base"}},
      {"stability", {"controller", "nn", "nn/base", "nn/weights"}},  // with bodies and effects
      {"stability/bounds/loops", {"nn/base", "stability"}},
      {"stability/bounds/enclosures", {"nn/base", "stability/bounds/loops"}},
      {"stability/reach", {"nn/base", "nn/weights", "stability/bounds/enclosures"}},
      {"stability/bounds/uncertain", {"nn/base", "stability/bounds/loops"}},
      {"stability/bounds",
       {"controller", "nn/base", "stability", "stability/bounds/loops", "stability/bounds/enclosures",
        "stability/bounds/uncertain"}},
      {"stability/bounds/swarms", {"nn/base", "stability/bounds", "stability/bounds/loops"}},
      {"stability/tasks", {"nn/base"}},
      {"stability/simulation",
       {"controller", "controller/rounding", "nn/base", "nn/weights", "stability", "stability/bounds",
        "stability/tasks"}},
      {"stability/iss", {"nn/base", "stability", "stability/bounds", "stability/simulation"}},
      {"stability/sweep", {"nn/base", "stability", "stability/bounds", "stability/bounds/loops"}},
      {"analysis/report", {"nn/base"}},
      {"analysis/cli", {"analysis/report", "nn/base", "nn/weights"}},
      {"analysis/logs", {"nn/base"}},
      {"analysis/residuals",
       {"analysis/logs", "nn/base", "nn/weights", "stability", "stability/simulation", "stability/tasks"}},
      {"analysis/identification/thrust", {"controller", "nn/base"}},
      {"analysis/identification", {"analysis/logs", "analysis/residuals", "nn/base", "stability"}},
      {"analysis/firmware", {"controller/crazyflie", "nn", "nn/base", "nn/weights"}},
      {"analysis/tracking/tube",
       {"lipschitz/base", "lipschitz/values", "nn/base", "nn/weights", "stability", "stability/bounds",
        "stability/bounds/enclosures", "stability/bounds/loops", "stability/tasks"}},
      {"analysis/tracking",
       {"analysis/residuals", "analysis/tracking/tube", "nn/base", "stability/bounds",
        "stability/bounds/uncertain"}},
      {"analysis/learning",
       {"analysis/residuals", "lipschitz", "lipschitz/checker", "lipschitz/upper", "nn/base", "nn/training",
        "nn/weights"}},
      {"analysis/reproduction",
       {"analysis/identification", "analysis/learning", "analysis/logs", "analysis/residuals",
        "analysis/report", "analysis/tracking", "nn/base", "nn/weights", "stability", "stability/bounds",
        "stability/bounds/loops", "stability/simulation", "stability/tasks"}},
      {"analysis/gate",
       {"analysis/firmware", "analysis/residuals", "analysis/tracking", "lipschitz", "lipschitz/base",
        "lipschitz/checker", "lipschitz/upper", "lipschitz/values", "nn/base", "nn/weights", "stability",
        "stability/bounds", "stability/bounds/swarms", "stability/bounds/uncertain", "stability/simulation"}},
      {"analysis/commands",
       {"analysis/cli",
        "analysis/firmware",
        "analysis/gate",
        "analysis/identification",
        "analysis/identification/thrust",
        "analysis/learning",
        "analysis/logs",
        "analysis/report",
        "analysis/reproduction",
        "analysis/residuals",
        "analysis/tracking",
        "analysis/tracking/tube",
        "controller",
        "lipschitz",
        "lipschitz/base",
        "lipschitz/checker",
        "lipschitz/upper",
        "lipschitz/values",
        "nn/base",
        "nn/weights",
        "stability",
        "stability/bounds",
        "stability/bounds/enclosures",
        "stability/bounds/loops",
        "stability/bounds/swarms",
        "stability/bounds/uncertain",
        "stability/checker",
        "stability/iss",
        "stability/simulation",
        "stability/sweep"}},
      {"analysis/python",
       {"analysis/cli", "analysis/commands", "analysis/logs", "analysis/residuals", "nn/base", "nn/weights"}},
      {"analysis", {"analysis/cli", "analysis/commands", "nn/base"}},
  };
  return all;
}

/// Returns the layer of a folder: the longest listed path that contains it; "" if there is none.
std::string layer_of(const std::string& folder) {
  std::string found;
  for (const Layer& layer : layers()) {
    const bool inside = folder == layer.folder || folder.rfind(layer.folder + "/", 0) == 0;
    if (inside && layer.folder.size() > found.size()) found = layer.folder;
  }
  return found;
}

/// Returns the sorted paths, relative to the source tree, of the files in these folders with one of these extensions.
std::vector<std::string> files_in(const std::vector<std::string>& folders,
                                  const std::set<std::string>& endings) {
  std::vector<std::string> found;
  for (const std::string& top : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(SWARMCERT_SOURCE_DIR) / top)) {
      if (entry.is_regular_file() && endings.count(entry.path().extension().string()) > 0)
        found.push_back(fs::relative(entry.path(), SWARMCERT_SOURCE_DIR).generic_string());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<std::string> product_sources() {
  return files_in({"nn", "controller", "lipschitz", "stability", "analysis"}, {".h", ".cpp", ".inc"});
}

/// Returns what `source` includes with quotation marks, as paths from the source tree.
std::vector<std::string> includes(const std::string& source) {
  std::ifstream in(fs::path(SWARMCERT_SOURCE_DIR) / source);
  std::vector<std::string> found;
  const std::string start = "#include \"";
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(start, 0) != 0) continue;
    const std::string path = line.substr(start.size(), line.find('"', start.size()) - start.size());
    if (path.find('/') != std::string::npos) found.push_back(path);
  }
  return found;
}

TEST(Layout, TheListedLayersFormNoCycle) {
  std::set<std::string> below;
  for (const Layer& layer : layers()) {
    for (const std::string& folder : layer.may_include)
      EXPECT_EQ(below.count(folder), 1U) << layer.folder << " is listed below " << folder;
    below.insert(layer.folder);
  }
}

TEST(Layout, IncludesPointToTheListedLowerLayersAndToEachOfThem) {
  std::map<std::string, std::set<std::string>> allowed;
  for (const Layer& layer : layers())
    allowed[layer.folder] = {layer.may_include.begin(), layer.may_include.end()};
  std::map<std::string, std::set<std::string>> used;
  for (const std::string& source : product_sources()) {
    const std::string from = layer_of(fs::path(source).parent_path().generic_string());
    ASSERT_NE(from, "") << source << " lies in a folder that no layer covers";
    for (const std::string& path : includes(source)) {
      if (!fs::exists(fs::path(SWARMCERT_SOURCE_DIR) / path)) continue;  // generated
      const std::string to = layer_of(fs::path(path).parent_path().generic_string());
      EXPECT_TRUE(from == to || allowed[from].count(to) == 1) << source << " includes " << path;
      if (from != to) used[from].insert(to);
    }
  }
  for (const auto& [from, folders] : allowed) EXPECT_EQ(folders, used[from]) << from << " may include less";
}

TEST(Layout, ACommandIncludesNoOtherCommandButThoseListed) {
  const std::set<std::pair<std::string, std::string>> listed = {
      {"demo", "certify"},   {"demo", "study"},    {"spacing", "bound"},  {"tune", "bound"},
      {"study", "add"},      {"study", "compare"}, {"study", "diagnose"}, {"add", "explain"},
      {"explain", "schema"}, {"schema", "bound"}};
  const std::string root = "analysis/commands/";
  const auto command = [&root](const std::string& path) {
    const std::string rest = path.rfind(root, 0) == 0 ? path.substr(root.size()) : "";
    return rest.find('/') == std::string::npos ? "" : rest.substr(0, rest.find('/'));
  };
  for (const std::string& source : product_sources()) {
    const std::string from = command(source);
    if (from.empty()) continue;
    for (const std::string& path : includes(source)) {
      const std::string to = command(path);
      EXPECT_TRUE(to.empty() || to == from || to == "shared" || listed.count({from, to}) == 1)
          << source << " includes " << path;
      EXPECT_FALSE(from == "shared" && !to.empty() && to != from) << source << " includes " << path;
    }
  }
}

/// Returns the headers installed by CMake, as paths from the source tree.
std::set<std::string> installed_headers() {
  std::set<std::string> found;
  for (const char* top : {"nn", "controller", "lipschitz", "stability"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(SWARMCERT_SOURCE_DIR) / top)) {
      if (entry.path().filename() != "CMakeLists.txt") continue;
      const fs::path folder = fs::relative(entry.path().parent_path(), SWARMCERT_SOURCE_DIR);
      std::ifstream in(entry.path());
      bool is_list = false;
      for (std::string word; in >> word;) {
        if (word.rfind("swarmcert_install(", 0) == 0) is_list = true;
        const std::string name = word.substr(0, word.find(')'));
        if (is_list && fs::path(name).extension() == ".h")
          found.insert((folder / name).lexically_normal().generic_string());
        if (word.find(')') != std::string::npos) is_list = false;
      }
    }
  }
  return found;
}

TEST(Layout, InstalledHeadersAreForUsersAndIncludeOnlySuch) {
  const std::set<std::string> installed = installed_headers();
  EXPECT_GT(installed.size(), 100U);
  for (const std::string& header : installed) {
    std::ifstream in(fs::path(SWARMCERT_SOURCE_DIR) / header);
    ASSERT_TRUE(in) << header;
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    EXPECT_EQ(text.find("Not for users."), std::string::npos) << header << " is internal, but installed";
    for (const std::string& path : includes(header)) {
      const bool is_ours = fs::exists(fs::path(SWARMCERT_SOURCE_DIR) / path);
      EXPECT_TRUE(!is_ours || installed.count(path) == 1) << header << " includes " << path;
    }
  }
}

TEST(Layout, EveryInstalledHeaderIsIncludedByATest) {
  std::set<std::string> included;
  for (const std::string& source : files_in({"tests"}, {".h", ".cpp"}))
    for (const std::string& path : includes(source)) included.insert(path);
  for (const std::string& header : installed_headers())
    EXPECT_EQ(included.count(header), 1U) << header << ": users have it, and no test uses it directly";
}

/// Returns the sources of each library, as paths from the source tree.
std::map<std::string, std::vector<std::string>> library_sources() {
  std::map<std::string, std::vector<std::string>> found;
  for (const std::string& list : files_in({"nn", "lipschitz", "stability", "analysis"}, {".txt"})) {
    std::ifstream in(fs::path(SWARMCERT_SOURCE_DIR) / list);
    const std::string start = "add_library(";
    std::string library;
    for (std::string word; in >> word;) {
      if (word.rfind(start, 0) == 0) library = word.substr(start.size());
      const std::string name = word.substr(0, word.find(')'));
      if (!library.empty() && fs::path(name).extension() == ".cpp")
        found[library].push_back((fs::path(list).parent_path() / name).generic_string());
      if (word.find(')') != std::string::npos) library.clear();
    }
  }
  return found;
}

/// Returns constants and types that a source defines in its unnamed namespaces.
std::vector<std::string> unnamed_names(const std::string& source) {
  std::ifstream in(fs::path(SWARMCERT_SOURCE_DIR) / source);
  std::vector<std::string> found;
  bool is_unnamed = false;
  for (std::string line; std::getline(in, line);) {
    if (line == "namespace {") is_unnamed = true;
    if (line == "}  // namespace") is_unnamed = false;
    if (!is_unnamed || line.empty()) continue;
    for (const std::string word : {"constexpr ", "struct ", "class ", "enum class "}) {
      if (line.rfind(word, 0) != 0) continue;
      const bool is_constant = word == "constexpr ";
      if (is_constant && line.find('(') < line.find('=')) continue;  // a function
      std::string declared = line.substr(0, line.find_first_of(is_constant ? "=[{" : ":{;"));
      declared = declared.substr(0, declared.find(" final"));
      while (declared.back() == ' ') declared.pop_back();
      found.push_back(declared.substr(declared.rfind(' ') + 1));
    }
  }
  return found;
}

// Several sources are compiled as one, in units of 10 or 20.
TEST(Layout, ConstantsAndTypesInUnnamedNamespacesHaveNamesOfTheirOwnInALibrary) {
  std::size_t seen = 0;
  for (const auto& [library, sources] : library_sources()) {
    std::map<std::string, std::string> places;
    for (const std::string& source : sources) {
      for (const std::string& name : unnamed_names(source)) {
        const auto [known, is_new] = places.emplace(name, source);
        EXPECT_TRUE(is_new) << library << ": " << name << " in " << known->second << " and " << source;
        ++seen;
      }
    }
  }
  EXPECT_GT(seen, 500U);
}

/// Expects that the README of each folder with one of `sources` is at most a page long and names each of them, without
/// its extension.
/// @return the number of folders
std::size_t expect_readmes_that_name(const std::vector<std::string>& sources) {
  std::map<fs::path, std::string> readmes;
  for (const std::string& source : sources) {
    const fs::path folder = fs::path(SWARMCERT_SOURCE_DIR) / fs::path(source).parent_path();
    if (readmes.count(folder) == 0) {
      std::ifstream in(folder / "README.md");
      EXPECT_TRUE(in) << folder << " has no README.md";
      readmes[folder] = {std::istreambuf_iterator<char>(in), {}};
      const std::string& text = readmes[folder];
      EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 80)
          << folder << ": README.md is longer than a page";
    }
    const std::string stem = fs::path(source).stem().string();
    EXPECT_TRUE(std::regex_search(readmes[folder], std::regex("\\b" + stem + "\\b")))
        << folder << ": README.md does not say what " << stem << " is for";
  }
  return readmes.size();
}

TEST(Layout, EveryFolderOfSourcesHasAReadmeOfAtMostAPageThatNamesEachFile) {
  const std::vector<std::string> sources = product_sources();
  EXPECT_GT(sources.size(), 900U);
  EXPECT_GT(expect_readmes_that_name(sources), 50U);
}

TEST(Layout, EveryFolderOfTestsHasAReadmeOfAtMostAPageThatNamesEachFile) {
  std::vector<std::string> sources;
  for (const std::string& source : files_in({"tests"}, {".h", ".cpp", ".inc", ".py", ".cmake"}))
    if (fs::path(source).filename() != "data.h") sources.push_back(source);
  EXPECT_GT(sources.size(), 300U);
  EXPECT_GT(expect_readmes_that_name(sources), 25U);
}

TEST(Layout, LinesOfSourcesHaveAtMost120Columns) {
  std::vector<std::string> sources =
      files_in({"nn", "controller", "lipschitz", "stability", "analysis", "tests"},
               {".h", ".cpp", ".inc", ".py", ".pyi", ".ml", ".mli", ".v"});
  for (const std::string& guide : files_in({"notebooks_cpp"}, {".py"})) sources.push_back(guide);
  std::map<std::string, std::size_t> lines;
  for (const std::string& source : sources) {
    std::ifstream in(fs::path(SWARMCERT_SOURCE_DIR) / source);
    std::size_t& count = lines[fs::path(source).extension().string()];
    std::string line;
    for (int number = 1; std::getline(in, line); ++number, ++count)
      EXPECT_LE(line.size(), 120U) << source << ":" << number;
  }
  EXPECT_GT(lines[".cpp"], 50'000U);
  for (const char* ending : {".py", ".ml", ".v"}) EXPECT_GT(lines[ending], 1'000U) << ending;
}

// What identification knows of an effect are the traits that it declares.
TEST(Layout, NoStringOfIdentificationNamesAnEffectOfTheLibrary) {
  // A variable of the scan, a signal of the log and a column of a load cell's table have the name of an effect.
  const std::set<std::pair<std::string, std::string>> others = {{"scan/samples.cpp", "battery"},
                                                                {"labels/wrong_kind.cpp", "battery"},
                                                                {"thrust/thrust_data.cpp", "battery"}};
  const std::string root = "analysis/identification/";
  const std::regex literal("\"([^\"]*)\"");
  std::size_t seen = 0;
  for (const std::string& source : files_in({root}, {".h", ".cpp"})) {
    std::ifstream in(fs::path(SWARMCERT_SOURCE_DIR) / source);
    for (std::string line; std::getline(in, line);) {
      line = line.substr(0, line.find("//"));
      for (std::sregex_iterator it(line.begin(), line.end(), literal), end; it != end; ++it, ++seen) {
        const std::string text = (*it)[1], word = text.substr(0, text.find('.'));
        for (const std::string& name : stability::effect_names())
          EXPECT_TRUE(word != name || others.count({source.substr(root.size()), word}) == 1)
              << source << " names the effect " << text;
      }
    }
  }
  EXPECT_GT(seen, 1'000U);
}

}  // namespace
}  // namespace swarmcert
