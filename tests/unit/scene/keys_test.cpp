#include "scene/keys.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "core/error.hpp"
#include "scene/view.hpp"

namespace talus::scene {
namespace {

TEST(Keys, EachOnceAndWithItsTable) {
  std::set<std::string> seen;
  for (const Key& key : keys()) {
    EXPECT_TRUE(seen.insert(key.path).second) << key.path;
    EXPECT_FALSE(key.doc.empty()) << key.path;
    const auto dot = key.path.rfind('.');
    if (dot != std::string::npos) {
      EXPECT_TRUE(seen.count(key.path.substr(0, dot))) << key.path << " stands before its table";
    }
  }
}

// A default that is out of its own range, or that does not parse, would be documented and never used.
TEST(Keys, DefaultsPassTheirOwnChecks) {
  for (const Key& key : keys()) {
    if (key.fallback.empty()) continue;
    Node root;
    root.kind = Node::Kind::table;
    const Node value =
        parse_toml_value(key.type == Type::quantity ? '"' + key.fallback + '"' : key.fallback, "default");
    // The value alone, at its place: only what validate() says about this very key counts.
    Node* at = &root;
    std::istringstream parts(key.path);
    std::string part;
    std::vector<std::string> names;
    while (std::getline(parts, part, '.')) names.push_back(part);
    std::string path;
    for (std::size_t i = 0; i < names.size(); ++i) {
      path += (i ? "." : "") + names[i];
      Node node;
      const Key* table = find_key(path);
      ASSERT_NE(table, nullptr) << path;
      if (i + 1 == names.size())
        node = value;
      else
        node.kind = Node::Kind::table;
      if (i + 1 < names.size() && (table->type == Type::tables || table->type == Type::path_or_tables ||
                                   table->type == Type::supports)) {
        Node list;
        list.kind = Node::Kind::array;
        list.items.push_back(node);
        at->entries.push_back({names[i], {}, list});
        at = &at->entries.back().value.items.back();
      } else {
        at->entries.push_back({names[i], {}, node});
        at = &at->entries.back().value;
      }
    }
    std::vector<Problem> problems;
    validate(root, problems);
    const std::string last = "." + names.back();
    for (const Problem& p : problems)
      EXPECT_FALSE(p.rule.find("is missing") == std::string::npos) << key.path << ": " << p.str();
  }
}

TEST(Keys, ExplainTellsTypeUnitDefaultRangeSource) {
  const std::string spacing = explain("rock_mass.joint_set.spacing");
  EXPECT_NE(spacing.find("a length in m"), std::string::npos) << spacing;
  EXPECT_NE(spacing.find("> 0 m"), std::string::npos) << spacing;
  const std::string accuracy = explain("simulation.accuracy");
  EXPECT_NE(accuracy.find("1e-3"), std::string::npos) << accuracy;
  EXPECT_NE(explain("interface.normal_stiffness").find("\"hard\", N/m"), std::string::npos);
  EXPECT_EQ(explain("interface.shear_stiffness").find("hard"), std::string::npos)
      << explain("interface.shear_stiffness");  // which is refused
  EXPECT_NE(explain("material.f_cm").find("Model Code 2010"), std::string::npos);
  EXPECT_NE(explain("block.B1.size").find("block.size"), std::string::npos);  // a user's own name in between
  EXPECT_NE(explain("[[block]]").find("Keys:"), std::string::npos);
  EXPECT_NE(explain("block.B1").find("Keys:"), std::string::npos);
  EXPECT_THROW(explain("block.siz"), InputError);
  // Every measure of a viaduct says what holds without it.
  for (const Key& key : keys())
    if (key.doc.starts_with("Viaduct: ") && key.type == Type::quantity) {
      EXPECT_FALSE(key.otherwise.empty()) << key.path;
    }
  EXPECT_NE(explain("structure.cap_width").find("pier_width + 0.5 m"), std::string::npos);
  EXPECT_NE(explain("structure.P2.probe.top.at").find("structure.probe.at"), std::string::npos);
  try {
    explain("simulaton.step");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("did you mean \"simulation.step\"?"), std::string::npos) << e.what();
  }
  try {
    explain("persistence");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("rock_mass.joint_set.persistence"), std::string::npos) << e.what();
  }
}

// docs/scene.md is generated; `make reference` writes it again.
TEST(Keys, TheReferenceIsUpToDate) {
  std::ifstream file(std::string(TALUS_SOURCE_DIR) + "/docs/scene.md");
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_TRUE(text.str() == scene_markdown()) << "docs/scene.md is out of date: run make reference";
}

}  // namespace
}  // namespace talus::scene
