// SPDX-License-Identifier: Apache-2.0
// The renderer's door: a device, volumes resident on it, and frames. No Vulkan types here.
//
// One Renderer and its volumes belong to one thread, but for cancel flags, which any thread may set.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "view/device_info.h"
#include "view/device_options.h"
#include "view/frame.h"
#include "view/frame_order.h"
#include "view/resident_part.h"
#include "volume/file/file.h"

namespace blockwalk {

// A volume that frames can be ordered of. Parts of it become resident when a frame needs them, and give way when memory
// is short and no frame does.
class ResidentVolume {
 public:
  virtual ~ResidentVolume() = default;
  virtual const VolumeInfo& info() const = 0;
  virtual std::uint64_t deviceBytes() const = 0;
  virtual std::vector<ResidentPart> parts() const = 0;
};

// A frame under way. It is drawn piece by piece, so that several frames may take turns on one device; what a piece
// leaves is the frame's own. It must end before its volume and its renderer do.
class FrameInProgress {
 public:
  virtual ~FrameInProgress() = default;
  // One piece: of what has to become resident, or a band's samples; about DeviceOptions::band_ms of device time. True
  // while there is more to do. Throws as begin() does; then the frame is given up.
  virtual bool advance() = 0;
  // There is no room for what it needs beside what other frames under way use; it has let go of its own. It can go on
  // once one of those has ended, or let go; advance() before that refuses it, with OutOfDeviceMemory, or where only
  // voxels find no room, draws it with those that are there.
  virtual bool waits() const = 0;
  // The frame, once advance() said that there is no more; `cancelled` where the order was.
  virtual Frame finish() = 0;
};

class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual DeviceInfo device() const = 0;
  // Takes the file, and reads no more of it. What a first view needs becomes resident by an order that is
  // `prepare_only`; errors in the file show then.
  virtual std::unique_ptr<ResidentVolume> load(VolumeFile file) = 0;
  // Of a volume that this renderer has loaded. Throws ViewError for the view, DataError for a broken file, DeviceError
  // for the device: OutOfDeviceMemory where what the view needs does not fit beside what frames under way use.
  virtual std::unique_ptr<FrameInProgress> begin(ResidentVolume& volume, FrameOrder order) = 0;

  // One of every kind of part.
  virtual std::vector<PartTotal> parts() const { return {}; }
  // Whoever refined as this owner (SampleStep) does not any more.
  virtual void forget(std::uint64_t) {}

  // All pieces at once.
  Frame render(ResidentVolume& volume, FrameOrder order) {
    const std::unique_ptr<FrameInProgress> frame = begin(volume, std::move(order));
    while (frame->advance()) {
    }
    return frame->finish();
  }
  // Of a view that is not resolved; the order's own is not looked at.
  Frame render(ResidentVolume& volume, const View& view, FrameOrder order = {}) {
    order.view = resolveView(view, volume.info());
    return render(volume, std::move(order));
  }
};

std::unique_ptr<Renderer> createRenderer(const DeviceOptions& options);

}  // namespace blockwalk
