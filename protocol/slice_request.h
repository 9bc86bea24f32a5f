// SPDX-License-Identifier: Apache-2.0
// Which plane of a volume is asked for, as a picture or as values.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/query_member.h"
#include "protocol/view_fields.h"
#include "volume/export/export.h"
#include "volume/slice/slice.h"

namespace blockwalk {

inline constexpr std::array kSliceMembers = {
    QueryMember{"axis", "x|y|z", "the axis that is cut; else a plane by centre, right, down, pixel and size"},
    QueryMember{"index", "N", "with axis: the voxel of level 0 along it"},
    QueryMember{"box", "x0,y0,z0,x1,y1,z1",
                "with axis: voxels of level 0 that the picture has along the two others (all)"},
    QueryMember{"centre", "x,y,z", "of a plane: world position of the picture's centre"},
    QueryMember{"right", "x,y,z", "of a plane: world direction of its rows"},
    QueryMember{"down", "x,y,z", "of a plane: world direction of its columns, made perpendicular to right"},
    QueryMember{"pixel", "S", "of a plane: world size of a pixel"},
    QueryMember{"size", "WxH", "of a plane: pixels, 1..8192 each"},
    QueryMember{"filter", "nearest|linear",
                "of a plane: the voxel that a sample lies in, or between centres (nearest)"},
    QueryMember{"thickness", "N", "of the slab: with axis voxels of level 0 (1), of a plane world units (0)"},
    QueryMember{"reduce", "max|min|mean", "what a pixel has of the slab (max)"},
    QueryMember{
        "level", "auto|N",
        "resolution level (auto: the finest of at most 2048 pixels a side; of a plane the coarsest whose voxels "
        "are no larger than a pixel)"},
    QueryMember{"time", "N", "step in time of a volume that has several, counted from 0 (0)"},
    QueryMember{"channels", "0,2,...", "channels of the volume, in this order (all)"},
    QueryMember{"format", "png|webp|npy|raw|nrrd", "a picture, or values in the volume's own type (png)"},
    QueryMember{"window", "lo:hi[;...]",
                "pictures: black and white, data units; one a channel (auto: quantiles 0.35 and 99.8 %)"},
    QueryMember{"gamma", "G[;...]", "pictures: exponent between black and white, 0.01..100; one a channel (1)"},
    QueryMember{"colors", "rrggbb[;...]",
                "pictures: of white; one a channel (auto: white, of several channels their own)"},
    QueryMember{"tf", "value:rrggbb:opacity,...|PRESET[;...]",
                "pictures: colours at values instead of window, gamma and colors, opacity ignored; one a channel"}};

// How one channel is shown. What is absent is chosen for the volume.
struct SliceLook {
  std::optional<DensityRange> window;  // data units
  std::optional<double> gamma;
  std::optional<Color> color;
  bool operator==(const SliceLook&) const = default;
};

struct SliceRequest {
  SliceCut cut;
  int time = 0;
  std::string format = "png";  // or "webp", "npy", "raw", "nrrd"
  std::array<SliceLook, kMaxChannels> looks;
  bool has_transfer = false;                                 // then `transfer` goes before the looks
  std::array<ChannelView, kMaxChannels> transfer;            // transfer functions alone
  std::vector<std::pair<std::string, std::string>> members;  // as they were given, by name

  bool isPicture() const { return format == "png" || format == "webp"; }
};

// From the members of a query. Throws ViewError naming the member and the bound: unknown, repeated, missing, of
// something else that is asked for, or out of bounds whatever the volume is.
SliceRequest readSliceRequest(const std::vector<std::pair<std::string, std::string>>& members);

// How one channel of the plan is shown: by its transfer function where it has one, else in the color times
// ((value - lo) / (hi - lo))^gamma.
struct ChannelLook {
  std::vector<TransferPoint> transfer;
  DensityRange window;
  double gamma = 1;
  glm::dvec3 color{1};
};

// With every choice made for one volume.
struct ResolvedSlice {
  SlicePlan plan;
  std::string format;
  std::vector<ChannelLook> looks;  // one a channel of the plan; none of rgba8, and of values
  bool isPicture() const { return format == "png" || format == "webp"; }
};

// Throws ViewError where the volume has not what is asked for.
ResolvedSlice resolveSlice(const SliceRequest& request, const VolumeInfo& info);

std::string_view sliceMimeType(std::string_view format);

// {"level", "width", "height", "channels", "type", "corner", "right", "down", "through", "thickness", "window"?}: what
// a reply says of itself beside its body; `type` is the values'.
nlohmann::json sliceJson(const ResolvedSlice& slice, std::string_view type);

}  // namespace blockwalk
