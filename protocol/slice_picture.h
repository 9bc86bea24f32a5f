// SPDX-License-Identifier: Apache-2.0
// What a slice looks like: values in colours.
#pragma once

#include <cstddef>
#include <vector>

#include "protocol/slice_request.h"
#include "view/frame.h"

namespace blockwalk {

// Channels add up. Transparent where no channel has a finite number: outside of the volume, and where nothing stored is
// finite; a label that is empty is no number either. rgba8: the colours and opacities as they are. Straight rgba8.
Frame slicePicture(const VolumeInfo& info, const ResolvedSlice& slice, const SlicePixels& pixels);

// The body of a reply or a file: a picture (webp lossless), or values (volume/slice/slice_bytes.h). `file` is of the
// step.
std::vector<std::byte> encodeSlice(const VolumeFile& file, const ResolvedSlice& slice, const SlicePixels& pixels);

}  // namespace blockwalk
