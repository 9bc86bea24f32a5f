// SPDX-License-Identifier: Apache-2.0
#include "protocol/view_fields.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "protocol/query_string.h"
#include "protocol/view_choices.h"
#include "tests/protocol/requests.h"

namespace blockwalk {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

TEST(ViewFields, ReadEveryMember) {
  const ImageRequest request = fromQuery(
      "size=640x480&eye=1,-2,3e2&target=0,0.5,0&up=0,0,1&fov=60.5&range=-10:200&mode=first-hit&filter=linear&step=0.25"
      "&classification=pre-integrated&tf-shape=stepped&iso=12.5"
      "&extinction=0.75&attenuation=0.125&tf=0:000000:0,10:ff8000:0.5,20:ffffff:1&lit=on&clip=0,1,2,3,4,5&planes=1,0,0,"
      "-2.5;0,-1e-3,2,0&"
      "level=2&lod=3.5&lod-alpha=0.25&requests=shells&stand-in=maximum&light=0.1,0.2,0.3,0.4&key-light=1,2,3&shadow=on&"
      "occlusion=8&"
      "aperture=0.5&focus=70&background=11223344"
      "&finder=grid&macrocell=16&walk=off&cull=off&output=position&samples=16&format=jpeg&quality=70");
  const View& view = request.view;
  EXPECT_EQ(view.width, 640);
  EXPECT_EQ(view.height, 480);
  EXPECT_EQ(view.eye, glm::dvec3(1, -2, 300));
  EXPECT_EQ(view.target, glm::dvec3(0, 0.5, 0));
  EXPECT_EQ(view.up, glm::dvec3(0, 0, 1));
  EXPECT_EQ(view.fov_degrees, 60.5);
  EXPECT_EQ(view.channels[0].range, (DensityRange{-10, 200}));
  EXPECT_EQ(view.mode, Mode::first_hit);
  EXPECT_EQ(view.filter, Filter::linear);
  EXPECT_EQ(view.step, 0.25);
  EXPECT_EQ(view.classification, Classification::pre_integrated);
  EXPECT_EQ(view.transfer_shape, TransferShape::stepped);
  EXPECT_EQ(view.iso, 12.5);
  EXPECT_TRUE(view.lit);
  EXPECT_EQ(view.extinction, 0.75);
  EXPECT_EQ(view.attenuation, 0.125);
  ASSERT_EQ(view.channels[0].transfer.size(), 3u);
  EXPECT_EQ(view.channels[0].transfer[1].value, 10);
  EXPECT_EQ(view.channels[0].transfer[1].color, glm::dvec3(255, 128, 0) / 255.0);
  EXPECT_EQ(view.channels[0].transfer[1].opacity, 0.5);
  EXPECT_EQ(view.clip, (ClipBox{{0, 1, 2}, {3, 4, 5}}));
  const std::vector<ClipPlane> planes = {{{1, 0, 0}, -2.5}, {{0, -1e-3, 2}, 0}};
  EXPECT_EQ(view.planes, planes);
  EXPECT_EQ(view.level, 2);
  EXPECT_EQ(view.lod, 3.5);
  EXPECT_EQ(view.lod_alpha, 0.25);
  EXPECT_EQ(view.requests, Requests::shells);
  EXPECT_EQ(view.stand_in, StandIn::maximum);
  EXPECT_EQ(view.lights, (Lights{.ambient = 0.1, .head = 0.2, .key = 0.3, .highlight = 0.4}));
  EXPECT_EQ(view.key_light, glm::dvec3(1, 2, 3));
  EXPECT_TRUE(view.shadow);
  EXPECT_EQ(view.occlusion, 8);
  EXPECT_EQ(view.aperture, 0.5);
  EXPECT_EQ(view.focus, 70);
  EXPECT_EQ(view.background, (std::array<std::uint8_t, 4>{0x11, 0x22, 0x33, 0x44}));
  EXPECT_EQ(view.finder, Finder::grid);
  EXPECT_EQ(view.macrocell, 16);
  EXPECT_FALSE(view.walk);
  EXPECT_FALSE(view.cull);
  EXPECT_EQ(view.output, Output::position);
  EXPECT_EQ(view.samples, 16);
  EXPECT_EQ(request.format, ImageFormat::jpeg);
  EXPECT_EQ(request.quality, 70);
}

TEST(ViewFields, AbsentValuesTakeAMemberBack) {
  ImageRequest request =
      fromQuery("eye=1,2,3&target=0,0,0&up=0,1,0&range=1:2&clip=0,0,0,1,1,1&planes=1,2,3,4&tf=0:000000:0&level=3");
  setViewFields(request,
                parseQueryString("eye=auto&target=auto&up=auto&range=auto&clip=none&planes=none&tf=auto&level=auto"));
  EXPECT_EQ(request, ImageRequest{});
}

TEST(ViewFields, AnUnchangedQueryGivesTheSameRequest) {
  for (const char* query :
       {"mode=mip", "mode=mean&filter=linear", "mode=iso&lit=on&iso=-3", "filter=linear&step=2", "tf=viridis",
        "tf=0:000000:0,1:ffffff:0.5&tf-shape=stepped", "filter=linear&classification=pre-integrated", "tf=ct-bone",
        "termination=0.25", "planes=0,0,1,-5.25;1e-300,0,0,1"}) {
    EXPECT_EQ(viewQuery(fromQuery(query)), query);
  }
}

TEST(ViewFields, PointsAndPresetsReplaceEachOther) {
  ImageRequest request = fromQuery("tf=viridis");
  EXPECT_EQ(request.view.channels[0].transfer_preset, TransferPreset::viridis);
  setViewField(request, "tf", "0:000000:0,1:ffffff:0.5");
  EXPECT_EQ(request.view.channels[0].transfer_preset, TransferPreset::automatic);
  EXPECT_EQ(request.view.channels[0].transfer.size(), 2u);
  setViewField(request, "tf", "auto");
  EXPECT_EQ(request, ImageRequest{});
}

TEST(ViewFields, PerspectiveAndOrthographicReplaceEachOther) {
  ImageRequest request = fromQuery("ortho=5");
  EXPECT_EQ(request.view.ortho_height, 5);
  setViewField(request, "fov", "30");
  EXPECT_FALSE(request.view.ortho_height.has_value());
  EXPECT_THROW(fromQuery("ortho=5&fov=30"), ViewError);
}

struct BadField {
  const char* name;
  const char* text;
};

class BadFields : public testing::TestWithParam<BadField> {};

TEST_P(BadFields, NameTheFieldAndChangeNothing) {
  ImageRequest request;
  try {
    setViewField(request, GetParam().name, GetParam().text);
    FAIL() << GetParam().name << "=" << GetParam().text << " was accepted";
  } catch (const ViewError& error) {
    EXPECT_EQ(error.field, GetParam().name);
    EXPECT_THAT(error.what(), testing::HasSubstr(GetParam().name));
  }
  EXPECT_EQ(request, ImageRequest{});
}

const BadField kBadFields[] = {
    {"size", ""},
    {"size", "0x5"},
    {"size", "5x0"},
    {"size", "8193x1"},
    {"size", "1x8193"},
    {"size", "512"},
    {"size", "512x"},
    {"size", "-1x5"},
    {"size", "5x5x5"},
    {"size", " 5x5"},
    {"size", "1e2x5"},
    {"size", "99999999999x5"},
    {"eye", "1,2"},
    {"eye", "1,2,3,4"},
    {"eye", "nan,0,0"},
    {"eye", "inf,0,0"},
    {"eye", "1e400,0,0"},
    {"eye", "1e-400,0,0"},
    {"eye", "0x10,0,0"},
    {"eye", "1,,2"},
    {"eye", "+1,0,0"},
    {"fov", "0"},
    {"fov", "180"},
    {"fov", "-1"},
    {"fov", "1e-300"},
    {"fov", "40deg"},
    {"fov", ""},
    {"ortho", "0"},
    {"ortho", "-2"},
    {"range", "10:5"},
    {"range", "nan:nan"},
    {"range", "1"},
    {"range", "1:2:3"},
    {"range", "-inf:inf"},
    {"mode", "MIP"},
    {"mode", "max"},
    {"mode", ""},
    {"mode", "Blend"},
    {"filter", "cubic"},
    {"step", "0"},
    {"step", "-1"},
    {"step", "0.001"},
    {"step", "17"},
    {"step", "nan"},
    {"classification", "pre"},
    {"tf-shape", "cubic"},
    {"tf", "jet"},
    {"iso", "inf"},
    {"termination", "-0.1"},
    {"termination", "0.6"},
    {"step", "0"},
    {"step", "1e-9"},
    {"extinction", "-1"},
    {"extinction", "inf"},
    {"attenuation", "-0.1"},
    {"attenuation", "1001"},
    {"attenuation", "nan"},
    {"attenuation", ""},
    {"mode", "min"},
    {"mode", "attenuated_mip"},
    {"tf", "0:000000:2"},
    {"tf", "0:000000:-0.1"},
    {"tf", "0:00000g:1"},
    {"tf", "1:000000:0,1:ffffff:1"},
    {"tf", "2:000000:0,1:ffffff:1"},
    {"tf", "warm"},
    {"tf", "0:000000"},
    {"tf", "0:#00000:1"},
    {"lit", "yes"},
    {"lit", "1"},
    {"iso", "5:6"},
    {"clip", "0,0,0,1,1"},
    {"clip", "1,0,0,0,1,1"},
    {"planes", ""},
    {"planes", "1,0,0"},
    {"planes", "1,0,0,0,0"},
    {"planes", "1,0,0,1;"},
    {"planes", "0,0,0,1"},
    {"planes", "1,0,0,1;0,-0,0,1"},
    {"planes", "1,0,nan,1"},
    {"planes", "1,0,0,inf"},
    {"planes", "1,0,0,1;1,0,0,1;1,0,0,1;1,0,0,1;1,0,0,1;1,0,0,1;1,0,0,1"},
    {"level", "-1"},
    {"level", "18"},
    {"level", "1.5"},
    {"lod", "on"},
    {"lod", "0"},
    {"lod", "0.5"},
    {"lod", "65"},
    {"lod", "nan"},
    {"lod-alpha", "-0.1"},
    {"lod-alpha", "1.01"},
    {"lod-alpha", "off"},
    {"requests", "near"},
    {"stand-in", "min"},
    {"light", "1,2,3"},
    {"light", "1,2,3,x"},
    {"key-light", "1,2"},
    {"shadow", "soft"},
    {"occlusion", "on"},
    {"aperture", "auto"},
    {"focus", "0"},
    {"focus", "-1"},
    {"background", "fff"},
    {"background", "#000000"},
    {"background", "00000-1f"},
    {"finder", "tree"},
    {"finder", "None"},
    {"macrocell", "12"},
    {"macrocell", "0"},
    {"walk", "auto"},
    {"cull", "true"},
    {"output", "normal"},
    {"output", "Depth"},
    {"samples", "0"},
    {"samples", "257"},
    {"samples", "1.5"},
    {"format", "avif"},
    {"format", "jpg"},
    {"quality", "0"},
    {"quality", "101"},
    {"quality", "85.5"},
    {"sise", "5x5"},
    {"Size", "5x5"},
};
INSTANTIATE_TEST_SUITE_P(Table, BadFields, testing::ValuesIn(kBadFields));

// A name that is wrong is, whatever its value.
TEST(ViewFields, WrongNamesAreRefusedWithoutTheirValues) {
  const std::pair<const char*, const char*> wrong[] = {
      {"foo=1", "foo: is no member of a view"},
      {"fov=30&fov=31", "fov: is given twice"},
      {"fov=30&ortho=2", "ortho: excludes fov: give one of fov and ortho"},
  };
  for (const auto& [query, says] : wrong) {
    try {
      fromQuery(query);
      ADD_FAILURE() << query;
    } catch (const ViewError& error) {
      EXPECT_EQ(error.what(), std::string(says));
    }
  }
}

TEST(ViewFields, RefuseMoreTransferPointsThanTheBound) {
  std::string points = "0:000000:0";
  for (int i = 1; i < 1024; ++i) points += fmt::format(",{}:ffffff:0.5", i);
  ImageRequest request;
  setViewField(request, "tf", points);
  EXPECT_EQ(request.view.channels[0].transfer.size(), 1024u);
  EXPECT_THROW(setViewField(request, "tf", points + ",1024:ffffff:1"), ViewError);
}

TEST(ViewFields, RefuseRepeatedNames) {
  ImageRequest request;
  try {
    setViewFields(request, Pairs{{"fov", "30"}, {"range", "1:2"}, {"fov", "30"}});
    FAIL();
  } catch (const ViewError& error) {
    EXPECT_EQ(error.field, "fov");
  }
  EXPECT_EQ(request, ImageRequest{});
}

TEST(ViewFields, MessagesCarryNoControlBytes) {
  ImageRequest request;
  try {
    setViewField(request, "mode", std::string("a\n\x1b[31m\xff") + std::string(500, 'x'));
    FAIL();
  } catch (const ViewError& error) {
    const std::string text = error.what();
    EXPECT_LT(text.size(), 200u);
    for (char c : text) EXPECT_TRUE(c >= ' ' && c <= '~');
  }
}

TEST(ViewFields, JsonIsTheSameAsText) {
  const auto object = nlohmann::json::parse(R"({"type":"view","id":4,"size":[640,480],"eye":[1,-2.5,3e2],
      "range":[10,200],"fov":60,"walk":false,"cull":true,"mode":"blocks","level":2,"quality":70,
      "tf":["0:000000:0","10:ffffff:0.5"],"clip":[0,0,0,1,1,1],"planes":[[0,0,1,-2],[1,2.5,3,4]],
      "background":"112233"})");
  static constexpr std::string_view kSkip[] = {"type", "id"};
  ImageRequest request;
  setViewFields(request, object, kSkip);
  EXPECT_EQ(
      request,
      fromQuery(
          "size=640x480&eye=1,-2.5,300&range=10:200&fov=60&walk=off&cull=on&mode=blocks&level=2"
          "&quality=70&tf=0:000000:0,10:ffffff:0.5&clip=0,0,0,1,1,1&planes=0,0,1,-2;1,2.5,3,4&background=112233"));
}

TEST(ViewFields, NoPlanesOfJsonTakeThemBack) {
  ImageRequest request = fromQuery("planes=0,0,1,5");
  setViewFields(request, nlohmann::json::parse(R"({"planes":[]})"));
  EXPECT_EQ(request, ImageRequest{});
}

TEST(ViewFields, JsonPlanesOfAnotherShapeNameTheField) {
  for (const char* text : {R"({"planes":[1,0,0,5]})", R"({"planes":[[1,0,0]]})", R"({"planes":[[[1],0,0,5]]})",
                           R"({"planes":[[]]})", R"({"planes":[[1,0,0,null]]})", R"({"planes":{}})"}) {
    ImageRequest request;
    try {
      setViewFields(request, nlohmann::json::parse(text));
      FAIL() << text;
    } catch (const ViewError& error) {
      EXPECT_EQ(error.field, "planes") << text;
    }
  }
}

TEST(ViewFields, JsonOfAnotherShapeNamesTheField) {
  for (const char* text : {R"({"eye":null})", R"({"eye":{"x":1}})", R"({"eye":[[1],2,3]})", R"({"eye":[]})",
                           R"({"eye":true})", R"({"eye":[1,2,null]})", R"({"eye":1})"}) {
    ImageRequest request;
    try {
      setViewFields(request, nlohmann::json::parse(text));
      FAIL() << text;
    } catch (const ViewError& error) {
      EXPECT_EQ(error.field, "eye") << text;
    }
  }
  ImageRequest request;
  EXPECT_THROW(setViewFields(request, nlohmann::json::parse("[1]")), ViewError);
}

TEST(QueryString, DecodesAndKeepsOrder) {
  const Pairs expected{{"a", "1 2"}, {"b", "x=y"}, {"a", ""}};
  EXPECT_EQ(parseQueryString("a=1+2&b=x%3Dy&a="), expected);
  EXPECT_TRUE(parseQueryString("").empty());
}

TEST(QueryString, RefusesBrokenText) {
  for (const char* text : {"a", "=1", "a=%", "a=%4", "a=%zz", "a=1&&b=2", "a=%-1"}) {
    EXPECT_THROW(parseQueryString(text), DataError) << text;
  }
  std::string many = "a=1";
  for (std::size_t i = 0; i < kMaxQueryPairs; ++i) many += "&a=1";
  EXPECT_THROW(parseQueryString(many), DataError);
}

}  // namespace
}  // namespace blockwalk
