// SPDX-License-Identifier: Apache-2.0
// Eyes on faces and corners, in clip planes, far away; fields of view from 1e-7 to 179.9 degrees.
#include <cmath>
#include <numbers>

#include "tests/extreme/cases.h"
#include "tests/extreme/gauge.h"
#include "tests/extreme/volumes.h"

namespace blockwalk::extreme {
namespace {

const glm::dmat4 kIdentity(1);
const glm::dvec3 kCenter(28, 27, 26);

Case eyeAt(std::string name, std::string what, glm::dvec3 eye, glm::dvec3 target) {
  return {std::move(name), std::move(what), [=] {
            View view = look(kIdentity, eye, target);
            view.fov_degrees = 75;
            return imageError(clumpScenario(view));
          }};
}

// The volume fills the image from `distance` voxels away.
View farLook(double distance, glm::dvec3 direction) {
  View view = look(kIdentity, kCenter + distance * glm::normalize(direction), kCenter);
  view.fov_degrees = 2 * std::atan(46 / distance) * 180 / std::numbers::pi;
  return view;
}

// Dense enough that a thousandth of a voxel is seen.
Case clipped(std::string name, std::string what, glm::dvec3 eye, ClipBox clip, bool blank = false) {
  return {std::move(name), std::move(what), [=] {
            View view = look(kIdentity, eye, kCenter);
            view.fov_degrees = 75;
            view.clip = clip;
            view.extinction = 300;
            Scenario scenario = clumpScenario(view);
            scenario.blank = blank;
            return imageError(scenario);
          }};
}

Case refused(std::string name, std::string what, const std::string& field, const std::function<void(View&)>& change) {
  return {std::move(name), std::move(what),
          [=] {
            View view = look(kIdentity, {28, 27, 130}, kCenter);
            change(view);
            return isNotRefused(clumpScenario(view), field);
          },
          Unit::wrong, 0};
}

void addEyes(std::vector<Case>& cases) {
  cases.push_back(eyeAt("eye_in_voxel", "eye in the middle of a voxel", {20.5, 30.5, 25.5}, kCenter));
  cases.push_back(eyeAt("eye_on_face", "eye on a voxel face", {20, 30.5, 25.5}, {50, 40, 33}));
  cases.push_back(eyeAt("eye_on_edge", "eye on a voxel edge", {20, 30, 25.5}, {0, 40, 33}));
  cases.push_back(eyeAt("eye_on_corner", "eye on a voxel corner", {20, 30, 25}, {50, 0, 33}));
  cases.push_back(eyeAt("eye_on_block_corner", "eye on the corner of eight blocks", glm::dvec3(48), {0, 3, 9}));
  cases.push_back(eyeAt("eye_on_volume_corner", "eye on the volume's corner", {0, 0, 0}, kCenter));
  cases.push_back(eyeAt("eye_at_far_corner", "eye on the volume's far corner", {56, 54, 52}, {0, 30, 20}));
  cases.push_back(
      eyeAt("eye_on_volume_face", "eye on the volume's face, looking along it", {56, 10, 10}, {56, 40, 20}));
  cases.push_back({"eye_looks_away", "eye on the volume's face, looking out: background", [] {
                     View view = look(kIdentity, {56, 20, 20}, {90, 20, 20});
                     view.fov_degrees = 75;
                     Scenario scenario = clumpScenario(view);
                     scenario.blank = true;
                     return imageError(scenario);
                   }});
  const double radius = glm::length(glm::dvec3(28, 27, 26));
  for (double factor : {1 - 1e-9, 1 + 1e-9}) {
    cases.push_back({factor < 1 ? "eye_just_in_sphere" : "eye_just_out_of_sphere",
                     "eye 1e-9 beside the volume's bounding sphere, where the ray's anchor changes", [=] {
                       View view = look(kIdentity, kCenter + radius * factor * glm::dvec3(0, 0, 1), kCenter);
                       return imageError(clumpScenario(view));
                     }});
  }
}

void addClips(std::vector<Case>& cases) {
  cases.push_back(clipped("eye_in_clip_box", "eye inside the clip box", {20.2, 30.7, 40.1},
                          {.min = {3.5, 4.25, 5}, .max = {50, 44.125, 48}}));
  cases.push_back(clipped("eye_in_clip_plane", "eye in a clip plane", {20.2, 30.7, 40.25},
                          {.min = {3.5, 4.25, 5}, .max = {50, 44.125, 40.25}}));
  cases.push_back(clipped("clip_on_faces", "clip planes in planes of voxel faces", {70, 60, 90},
                          {.min = {8, 9, 10}, .max = {48, 47, 46}}));
  cases.push_back(clipped("clip_thin", "clip box a thousandth of a voxel thick", {28, 27, 130},
                          {.min = {0, 0, 25.5}, .max = {56, 54, 25.501}}));
  cases.push_back(clipped("clip_empty", "clip box of no size: background", {28, 27, 130},
                          {.min = glm::dvec3(20), .max = glm::dvec3(20)}, true));
  cases.push_back(clipped("clip_beside", "clip box beside the volume: background", {28, 27, 130},
                          {.min = glm::dvec3(60), .max = glm::dvec3(1e9)}, true));
  cases.push_back(
      clipped("clip_huge", "clip box of 1e30", {28, 27, 130}, {.min = glm::dvec3(-1e30), .max = glm::dvec3(1e30)}));
}

void addFar(std::vector<Case>& cases) {
  const glm::dvec3 oblique(0.3, 0.4, 0.87);
  cases.push_back({"eye_1e6_away", "eye 1e6 voxels away, the volume fills the image",
                   [=] { return imageError(clumpScenario(farLook(1e6, oblique))); }});
  cases.push_back({"eye_1e9_away", "eye 1e9 voxels away, the volume fills the image",
                   [=] { return imageError(clumpScenario(farLook(1e9, oblique))); }});
  cases.push_back({"eye_1e9_away_on_axis", "eye 1e9 voxels away on an axis", [=] {
                     return imageError(clumpScenario(farLook(1e9, {0, 0, 1})));
                   }});
  cases.push_back({"ortho_1e9_away", "orthographic, eye 1e9 voxels away", [=] {
                     const glm::dvec3 eye = kCenter + 1e9 * glm::normalize(oblique);
                     return imageError(clumpScenario(lookStraight(kIdentity, eye, kCenter, {0, 1, 0}, 5)));
                   }});
  cases.push_back({"hits_from_1e6", "first-hit from 1e6 voxels away",
                   [=] {
                     Scenario scenario = clumpScenario(farLook(1e6, oblique));
                     scenario.filters = {Filter::nearest};
                     return wrongHits(scenario);
                   },
                   Unit::wrong, 0});
}

void addFields(std::vector<Case>& cases) {
  cases.push_back({"fov_1e_3", "fov 0.001 degrees: the image is a seventh of a voxel high", [] {
                     View view = look(kIdentity, {28.2, 27.3, 8000}, {28.2, 27.3, 0});
                     view.fov_degrees = 1e-3;
                     return imageError(clumpScenario(view));
                   }});
  cases.push_back({"fov_179_9_inside", "fov 179.9 degrees, eye inside", [] {
                     View view = look(kIdentity, {20.2, 30.7, 25.1}, kCenter);
                     view.fov_degrees = 179.9;
                     return imageError(clumpScenario(view));
                   }});
  cases.push_back({"fov_179_9_outside", "fov 179.9 degrees, eye 22 voxels before the volume", [] {
                     View view = look(kIdentity, {28, 27, 74}, kCenter);
                     view.width = 1;
                     view.height = 2048;  // 24 voxels a pixel at the front face
                     view.fov_degrees = 179.9;
                     return imageError(clumpScenario(view));
                   }});
  cases.push_back({"volume_at_the_rim", "178 degrees wide, the volume 87 degrees aside", [] {
                     View view = look(kIdentity, {-2800, 27, 158}, {-2800, 27, 157}, {0, 1, 0});
                     view.width = 2048;
                     view.height = 1;
                     view.fov_degrees = 2 * std::atan(60.0 / 2048) * 180 / std::numbers::pi;
                     return imageError(clumpScenario(view));
                   }});
  cases.push_back({"ortho_inside", "orthographic, the eye's plane cuts the volume", [] {
                     return imageError(clumpScenario(lookStraight(kIdentity, kCenter, {3, 4, 5}, {0, 1, 0}, 3)));
                   }});
  cases.push_back({"ortho_1e_6", "orthographic, the image is 1e-6 voxels high", [] {
                     View view = lookStraight(kIdentity, {28.3, 27.2, 90}, {28.2, 27.3, 0}, {0, 1, 0}, 1);
                     view.ortho_height = 1e-6;
                     return imageError(clumpScenario(view));
                   }});
  cases.push_back({"ortho_1e9", "orthographic, the volume is 6e-8 of the image: one ray at most meets it", [] {
                     View view = lookStraight(kIdentity, {28.3, 27.2, 90}, {28.2, 27.3, 0}, {0, 1, 0}, 1);
                     view.ortho_height = 1e9;
                     Scenario scenario = clumpScenario(view);
                     scenario.blank = true;
                     return imageError(scenario);
                   }});
}

}  // namespace

std::vector<Case> cameraCases() {
  std::vector<Case> cases;
  addEyes(cases);
  addClips(cases);
  addFar(cases);
  addFields(cases);
  cases.push_back(refused("up_parallel", "up along the line of sight: an error", "up",
                          [](View& view) { view.up = *view.target - *view.eye; }));
  cases.push_back(
      refused("up_zero", "up without a length: an error", "up", [](View& view) { view.up = glm::dvec3(0); }));
  cases.push_back(refused("eye_is_target", "eye and target the same: an error", "target",
                          [](View& view) { view.eye = *view.target; }));
  return cases;
}

}  // namespace blockwalk::extreme
