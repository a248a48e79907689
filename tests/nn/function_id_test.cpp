#include "nn/weights/function_id.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <stdexcept>

#include "nn/random_network.h"
#include "nn/weights/functions.h"

namespace swarmcert::files {
namespace {

TEST(FunctionId, EveryNameThatItAcceptsIsItsNameAgain) {
  for (const char* const name :
       {"network", "phi:small", "rho:large", "set:small:large", "phi:ground", "phi:"}) {
    const FunctionId function = name;
    EXPECT_EQ(function.name(), name);
    EXPECT_EQ(FunctionId::parse(name), function);
  }
}

TEST(FunctionId, RefusesWhatNamesNoFunction) {
  for (const char* const name : {"", "phi", "set", "Network", "networks", "psi:small", "phi:small:large",
                                 "rho:a:b", "set:small", "set:a:b:c", "phi;small"}) {
    EXPECT_FALSE(FunctionId::parse(name)) << name;
    EXPECT_THROW(FunctionId{name}, std::invalid_argument) << name;
  }
  EXPECT_THROW(FunctionId::phi("a:b"), std::invalid_argument);
  EXPECT_THROW(FunctionId::set("a", "b:c"), std::invalid_argument);
}

TEST(FunctionId, HasExactlyOneForm) {
  for (const char* const name : {"network", "phi:a", "rho:a", "set:a:b"}) {
    const FunctionId f = name;
    EXPECT_EQ(f.is_plain() + f.is_phi() + f.is_rho() + f.is_set(), 1) << name;
    EXPECT_EQ(f.is_whole(), f.is_plain() || f.is_set()) << name;
  }
  EXPECT_TRUE(FunctionId().is_plain());
  EXPECT_TRUE(FunctionId::ground_phi().is_ground_phi());
  EXPECT_FALSE(FunctionId::rho("ground").is_ground_phi());
}

TEST(FunctionId, ASetFunctionIsComposedOfItsPhiAndItsRho) {
  const FunctionId set = FunctionId::set("small", "large");
  EXPECT_EQ(set.input_part(), FunctionId::phi(set.phi_kind()));
  EXPECT_EQ(set.output_part(), FunctionId::rho(set.rho_kind()));
  EXPECT_EQ(set.parts(), (std::vector<FunctionId>{"phi:small", "rho:large"}));
  for (const FunctionId& part : {FunctionId(), FunctionId::phi("a"), FunctionId::rho("a")})
    EXPECT_EQ(part.parts(), std::vector<FunctionId>{part});
}

TEST(FunctionId, IsOrderedAsItsName) {
  const std::vector<std::string> names = {"set:a:b", "network", "rho:b", "phi:b", "phi:a", "set:a:a"};
  std::set<std::string> by_name(names.begin(), names.end());
  std::set<FunctionId> by_id(names.begin(), names.end());
  ASSERT_EQ(by_id.size(), by_name.size());
  auto name = by_name.begin();
  for (const FunctionId& id : by_id) EXPECT_EQ(id.name(), *name++);
}

}  // namespace
}  // namespace swarmcert::files
