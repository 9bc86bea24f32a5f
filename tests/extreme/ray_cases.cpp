// SPDX-License-Identifier: Apache-2.0
// Rays where rounding decides which cells they cross: along axes, faces, edges and corners, and nearly so.
#include <fmt/format.h>

#include "tests/extreme/cases.h"
#include "tests/extreme/gauge.h"
#include "tests/extreme/volumes.h"

namespace blockwalk::extreme {
namespace {

// Square, so that the pixels' positions are whole or half numbers of voxels and exact in a float.
View exactLook(glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up) {
  View view = lookStraight(glm::dmat4(1), eye, target, up, 1);
  view.width = 16;
  return view;
}

// 16x16 rays along an axis; the middle of the image at `middle`, the rays at halves from there.
Case alongAxis(std::string name, std::string what, int axis, double sign, glm::dvec3 middle) {
  return {std::move(name), std::move(what), [=] {
            glm::dvec3 eye = middle, up(0);
            eye[axis] -= sign * 90;
            up[(axis + 1) % 3] = 1;
            return imageError(clumpScenario(exactLook(eye, middle, up)));
          }};
}

// A component of the direction that is exactly or nearly nothing; the ray through x = 20.25 keeps its column.
Case withComponent(std::string name, double component) {
  return {std::move(name), fmt::format("rays along -z, direction's x component {:g}", component), [=] {
            View view =
                exactLook({component < 0 ? 20.25 - 90 * component : 20.25, 23.25, 90}, {20.25, 23.25, 0}, {0, 1, 0});
            view.target = *view.eye + glm::dvec3(component * 90, 0, -90);
            return imageError(clumpScenario(view));
          }};
}

Case through(std::string name, std::string what, glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up, double pitch) {
  return {std::move(name), std::move(what), [=] {
            View view = lookStraight(glm::dmat4(1), eye, target, up, pitch);
            view.width = 25;
            view.height = 17;  // odd: one ray goes through the target
            return imageError(clumpScenario(view));
          }};
}

}  // namespace

std::vector<Case> rayCases() {
  std::vector<Case> cases;
  for (int axis = 0; axis < 3; ++axis) {
    for (int sign : {1, -1}) {
      const std::string direction = fmt::format("{}{}", sign > 0 ? '+' : '-', "xyz"[axis]);
      cases.push_back(alongAxis(fmt::format("along_{}_{}", sign > 0 ? "plus" : "minus", "xyz"[axis]),
                                fmt::format("parallel rays along {} through voxel centres", direction), axis, sign,
                                glm::dvec3(46)));
    }
    glm::dvec3 edges(46.5), faces(46.5);
    faces[(axis + 1) % 3] = 46;
    cases.push_back(alongAxis(fmt::format("in_faces_along_{}", "xyz"[axis]), "parallel rays exactly in voxel faces",
                              axis, 1, faces));
    cases.push_back(alongAxis(fmt::format("on_edges_along_{}", "xyz"[axis]),
                              "parallel rays exactly on voxel edges, block edges among them", axis, -1, edges));
  }
  const double q = 20.5, h = 0.5;
  cases.push_back(through("face_diagonal", "parallel rays along (1,1,0), one through voxel edges", {-60, -60, 24.5},
                          {24, 24, 24.5}, {0, 0, 1}, 1));
  cases.push_back(through("cube_diagonal", "parallel rays along (1,1,1), one through voxel and block corners",
                          glm::dvec3(-60), glm::dvec3(48), {0, 1, 0}, 0.5));
  cases.push_back(through("cube_antidiagonal", "parallel rays along (-1,1,-1), one through voxel corners",
                          {100, -60, 100}, {20, 20, 20}, {0, 1, 0}, 0.5));
  cases.push_back({"symmetry_plane", "perspective, the middle column of rays in the volume's plane of symmetry", [=] {
                     View view = look(glm::dmat4(1), {28, 27, 130}, {28, 27, 26}, {0, 1, 0});
                     view.width = 25;
                     view.height = 17;
                     return imageError(clumpScenario(view));
                   }});
  cases.push_back({"grazing_faces", "rays that leave their plane of faces by one voxel in a thousand", [=] {
                     return imageError(
                         clumpScenario(lookStraight(glm::dmat4(1), {q, q + h, 1000}, {q - 1, q + h, 0}, {0, 1, 0}, 1)));
                   }});
  cases.push_back(withComponent("component_minus_0", -0.0));
  cases.push_back(withComponent("component_1e_38", 1e-38));
  cases.push_back(withComponent("component_minus_1e_38", -1e-38));
  cases.push_back(withComponent("component_1e_300", 1e-300));
  cases.push_back(withComponent("component_1e_11", 1e-11));
  cases.push_back(withComponent("component_minus_1e_13", -1e-13));
  cases.push_back({"hits_on_edges", "first-hit of rays exactly on voxel edges: the voxel above each face",
                   [] {
                     Scenario scenario = clumpScenario(exactLook({46.5, 46.5, 90}, {46.5, 46.5, 0}, {0, 1, 0}));
                     scenario.filters = {Filter::nearest};
                     return wrongHits(scenario);
                   },
                   Unit::wrong, 0});
  return cases;
}

}  // namespace blockwalk::extreme
