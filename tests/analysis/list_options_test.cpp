/// Lists on the command line: which option a word belongs to.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <set>
#include <string>

#include "analysis/commands/commands.h"

namespace swarmcert::analysis {
namespace {

/// Repeated options with one value each. A second word would be NET, or one of the logs after the model of `add`.
const std::set<std::string>& one_value_each() {
  static const std::set<std::string> names = [] {
    std::set<std::string> all = {"add --model", "certify --samples", "gate --order"};
    for (const char* const command : {"inspect", "certify", "check", "bound", "simulate", "export", "match"})
      for (const char* const option : {" --order", " --select"}) all.insert(std::string(command) + option);
    return all;
  }();
  return names;
}

bool is_list(const CLI::Option& option) { return option.get_expected_max() > 1 && !option.get_positional(); }

TEST(ListOptions, TakeEveryWordUpToTheNextOptionInEachCommand) {
  int checked = 0;
  for (const Command& command : commands()) {
    CLI::App declared;
    command.declare(declared);
    for (const CLI::Option* const known : declared.get_options()) {
      if (!is_list(*known)) continue;
      const std::string name = "--" + known->get_lnames().at(0);
      if (one_value_each().count(command.name + " " + name) == 1) continue;
      CLI::App app;
      const auto run = command.declare(app);
      std::vector<std::string> words;
      for (const CLI::Option* const option : app.get_options())
        if (option->get_positional()) words.emplace_back("first.toml");
      words.insert(words.end(), {name, "one.toml", "two.toml"});
      std::reverse(words.begin(), words.end());  // the parser takes them from the back
      try {
        app.parse(std::move(words));
      } catch (const CLI::Error&) {
        // Required options are missing, and values of positionals may be refused.
      }
      EXPECT_EQ(app.get_option(name)->results(), (std::vector<std::string>{"one.toml", "two.toml"}))
          << command.name << " " << name;
      ++checked;
    }
  }
  EXPECT_GE(checked, 8);
}

TEST(ListOptions, TheTestFlightsOfAStudyAreNotFitted) {
  CLI::App app;
  study_command().declare(app);
  try {
    app.parse("model.toml flights/1 flights/2 --select flights/3 --test flights/4 flights/5 -o out");
  } catch (const CLI::Error& error) {
    FAIL() << error.what();
  }
  EXPECT_EQ(app.get_option("--select")->results(), (std::vector<std::string>{"flights/3"}));
  EXPECT_EQ(app.get_option("--test")->results(), (std::vector<std::string>{"flights/4", "flights/5"}));
  EXPECT_EQ(app.get_option("MODEL... FLIGHTS...")->results(),
            (std::vector<std::string>{"model.toml", "flights/1", "flights/2"}));
}

TEST(Help, ListsTheCommandsThatPeopleNeedFirst) {
  ASSERT_GT(commands().size(), static_cast<std::size_t>(kFirstCommands));
  std::set<std::string> first;
  for (int i = 0; i < kFirstCommands; ++i) first.insert(commands()[static_cast<std::size_t>(i)].name);
  for (const char* const name : {"inspect", "certify", "study", "gate"})
    EXPECT_EQ(first.count(name), 1) << name;
}

}  // namespace
}  // namespace swarmcert::analysis
