// SPDX-License-Identifier: Apache-2.0
// What the experiments after the papers have in common: ways to draw a view, timed side by side.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "bench/experiments/experiments.h"

namespace blockwalk::bench {

// A way to draw a view.
struct Choice {
  std::string name;
  Finder finder = Finder::automatic;
  bool walk = true;
  bool cull = true;
  int macrocell = kAutoMacrocell;
};

// Of the options' size, at level 0.
View pictureOf(const ExperimentOptions& options);

View with(View view, const Choice& choice);

// {"mean", "q1", "median", "q3"} of times that are not empty, in their unit. Quartiles are the values nearest in rank.
nlohmann::json spread(std::vector<double> values);

// A run a choice: {"choice", "finder", "walk", "cull", "macrocell", "ms": spread of device times, "queries",
// "block_visits", "subblock_visits", "voxel_steps"}, and for a finder that builds "build" as in `stats`. The choices
// take turns, frame by frame, so that whatever else the machine does meets all of them. `force_rebuild`: every frame
// builds what its finder looks for anew, and its time counts.
nlohmann::json timeChoices(Renderer& renderer, ResidentVolume& volume, const View& view,
                           std::span<const Choice> choices, int samples, bool force_rebuild = false);

// Voxels of level 0 along each axis.
nlohmann::json dimsJson(const VolumeInfo& info);

// Bytes on the device by part, {"voxels": ..., ...}.
nlohmann::json residentBytes(const ResidentVolume& volume);

// A picture of the options' folder, if there is one: NAME.png. Frames of numbers as output_picture.h shows them.
void writePicture(const ExperimentOptions& options, const std::string& name, const Frame& frame);

}  // namespace blockwalk::bench
