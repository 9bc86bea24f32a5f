// SPDX-License-Identifier: Apache-2.0
// Named experiments: programs that measure, and write what they found as JSON for bench/plot.py.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "protocol/view_fields.h"
#include "renderer/renderer.h"

namespace blockwalk::bench {

struct ExperimentOptions {
  DeviceOptions device;
  int width = 160;
  int height = 120;
  int samples = 5;                                  // frames a figure; its time is their median
  int demo_side = 96;                               // voxels of the procedural scenes
  std::vector<std::filesystem::path> files;         // volumes to measure beside them
  std::filesystem::path pictures;                   // a folder for pictures of what is measured; empty: none
  std::function<void(const std::string&)> on_step;  // a line about what comes next
};

// Error against run time for every knob that trades one for the other. The truth is the float64 reference's integral
// without a step, along the rays through the pixels' centres; for samples its mean over the pixels. Errors are in 8-bit
// steps. docs/accuracy.md says what the JSON holds.
nlohmann::json runErrorExperiment(const ExperimentOptions& options);

// Specialised kernels against one general kernel, alternating; SPIR-V instructions of both; bytes on the device that a
// scene asks for, and bytes that it does not.
nlohmann::json runKernelExperiment(const ExperimentOptions& options);

// What 20 ranges cull of each volume's stored subblocks: by masks of uniform bins, of bins cut at quantiles, by minimum
// and maximum, by these together; "truth": subblocks without any voxel in the range. Shares of all. Needs no device.
nlohmann::json runMaskExperiment(const ExperimentOptions& options);

// The experiments of Derin et al. 2021, Wald et al. 2021 and Lukic 2017, on procedural stand-ins of the same
// proportions and on `files`. paper_runs.h says what a run's JSON holds, docs/experiments/ what came of it.
nlohmann::json runPaperBlocks(const ExperimentOptions& options);
nlohmann::json runPaperBoundary(const ExperimentOptions& options);
nlohmann::json runPaperOctree(const ExperimentOptions& options);

// One view of each of `files`, none of the procedural volumes; `width` and `height` are the view's. frames: {"volumes":
// [{"file", "resident_bytes", "variants": {NAME: {"median_ms", "min_ms", "queries", ...}}}]}, every finder, walk and
// cull. refine: {"volumes": [{"file", "at_once", "in_steps": {"first_ms", "drawn_ms", "encoded_ms"}, "first_ratio",
// "drawn_ratio", "encoded_ratio"}]}, the view's samples drawn at once and in steps.
nlohmann::json runFrameExperiment(const ExperimentOptions& options, const ImageRequest& request);
nlohmann::json runRefineExperiment(const ExperimentOptions& options, const ImageRequest& request);

}  // namespace blockwalk::bench
