// Letters beyond ASCII, which the parser knows only in texts and comments.
#include "scene/toml_text.hpp"

#include "fixture.hpp"

namespace talus::scene {
namespace {

TEST(ForeignLetter, IsFoundOutsideQuotesWithItsPlace) {
  const auto degree = foreign_letter("schema = 1\ndip = 28°\n");
  ASSERT_TRUE(degree);
  EXPECT_EQ(degree->letter, "'°'");
  EXPECT_EQ(degree->line, 2);
  EXPECT_EQ(degree->column, 9);
  const auto key = foreign_letter("title = \"Größe\"  # µ\nstärke = 1\n");
  ASSERT_TRUE(key);
  EXPECT_EQ(key->line, 2);
  EXPECT_EQ(key->column, 3);
  EXPECT_TRUE(foreign_letter("a = 1l\":°\"\n")) << "no text begins behind a letter";
  EXPECT_EQ(foreign_letter("a = 1\xa0\n")->letter, "byte 0xa0");
  EXPECT_EQ(foreign_letter("\xff\xfe s")->letter, "byte 0xff");
}

TEST(ForeignLetter, MayStandInTextsAndComments) {
  EXPECT_FALSE(foreign_letter("\xef\xbb\xbfschema = 1  # in m³\n"));
  EXPECT_FALSE(foreign_letter("a = \"28° \\\" °\"\nb = 'C:\\°'\n"));
  EXPECT_FALSE(foreign_letter("a = \"\"\"°\n \" \"\" ° \\\" \"\"\"\nb = '''°'\n'' ° \\'''\n"));
  EXPECT_FALSE(foreign_letter("a = \"\"\"ends in a quote°\"\"\"\"\nb = {c=\"°\",d.\"°\"='°'}\n"));
  EXPECT_FALSE(foreign_letter("a = \"\"\"one \\\n   two °\"\"\"\n"));
  EXPECT_TRUE(foreign_letter("a = \"\"\"one \\\n   ° two\"\"\"\n")) << "behind a line's closing backslash the parser looks for blanks";
  EXPECT_TRUE(foreign_letter("a = \"never closed\n° = 1\n"));
}

TEST(ForeignLetter, IsToldAsAProblemOfTheScene) {
  const Place place;
  try {
    (void)read_scene_text("schema = 1\n[simulation]\nduration = 28°\n", place.scene());
    FAIL() << "taken as it is";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("scene.toml:3:14: error: not TOML: '°' stands outside quotes; put"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace talus::scene
