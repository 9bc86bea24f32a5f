// SPDX-License-Identifier: Apache-2.0
#include "protocol/animation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <webp/demux.h>

#include <nlohmann/json.hpp>

#include "protocol/animated_webp.h"
#include "protocol/animation_request.h"
#include "protocol/problem.h"

namespace blockwalk {
namespace {

using nlohmann::json;

VolumeInfo cube() {
  VolumeInfo info;
  info.dims = {100, 100, 100};
  info.levels = {{.dims = info.dims}};
  info.channels[0].density_max = 255;
  return info;
}

std::string animationFault(const json& object) {
  try {
    const Film film(readAnimation(object), cube());
  } catch (const ViewError& error) {
    return error.field + "|" + error.what();
  }
  return "no error";
}

void expectNear(const glm::dvec3& a, const glm::dvec3& b) {
  EXPECT_LT(glm::length(a - b), 1e-9) << a.x << " " << a.y << " " << a.z;
}

TEST(Film, TurnsAboutTheTarget) {
  const json view = {{"eye", {50, 50, 350}}, {"target", {50, 50, 50}}, {"up", {0, 1, 0}}, {"size", {40, 30}}};
  const Film film(readAnimation({{"fps", 4}, {"view", view}, {"turntable", {{"seconds", 2}}}}), cube());
  ASSERT_EQ(film.frames(), 8);
  expectNear(*film.view(0).eye, {50, 50, 350});
  expectNear(*film.view(2).eye, {350, 50, 50});  // a quarter, counterclockwise seen from above
  expectNear(*film.view(4).eye, {50, 50, -250});
  const double half = 150 * std::sqrt(2.0);
  expectNear(*film.view(7).eye, {50 - half, 50, 50 + half});
  EXPECT_EQ(film.view(3).width, 40);
  // About another axis up turns too.
  const json about_x = {{"axis", {2, 0, 0}}, {"degrees", -90}, {"seconds", 1}};
  const Film over(readAnimation({{"fps", 2}, {"view", view}, {"turntable", about_x}}), cube());
  ASSERT_EQ(over.frames(), 2);
  expectNear(*over.view(1).eye,
             {50, 50 + 2 * half / std::sqrt(2.0) * std::sin(M_PI / 4), 50 + 300 * std::cos(M_PI / 4)});
  expectNear(*over.view(1).up, {0, std::cos(M_PI / 4), -std::sin(M_PI / 4)});
}

TEST(Film, GoesFromKeyToKey) {
  const json first = {{"eye", {50, 50, 150}}, {"target", {50, 50, 50}},         {"up", {0, 1, 0}}, {"fov", 40},
                      {"range", {0, 100}},    {"tf", "0:000000:0,100:ff0000:1"}};
  const json second = {{"eye", {450, 50, 50}}, {"target", {50, 50, 50}},
                       {"up", {0, 1, 0}},      {"fov", 20},
                       {"range", {50, 200}},   {"tf", "0:000000:0,200:0000ff:0.5"},
                       {"mode", "mip"}};
  const json third = {{"eye", {450, 50, 80}}, {"target", {50, 50, 80}}, {"up", {0, 1, 0}}, {"fov", 20}};
  const json keys = {
      {{"seconds", 1}, {"view", first}}, {{"seconds", 3}, {"view", second}}, {{"seconds", 4}, {"view", third}}};
  const Film film(readAnimation({{"fps", 2}, {"keys", keys}}), cube());
  ASSERT_EQ(film.frames(), 7);
  const View middle = film.view(2);
  // Along the great circle, at the geometric mean of the distances 100 and 400.
  expectNear(*middle.eye, {50 + 200 / std::sqrt(2.0), 50, 50 + 200 / std::sqrt(2.0)});
  EXPECT_DOUBLE_EQ(middle.fov_degrees, 30);
  EXPECT_DOUBLE_EQ(middle.channels[0].range->lo, 25);
  EXPECT_DOUBLE_EQ(middle.channels[0].range->hi, 150);
  EXPECT_DOUBLE_EQ(middle.channels[0].transfer[1].value, 150);
  EXPECT_DOUBLE_EQ(middle.channels[0].transfer[1].color.r, 0.5);
  EXPECT_DOUBLE_EQ(middle.channels[0].transfer[1].opacity, 0.75);
  EXPECT_EQ(middle.mode, Mode::blend) << "what is no number is the earlier key's";
  EXPECT_EQ(film.view(4).mode, Mode::mip);
  expectNear(*film.view(4).eye, {450, 50, 50});
  expectNear(*film.view(5).target, {50, 50, 65});
  expectNear(*film.view(6).eye, {450, 50, 80});
}

TEST(Film, TurnsHalfRoundAboutUp) {
  const auto key = [](double seconds, double x) {
    return json{{"seconds", seconds}, {"view", {{"eye", {x, 50, 50}}, {"target", {50, 50, 50}}, {"up", {0, 1, 0}}}}};
  };
  const Film film(readAnimation({{"fps", 1}, {"keys", {key(0, 150), key(2, -50)}}}), cube());
  expectNear(*film.view(1).eye, {50, 50, -50});
}

// Looking along +z with +y up, then along +y with +z up: the eye and up change places.
TEST(Film, KeepsUpApartFromTheLineOfSight) {
  const auto key = [](double seconds, const glm::dvec3& eye, const glm::dvec3& up) {
    const json view = {{"eye", {eye.x, eye.y, eye.z}}, {"target", {50, 50, 50}}, {"up", {up.x, up.y, up.z}}};
    return json{{"seconds", seconds}, {"view", view}};
  };
  const json keys = {key(0, {50, 50, 350}, {0, 1, 0}), key(1, {50, 350, 50}, {0, 0, 1}),
                     key(2, {50, -250, 50}, {0, 0, -1})};
  const Film film(readAnimation({{"fps", 10}, {"keys", keys}}), cube());
  ASSERT_EQ(film.frames(), 21);
  glm::dvec3 before = *film.view(0).eye;
  for (int i = 0; i < film.frames(); ++i) {
    const View view = film.view(i);
    EXPECT_NO_THROW(resolveView(view, cube())) << i;
    const glm::dvec3 back = *view.eye - *view.target;
    EXPECT_NEAR(glm::length(back), 300, 1e-6);
    EXPECT_NEAR(glm::dot(back, *view.up), 0, 1e-6) << i;
    EXPECT_LT(glm::length(*view.eye - before), 110) << i << ": evenly, a tenth of half a turn at most";
    before = *view.eye;
  }
  expectNear(*film.view(10).eye, {50, 350, 50});
  expectNear(*film.view(10).up, {0, 0, 1});
}

// Between two views from as high the eye stays as high: their ups are one.
TEST(Film, TurnsEyeAndUpAsOne) {
  const auto key = [](double seconds, double x, double z) {
    const json view = {{"eye", {50 + x, 90, 50 + z}}, {"target", {50, 50, 50}}, {"up", {0, 1, 0}}};
    return json{{"seconds", seconds}, {"view", view}};
  };
  const Film film(readAnimation({{"fps", 2}, {"keys", {key(0, 0, 100), key(1, 100, 0)}}}), cube());
  expectNear(*film.view(1).eye, {50 + 100 / std::sqrt(2.0), 90, 50 + 100 / std::sqrt(2.0)});
}

// Whoever put the view in.
TEST(Film, IsOfPicturesAlone) {
  for (const Output output : {Output::depth, Output::value, Output::position, Output::cost, Output::queries}) {
    Animation animation = readAnimation(json::object());
    animation.keys.front().view.output = output;
    try {
      const Film film(animation, cube());
      ADD_FAILURE() << "is a film";
    } catch (const ViewError& error) {
      EXPECT_EQ(error.field, "output");
    }
  }
}

TEST(Film, RefusesByMemberAndBound) {
  const json size = {{"size", "10x10"}};
  for (const auto& [object, expected] : {
           std::pair<json, const char*>{json::array(), "an animation|"},
           {{{"speed", 1}}, "speed|speed: is no member of an animation"},
           {{{"fps", 0}}, "fps|fps: must be from 0.1 to 120, not 0"},
           {{{"fps", "25"}}, "fps|fps: must be a number"},
           {{{"keys", json::array()}}, "keys|keys: must be a list of 1 to 256 keys"},
           {{{"keys", {{{"view", json::object()}}}}}, "seconds|seconds: is missing"},
           {{{"keys", {{{"seconds", 2}}, {{"seconds", 2}}}}}, "seconds|seconds: must ascend"},
           {{{"keys", {{{"seconds", 0}}, {{"seconds", 1}, {"view", size}}}}}, "size|must be the same in all keys"},
           {{{"keys", {{{"seconds", 0}}}}, {"turntable", json::object()}}, "turntable|turntable: excludes keys"},
           {{{"view", {{"colour", 1}}}}, "colour|colour: is no member of a view"},
           {{{"view", {{"output", "depth"}}}}, "output|output: an animation is of pictures"},
           {{{"turntable", {{"axis", {0, 0, 0}}}}}, "axis|axis: has no direction"},
           {{{"turntable", {{"axis", 1}}}}, "axis|axis: must be three numbers"},
           {{{"frames", 10}, {"fps", 10}}, "frames|frames: excludes fps"},
           {{{"frames", 3601}}, "frames|frames: must be from 1 to 3600, not 3601"},
           {{{"frames", 2.5}}, "frames|frames: must be a whole number"},
           {{{"frames", 1000}}, "frames|frames: 1000 in 8 seconds are 125 a second, which must be from 0.1 to 120"},
           {{{"frames", 2}, {"keys", {{{"seconds", 0}}}}}, "frames|frames: must be 1 of one key"},
           {{{"size", nullptr}}, "size|"},
           {{{"size", {9000, 1}}}, "size|"},
           {{{"size", {9, 9}}, {"view", size}}, "size|size: is given twice"},
           {{{"view", {{"format", "png"}}}}, "format|format: is of the animation"},
           {{{"format", "zip"}}, "format|format: is no member of an animation"},
           {{{"fps", 120}, {"turntable", {{"seconds", 31}}}}, "fps|120 a second are 3720 frames, at most 3600"},
       }) {
    EXPECT_THAT(animationFault(object), testing::StartsWith(expected)) << object;
  }
}

TEST(Film, HasAsManyFramesAsAreAskedFor) {
  for (const int frames : {1, 3, 50, 719, 960}) {
    const Film film(readAnimation({{"frames", frames}, {"size", {32, 24}}}), cube());
    EXPECT_EQ(film.frames(), frames);
    EXPECT_EQ(film.view(0).width, 32);
  }
  const json keys = {{{"seconds", 1}}, {{"seconds", 2}}, {{"seconds", 7.3}, {"view", {{"fov", 20}}}}};
  for (const int frames : {2, 3, 50, 755}) {
    const Film film(readAnimation({{"frames", frames}, {"size", "32x24"}, {"keys", keys}}), cube());
    EXPECT_EQ(film.frames(), frames);
    EXPECT_EQ(film.view(frames - 1).fov_degrees, 20) << "the last is the last key";
  }
}

std::string requestFault(const json& object) {
  try {
    const AnimationRequest request = readAnimationRequest(object);
    checkAnimationSize(Film(request.animation, cube()), request.format);
  } catch (const ViewError& error) {
    return "400|" + error.field + "|" + error.what();
  } catch (const ProblemError& error) {
    return fmt::format("{}|{}|{}", error.problem.status, error.problem.field, error.problem.detail);
  }
  return "no error";
}

TEST(AnimationRequest, RefusesByMemberAndBound) {
  EXPECT_EQ(requestFault(json::object()), "no error");
  EXPECT_EQ(requestFault({{"format", "webp"}, {"quality", 100}, {"size", {100, 100}}}), "no error");
  for (const auto& [object, expected] : {
           std::pair<json, const char*>{{{"format", "gif"}}, "400|format|format: must be zip or webp"},
           {{{"format", 1}}, "400|format|format: must be zip or webp"},
           {{{"quality", 50}}, "400|quality|quality: is of webp"},
           {{{"format", "webp"}, {"quality", 0}}, "400|quality|quality: "},
           {{{"format", "webp"}, {"quality", "90"}}, "400|quality|quality: "},
           {{{"deadline_ms", 1}}, "400|deadline_ms|deadline_ms: is no member of an animation"},
           {{{"frames", 900}, {"size", {1200, 1000}}},
            "413|frames|900 frames of 1200x1000 are 1080000000 pixels, of which a zip may have at most 1000000000"},
           {{{"format", "webp"}}, "413|frames|200 frames of 1024x768 are 157286400 pixels, of which a webp may"},
           {{{"view", {{"samples", 256}}}}, "413|samples|157286400 pixels of 256 samples are 40265318400 rays"},
           {json::array(), "400|an animation|"},
       }) {
    EXPECT_THAT(requestFault(object), testing::StartsWith(expected)) << object;
  }
}

TEST(AnimatedWebp, HasItsFramesAndTimes) {
  AnimatedWebp webp(6, 4, 8, 100);
  for (std::uint32_t i = 0; i < 3; ++i) webp.add(std::vector<std::uint32_t>(24, 0xff000000u | (60 * i)));
  const std::vector<std::byte> file = webp.finish();
  const WebPData data{reinterpret_cast<const std::uint8_t*>(file.data()), file.size()};
  WebPAnimDecoder* decoder = WebPAnimDecoderNew(&data, nullptr);
  ASSERT_NE(decoder, nullptr);
  WebPAnimInfo info;
  ASSERT_TRUE(WebPAnimDecoderGetInfo(decoder, &info));
  EXPECT_EQ(info.frame_count, 3u);
  EXPECT_EQ(info.canvas_width, 6u);
  EXPECT_EQ(info.canvas_height, 4u);
  for (int i = 0; i < 3; ++i) {
    std::uint8_t* pixels = nullptr;
    int time = 0;
    ASSERT_TRUE(WebPAnimDecoderGetNext(decoder, &pixels, &time));
    EXPECT_EQ(pixels[0], 60 * i);
    EXPECT_EQ(time, 125 * (i + 1));
  }
  WebPAnimDecoderDelete(decoder);
}

}  // namespace
}  // namespace blockwalk
