#include "call_graph.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace swarmcert::facts {
namespace {

// The format of -fcallgraph-info=su in arm-none-eabi-g++ 12.2.
constexpr char kGraph[] = R"graph(graph: { title: "x.cpp"
node: { title: "entry" label: "void entry()\nx.cpp:1:1\n24 bytes (static)" }
node: { title: "x.cpp:_Z1a" label: "int a()\nx.cpp:2:2\n100 bytes (static)" }
node: { title: "_Z1b" label: "int b()\nx.cpp:3:3\n8 bytes (static)" }
node: { title: "memset" label: "memset\n<built-in>" shape : ellipse }
edge: { sourcename: "entry" targetname: "x.cpp:_Z1a" label: "x.cpp:1:5" }
edge: { sourcename: "entry" targetname: "_Z1b" }
edge: { sourcename: "_Z1b" targetname: "memset" }
}
)graph";

TEST(CallGraph, AddsTheFramesOfTheWorstChain) {
  CallGraph graph;
  graph.add(kGraph);
  const StackUse use = graph.worst("entry");
  EXPECT_EQ(use.bytes, 24 + 100);
  EXPECT_EQ(use.path, (std::vector<std::string>{"void entry()", "int a()"}));
  EXPECT_EQ(use.outside, (std::set<std::string>{"memset"}));
  EXPECT_EQ(graph.worst("_Z1b").bytes, 8 + kOutside_bytes);
  EXPECT_EQ(graph.largest_frame(), 100);
}

TEST(CallGraph, TakesADefinitionFromAnotherFile) {
  CallGraph graph;
  graph.add(kGraph);
  graph.add("node: { title: \"memset\" label: \"memset\\ny.c:1:1\\n500 bytes (static)\" }\n");
  EXPECT_EQ(graph.worst("entry").bytes, 24 + 8 + 500);
}

TEST(CallGraph, RefusesWhatHasNoBound) {
  CallGraph recursive;
  recursive.add(kGraph);
  recursive.add("edge: { sourcename: \"x.cpp:_Z1a\" targetname: \"entry\" }\n");
  EXPECT_THROW(recursive.worst("entry"), std::runtime_error);
  CallGraph indirect;
  indirect.add(kGraph);
  indirect.add("edge: { sourcename: \"_Z1b\" targetname: \"__indirect_call\" }\n");
  EXPECT_THROW(indirect.worst("entry"), std::runtime_error);
  CallGraph dynamic;
  EXPECT_THROW(dynamic.add("node: { title: \"f\" label: \"f\\nx.c:1:1\\n16 bytes (dynamic)\" }\n"),
               std::runtime_error);
  EXPECT_THROW(dynamic.worst("nothing"), std::runtime_error);
}

}  // namespace
}  // namespace swarmcert::facts
