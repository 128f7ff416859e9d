#include <gtest/gtest.h>

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "core/csv.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "core/names.hpp"
#include "core/sha256.hpp"
#include "core/solid_mesh_parts.hpp"
#include "core/suggest.hpp"
#include "core/table.hpp"
#include "core/text_file.hpp"

namespace talus {
namespace {

TEST(Names, AreShortTextsWithoutSlashesAndControlCharacters) {
  for (const char* good : {"B1", "Pier <A> & \"B\"", "\u00e9", "=1+1", "\U0001F5FF", "..."})
    EXPECT_TRUE(is_name(good)) << good;
  for (const char* bad : {"", ".", "..", "*", "../x", "a\\b", "a\nb", "a\x1b[31m", "a\x7f",
                          "a\xc2\x9b"
                          "31m",
                          "Fels\xe9", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe2\x82"})
    EXPECT_FALSE(is_name(bad)) << printable(bad);
  EXPECT_TRUE(is_name(std::string(100, 'x')));
  EXPECT_FALSE(is_name(std::string(101, 'x')));
}

TEST(Names, OfPiecesAreToldFromOthers) {
  EXPECT_TRUE(is_fragment_name(fragment_name("pier", 12), "pier"));
  for (const char* other :
       {"pier", "pier.fragment", "pier.fragments", "pier.fragment1-1", "pier2.fragment1", "a.pier.fragment1"})
    EXPECT_FALSE(is_fragment_name(other, "pier")) << other;
}

TEST(Names, AreShownWithoutWhatSteersATerminal) {
  EXPECT_EQ(printable("a\x1b[31m\xc2\x9b\u00e9\n"), "a\\x1b[31m\\xc2\\x9b\u00e9\n");
  EXPECT_EQ(printable("Fels\xe9"), "Fels\\xe9");
}

TEST(Text, OtherEncodingsBecomeUtf8) {
  const auto units = [](const std::vector<int>& list, bool little) {
    std::string s;
    for (const int u : list)
      s += little ? std::string({static_cast<char>(u & 255), static_cast<char>(u >> 8)})
                  : std::string({static_cast<char>(u >> 8), static_cast<char>(u & 255)});
    return s;
  };
  const std::vector<int> fels{0xFEFF, 'F', 0xE9, 0x20AC, 0xD83D, 0xDDFF, '\n'};
  for (const bool little : {true, false})
    EXPECT_EQ(as_utf8(units(fels, little), "t"), "F\u00e9\u20ac\U0001F5FF\n") << little;
  EXPECT_EQ(as_utf8("\xEF\xBB\xBF"
                    "a = 1\n",
                    "t"),
            "a = 1\n");
  EXPECT_EQ(as_utf8("a\rb\r", "t"), "a\nb\n");
  EXPECT_EQ(as_utf8("a\r\nb", "t"), "a\r\nb");
  EXPECT_THROW(as_utf8(units({0xFEFF, 0xD83D, 'a'}, true), "t"), InputError);     // half of a pair
  EXPECT_THROW(as_utf8(units({0xFEFF, 'a'}, true) + "b", "t"), InputError);       // cut short
  EXPECT_THROW(as_utf8(std::string("\xFF\xFE\0\0a\0\0\0", 8), "t"), InputError);  // UTF-32
}

TEST(SolidMesh, NodesThatLieOnEachOtherUnmergedAreFound) {
  SolidMesh mesh;
  for (int half = 0; half < 2; ++half)
    for (int k = 0; k < 8; ++k) mesh.nodes.emplace_back(k & 1, (k >> 1) & 1, half + (k >> 2));
  mesh.hexes = {{0, 1, 3, 2, 4, 5, 7, 6}, {8, 9, 11, 10, 12, 13, 15, 14}};
  const UnmergedNodes found = unmerged_nodes(mesh);
  EXPECT_EQ(found.parts, 2);
  EXPECT_EQ(found.count, 4u);
  EXPECT_EQ(found.first, Vec3(0, 0, 1));
  mesh.hexes[1] = {4, 5, 7, 6, 12, 13, 15, 14};  // merged
  EXPECT_EQ(unmerged_nodes(mesh).count, 0u);
  EXPECT_EQ(unmerged_nodes(mesh).parts, 1);
  mesh.hexes[1] = {8, 9, 11, 10, 12, 13, 15, 14};
  for (int k = 8; k < 16; ++k) mesh.nodes[static_cast<std::size_t>(k)].z() += 0.01;  // apart
  EXPECT_EQ(unmerged_nodes(mesh).parts, 2);
  EXPECT_EQ(unmerged_nodes(mesh).count, 0u);
  for (int k = 8; k < 16; ++k)
    mesh.nodes[static_cast<std::size_t>(k)].z() -= 0.009;  // beside, a joint of 1 mm
  EXPECT_EQ(unmerged_nodes(mesh).count, 4u);
}

TEST(Table, ColumnsAreSeparatedByWhatTheTableHas) {
  EXPECT_EQ(table_separator("a,b\n1,2\n"), ',');
  EXPECT_EQ(table_separator("# x; y\na,b\n1,2\n"), ',');
  EXPECT_EQ(table_separator("a;b\n1,5;2\n"), ';');
  EXPECT_EQ(table_separator("a\tb\n1,5\t2\n"), '\t');
  EXPECT_EQ(table_separator("\"a;b\",c\n"), ',');
  const auto texts = [](const char* line, char separator) {
    std::vector<std::string> all;
    for (const TableCell& c : table_cells(line, separator)) all.push_back(c.text);
    return all;
  };
  using Texts = std::vector<std::string>;
  EXPECT_EQ(texts(" a , \"b, \"\"c\"\"\" ,d,", ','), (Texts{"a", "b, \"c\"", "d"}));
  EXPECT_EQ(texts("1,5;2;", ';'), (Texts{"1,5", "2"}));
  EXPECT_EQ(texts("a\t\tb\r", '\t'), (Texts{"a", "", "b"}));
  EXPECT_EQ(texts("", ','), (Texts{""}));
  EXPECT_EQ(table_cells("ab, cd", ',')[1].column, 5);
  EXPECT_TRUE(is_blank_row(" ;;") && is_blank_row("  # a") && is_blank_row("\r") && !is_blank_row(" 1"));
}

TEST(Table, DecimalCommas) {
  const auto read = [](const char* line, char separator, std::size_t k) {
    return with_decimal_point(table_cells(line, separator)[k], separator);
  };
  EXPECT_EQ(read("1,5;2", ';', 0), "1.5");
  EXPECT_EQ(read("\"1,5\",2", ',', 0), "1.5");
  EXPECT_EQ(read("1.234,5;2", ';', 0), "1.234,5");  // thousands: no number
  EXPECT_EQ(read("1,234,5;2", ';', 0), "1,234,5");
  EXPECT_EQ(read("1,5", ',', 0), "1");
}

TEST(Table, NamesOfColumnsMayHaveUnits) {
  const auto parts = [](const std::string& text) {
    const NameAndUnit p = name_and_unit(text);
    return p.name + "|" + p.unit + (p.square ? "|square" : "");
  };
  EXPECT_EQ(parts("s [mm]"), "s|mm|square");
  EXPECT_EQ(parts("F (kN)"), "F|kN");
  EXPECT_EQ(parts("[m/s]"), "|m/s|square");
  for (const char* plain : {"energy", "", "a [b] c", "a (b]", "]"})
    EXPECT_EQ(parts(plain), std::string(plain) + "|");
}

TEST(Csv, NamesAreNoFormulas) {
  EXPECT_EQ(csv_field("B1.position.x [m]"), "B1.position.x [m]");
  for (const char first : {'=', '+', '-', '@'})
    EXPECT_EQ(csv_field(std::string(1, first) + "1"), std::string("'") + first + "1");
  EXPECT_EQ(csv_field("=HYPERLINK(\"a\",1)"), "\"'=HYPERLINK(\"\"a\"\",1)\"");
}

TEST(EditDistance, KnownValues) {
  EXPECT_EQ(edit_distance("", ""), 0);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("dip", "pid"), 2);
  EXPECT_EQ(edit_distance("veloctiy", "velocity"), 1);  // neighbours swapped
  EXPECT_EQ(edit_distance("Young", "young"), 0);
  EXPECT_EQ(edit_distance("", "abc"), 3);
}

TEST(NearestName, FindsTheNearAndNothingFar) {
  const std::vector<std::string> names{"density", "young", "poisson", "f_cm"};
  EXPECT_EQ(nearest_name("densty", names), "density");
  EXPECT_EQ(nearest_name("yuong", names), "young");
  EXPECT_EQ(nearest_name("temperature", names), "");
  EXPECT_EQ(nearest_name("x", {}), "");
}

// FIPS 180-4 examples.
TEST(Sha256, KnownValues) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesGiveTheSameAsTheWhole) {
  std::string text;
  for (int i = 0; i < 300; ++i) text += static_cast<char>(i * 7);
  for (std::size_t cut = 0; cut <= text.size(); ++cut) {
    Sha256 digest;
    digest.update(std::string_view(text).substr(0, cut));
    digest.update(std::string_view(text).substr(cut));
    ASSERT_EQ(digest.hex(), sha256(text)) << cut;
  }
  EXPECT_EQ(sha256_file("/no/such/file"), "");
}

TEST(Problem, TextNamesPlaceKeyValueRuleAndRemedy) {
  Problem p;
  p.file = "a.toml";
  p.line = 3;
  p.column = 7;
  p.key = "block.B1.mass";
  p.value = "-1";
  p.rule = "must be > 0 kg";
  p.remedy = "give a value in this range";
  EXPECT_EQ(p.str(), "a.toml:3:7: error: block.B1.mass = -1: must be > 0 kg; give a value in this range");
}

TEST(JsonQuoted, EscapesAndRepairs) {
  EXPECT_EQ(json_quoted("a\"b\\c\n\x01"), "\"a\\\"b\\\\c\\u000a\\u0001\"");
  EXPECT_EQ(json_quoted("\u00e9\u4e2d"), "\"\u00e9\u4e2d\"");
  EXPECT_EQ(json_quoted("\xff\xc0\x80"), "\"\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\"");
  EXPECT_EQ(json_quoted("\xed\xa0\x80"), "\"\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\"");  // a lone surrogate
}

TEST(JsonLog, OneWholeLineAnEventFromAnyThread) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("talus-log-" + std::to_string(::getpid()))).string();
  {
    JsonLog log(path);
    std::vector<std::thread> threads;
    for (long i = 0; i < 4; ++i)
      threads.emplace_back([&log, i] {
        for (long j = 0; j < 50; ++j)
          log.info("step",
                   {{"thread", i}, {"n", j}, {"dt", 1e-3}, {"ok", true}, {"name", std::string("B\"1")}});
      });
    for (auto& t : threads) t.join();
    log.warning("nan", {{"x", std::nan("")}});
  }
  std::ifstream file(path);
  std::string line, last;
  int lines = 0;
  while (std::getline(file, line)) {
    ++lines;
    last = line;
    EXPECT_EQ(line.front(), '{');
    EXPECT_EQ(line.back(), '}');
    EXPECT_NE(line.find("\"event\":"), std::string::npos);
  }
  EXPECT_EQ(lines, 201);
  EXPECT_NE(last.find("\"level\":\"warning\""), std::string::npos) << last;
  EXPECT_NE(last.find("\"x\":null"), std::string::npos) << last;
  std::filesystem::remove(path);
  EXPECT_THROW(JsonLog("/no/such/directory/log.jsonl"), InputError);
}

}  // namespace
}  // namespace talus
