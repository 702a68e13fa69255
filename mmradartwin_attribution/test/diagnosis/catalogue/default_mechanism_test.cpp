#include "diagnosis/catalogue/default_mechanism.h"

#include <gtest/gtest.h>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin::diagnosis {
namespace {

TEST(DefaultMechanism, HasEveryParameterOfEveryMechanismAtItsDefault) {
  const std::vector<std::string> names = MechanismRegistry::instance().names();
  ASSERT_GT(names.size(), 30u);
  for (const std::string& name : names) {
    const NamedParameters mechanism = defaultMechanism(name);
    EXPECT_EQ(mechanism.mechanism, name);
    const auto specs = MechanismRegistry::instance().create(name)->parameters();
    EXPECT_EQ(mechanism.values.all().size(), specs.size()) << name;
    for (const ParameterSpec& spec : specs) {
      ASSERT_TRUE(mechanism.values.has(spec.name)) << name << " " << spec.name;
      EXPECT_TRUE(mechanism.values.all().at(spec.name) == spec.default_value) << name << " " << spec.name;
    }
  }
}

TEST(DefaultMechanism, IsNotMadeOfAnUnknownName) { EXPECT_THROW(defaultMechanism("magic"), InputError); }

}  // namespace
}  // namespace mmradartwin::diagnosis
