// SPDX-License-Identifier: Apache-2.0
// The members of a view that have one value a channel.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/protocol/requests.h"

namespace blockwalk {
namespace {

TEST(ViewChannels, HaveAnItemEach) {
  const View view = fromQuery("channels=0,2&range=10:200;5:90;;-1:1&tf=0:000000:0,255:00ff00:0.5;inferno;auto").view;
  EXPECT_EQ(view.drawn, (std::vector<int>{0, 2}));
  EXPECT_EQ(view.channels[0].range, (DensityRange{10, 200}));
  EXPECT_EQ(view.channels[1].range, (DensityRange{5, 90}));
  EXPECT_FALSE(view.channels[2].range);
  EXPECT_EQ(view.channels[3].range, (DensityRange{-1, 1}));
  ASSERT_EQ(view.channels[0].transfer.size(), 2u);
  EXPECT_EQ(view.channels[0].transfer[1].opacity, 0.5);
  EXPECT_EQ(view.channels[1].transfer_preset, TransferPreset::inferno);
  EXPECT_EQ(view.channels[2], ChannelView{});
  EXPECT_TRUE(view.channels[3].transfer.empty());
}

TEST(ViewChannels, WithoutAnItemTakeTheirDefault) {
  ImageRequest request = fromQuery("range=1:2;3:4&tf=grey;viridis&channels=1");
  setViewField(request, "range", "5:6");
  EXPECT_EQ(request.view.channels[0].range, (DensityRange{5, 6}));
  EXPECT_FALSE(request.view.channels[1].range);
  setViewField(request, "tf", ";grey");
  EXPECT_EQ(request.view.channels[0].transfer_preset, TransferPreset::automatic);
  EXPECT_EQ(request.view.channels[1].transfer_preset, TransferPreset::grey);
  setViewFields(request, parseQueryString("range=auto&tf=auto&channels=all"));
  EXPECT_EQ(request, ImageRequest{});
}

TEST(ViewChannels, AQueryGivesTheRequestBack) {
  for (const char* query : {"channels=0,2", "channels=3,1&range=;5:90", "range=1:2;;3:4", "tf=;;inferno",
                            "tf=0:000000:0,255:00ff00:0.5;grey", "range=;;;-1e-30:1e%2B30&tf=;1:ffffff:1"}) {
    EXPECT_EQ(viewQuery(fromQuery(query)), query);
  }
}

TEST(ViewChannels, OfJsonAreTheSameAsText) {
  const struct {
    const char* json;
    const char* query;
  } kCases[] = {
      {R"({"range":[[10,200],null]})", "range=10:200"},
      {R"({"range":[null,[5,90.5]]})", "range=;5:90.5"},
      {R"({"range":["1:2",[3,4],"auto"]})", "range=1:2;3:4"},
      {R"({"range":"1:2;3:4"})", "range=1:2;3:4"},
      {R"({"tf":["0:000000:0,255:00ff00:0.5","inferno",null]})", "tf=0:000000:0,255:00ff00:0.5;inferno"},
      {R"({"tf":[["0:000000:0","9:ffffff:1"],["0:ff0000:1"]]})", "tf=0:000000:0,9:ffffff:1;0:ff0000:1"},
      {R"({"tf":["0:000000:0","9:ffffff:1"]})", "tf=0:000000:0,9:ffffff:1"},
      {R"({"tf":[null,"grey"]})", "tf=;grey"},
      {R"({"channels":[2,0]})", "channels=2,0"},
      {R"({"channels":"all","range":"auto"})", "range=auto"},
  };
  for (const auto& c : kCases) EXPECT_EQ(fromJson(c.json), fromQuery(c.query)) << c.json;
}

TEST(ViewChannels, OfAnotherShapeNameTheField) {
  const struct {
    const char* field;
    const char* text;
  } kBad[] = {{"channels", ""},
              {"channels", "4"},
              {"channels", "-1"},
              {"channels", "0,0"},
              {"channels", "0,1,2,3,0"},
              {"channels", "0;1"},
              {"channels", "1.0"},
              {"channels", "auto"},
              {"range", ""},
              {"range", "1:2;3"},
              {"range", "1:2;4:3"},
              {"range", "1:2;3:4;5:6;7:8;9:10"},
              {"range", "1:2;;;;"},
              {"range", "1:2,3:4"},
              {"range", "; "},
              {"tf", "grey;jet"},
              {"tf", ""},
              {"tf", "0:000000:0;1"},
              {"tf", "a;b;c;d;e"},
              {"tf", "0:000000:0;0:00000:1"}};
  for (const auto& bad : kBad) {
    ImageRequest request;
    try {
      setViewField(request, bad.field, bad.text);
      ADD_FAILURE() << bad.field << "=" << bad.text << " was accepted";
    } catch (const ViewError& error) {
      EXPECT_EQ(error.field, bad.field);
    }
    EXPECT_EQ(request, ImageRequest{}) << bad.field << "=" << bad.text;
  }
}

TEST(ViewChannels, OfJsonOfAnotherShapeNameTheField) {
  for (const auto& [field, text] : {std::pair{"range", R"({"range":[[1,2,3],null]})"},
                                    {"range", R"({"range":[[1,2],3]})"},
                                    {"range", R"({"range":[[[1],2]]})"},
                                    {"range", R"({"range":[]})"},
                                    {"range", R"({"range":null})"},
                                    {"tf", R"({"tf":[{}]})"},
                                    {"tf", R"({"tf":[[]]})"},
                                    {"channels", R"({"channels":[]})"},
                                    {"channels", R"({"channels":[null]})"},
                                    {"channels", R"({"channels":[[0,1]]})"}}) {
    ImageRequest request;
    try {
      setViewFields(request, nlohmann::json::parse(text));
      ADD_FAILURE() << text;
    } catch (const ViewError& error) {
      EXPECT_EQ(error.field, field) << text;
    }
  }
}

}  // namespace
}  // namespace blockwalk
