// SPDX-License-Identifier: Apache-2.0
#include "protocol/json_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace blockwalk {
namespace {

TEST(JsonText, ReadsWhatJsonIs) {
  const char* text =
      R"( {"a":[1,-2,3.5e10,"\u00e9",null,true,[],{}],"b":{"c":18446744073709551615},"d":-0,"e":0.0e5} )";
  EXPECT_EQ(parseJson(text), nlohmann::json::parse(text));
  EXPECT_EQ(parseJson("5"), 5);
  EXPECT_EQ(parseJson("2.5e-310"), 2.5e-310);  // a denormal number is a number
}

struct BadText {
  const char* name;
  std::string text;
  const char* says;
};

void PrintTo(const BadText& bad, std::ostream* out) { *out << bad.name; }

class BadJson : public testing::TestWithParam<BadText> {};

TEST_P(BadJson, IsRefusedWithItsPosition) {
  try {
    parseJson(GetParam().text);
    FAIL() << "accepted";
  } catch (const JsonError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(GetParam().says));
    EXPECT_LE(error.position, GetParam().text.size() + 1);
  }
}

std::string repeat(const std::string& text, int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

const BadText kBadJson[] = {
    {"empty", "", "not valid JSON"},
    {"space", "  ", "not valid JSON"},
    {"open", "{", "not valid JSON"},
    {"trailing", "{}x", "not valid JSON"},
    {"two", "{}{}", "not valid JSON"},
    {"comma", "[1,]", "not valid JSON"},
    {"comment", "[1/*x*/]", "not valid JSON"},
    {"nan", "[NaN]", "not valid JSON"},
    {"infinity", "[-Infinity]", "not valid JSON"},
    {"hex", "[0x1]", "not valid JSON"},
    {"plus", "[+1]", "not valid JSON"},
    {"leading_zero", "[01]", "not valid JSON"},
    {"single_quotes", "{'a':1}", "not valid JSON"},
    {"bare_key", "{a:1}", "not valid JSON"},
    {"lone_surrogate", R"(["\ud800"])", "not valid JSON"},
    {"bad_utf8", "[\"\xff\"]", "not valid JSON"},
    {"overlong_utf8", "[\"\xc0\xaf\"]", "not valid JSON"},
    {"control", "[\"\x01\"]", "not valid JSON"},
    {"bom", "\xef\xbb\xbf{}", "byte order mark"},
    {"utf16", std::string("\xff\xfe[\0]\0", 6), "NUL"},
    {"nul_after", std::string("{}\0x", 4), "NUL"},
    {"huge", "[1e400]", "too large"},
    {"tiny", "[1e-400]", "too small"},
    {"repeated", R"({"a":1,"b":2,"a":3})", "'a' is repeated"},
    {"repeated_escaped", R"({"a":1,"\u0061":3})", "'a' is repeated"},
    {"repeated_deep", R"([{"x":{"k":[],"k":{}}}])", "'k' is repeated"},
    {"deep_33", repeat("[", 33) + repeat("]", 33), "deeper than 32"},
    {"deep_arrays", repeat("[", 1000000), "deeper than 32"},
    {"deep_objects", repeat("{\"a\":", 200000), "deeper than 32"},
    {"long_key", "{\"" + std::string(70000, 'k') + "\":1}", "longer than"},
    {"long_string", "[\"" + std::string(70000, 's') + "\"]", "longer than"},
    {"long_text", "[" + std::string(2000000, ' ') + "]", "longer than"},
};
INSTANTIATE_TEST_SUITE_P(Table, BadJson, testing::ValuesIn(kBadJson),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(JsonText, NamesTheMemberOfTheOutermostObject) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"a":1,"b":2,"a":3})", "a"},
      {R"({"a":1,"b":1e400})", "b"},
      {R"({"a":1,"b":1e-400})", "b"},
      {R"({"a":1,"b":[{"c":1e400}]})", "b"},
      {R"({"a":{"c":1,"c":2}})", "a"},
      {R"({"a":1,)", ""},
      {R"([1e400])", ""},
      {R"([{"c":1,"c":2}])", ""},
  };
  for (const auto& [text, field] : cases) {
    try {
      parseJson(text);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const JsonError& error) {
      EXPECT_EQ(error.field, field) << text;
    }
  }
}

TEST(JsonText, TakesSoManyValuesAndNoMore) {
  const std::string most = "[" + repeat("0,", 65534) + "0]";  // with the array itself
  EXPECT_NO_THROW(parseJson(most));
  EXPECT_THAT([&] { parseJson("[" + repeat("[],", 65535) + "0]"); },
              testing::ThrowsMessage<JsonError>(testing::HasSubstr("more than 65536 values")));
  EXPECT_THAT([&] { parseJson(R"({"a":)" + most + "}"); },
              testing::ThrowsMessage<JsonError>(testing::HasSubstr("more than 65536 values")));
}

TEST(JsonText, TakesTheDepthThatIsAllowed) { EXPECT_NO_THROW(parseJson(repeat("[", 32) + repeat("]", 32))); }

TEST(JsonText, EveryPrefixIsRefused) {
  const std::string text = R"({"a":[1,-2,3.5e10,"\u00e9",null,true],"b":{"c":1}})";
  for (std::size_t length = 0; length < text.size(); ++length) {
    EXPECT_THROW(parseJson(text.substr(0, length)), JsonError) << length;
  }
}

TEST(JsonText, WritesAnything) {
  EXPECT_EQ(writeJson({{"a", "\xff"}}), R"({"a":"\ufffd"})");
  EXPECT_EQ(writeJson({{"a", "\n\xc3\xa9"}}), R"({"a":"\n\u00e9"})");
}

}  // namespace
}  // namespace blockwalk
