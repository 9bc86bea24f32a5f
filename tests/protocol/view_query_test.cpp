// SPDX-License-Identifier: Apache-2.0
// The query of a request gives the same request.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "protocol/view_choices.h"
#include "protocol/view_fields.h"
#include "tests/protocol/requests.h"

namespace blockwalk {
namespace {

TEST(ViewQuery, OfARequestGivesItBack) {
  EXPECT_EQ(viewQuery(ImageRequest{}), "");
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1e3, 1e3);
  std::uniform_int_distribution<int> small(0, 255);
  for (int i = 0; i < 500; ++i) {
    ImageRequest request;
    View& view = request.view;
    const auto vector = [&] { return glm::dvec3(number(random), number(random), number(random)); };
    const auto byte = [&] { return static_cast<std::uint8_t>(small(random)); };
    if (i % 2 == 0) view.eye = vector();
    if (i % 3 == 0) view.target = vector();
    if (i % 5 == 0) view.up = vector();
    if (i % 2 == 0) view.fov_degrees = 1 + small(random) / 3.0;
    if (i % 2 == 1) view.ortho_height = 1e-3 + std::abs(number(random));
    const double lo = number(random);
    if (i % 3 == 1) view.channels[0].range = DensityRange{lo, lo + std::abs(number(random))};
    view.mode = static_cast<Mode>(i % 8);
    view.attenuation = i % 3 == 0 ? std::abs(number(random)) : view.attenuation;
    view.finder = static_cast<Finder>(i % 7);
    view.macrocell = 8 * (i % 3);
    view.width = 1 + small(random);
    view.extinction = std::abs(number(random));
    view.background = {byte(), byte(), byte(), byte()};
    view.level = i % 18 - 1;
    view.requests = kRequestsChoices[static_cast<std::size_t>(i % 3)].value;
    view.stand_in = kStandInChoices[static_cast<std::size_t>(i / 3 % 3)].value;
    view.lights.key = i % 3 == 0 ? 0.3 : small(random) / 7.0;
    view.key_light.z = i % 4 == 0 ? 1 : small(random) / 3.0;
    view.shadow = i % 2 == 1;
    view.occlusion = i % 3 == 0 ? 0 : small(random);
    view.aperture = i % 4 == 1 ? small(random) / 9.0 : 0;
    view.focus = i % 4 == 2 ? 1 + small(random) / 9.0 : 0;
    view.lod_alpha = i % 5 == 0 ? small(random) / 255.0 : 0;
    view.lod = i % 4 == 0 ? kOneLevel : 1 + small(random) / 8.0;
    const glm::dvec3 corner = vector();
    if (i % 4 == 0) view.clip = ClipBox{corner, corner + glm::abs(vector())};
    for (int p = 0; p < i % 7; ++p) view.planes.push_back({vector(), number(random)});
    for (int p = 0; p < i % 4; ++p) {
      view.channels[0].transfer.push_back({p + 0.1, glm::dvec3(byte(), byte(), byte()) / 255.0, small(random) / 255.0});
    }
    view.walk = i % 2 == 0;
    view.cull = i % 3 == 0;
    view.output = static_cast<Output>(i % 4);
    view.samples = 1 + i % 256;
    request.format = static_cast<ImageFormat>(i % 3);
    request.quality = 1 + i % 100;
    EXPECT_EQ(fromQuery(viewQuery(request)), request) << viewQuery(request);
  }
}

}  // namespace
}  // namespace blockwalk
