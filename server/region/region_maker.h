// SPDX-License-Identifier: Apache-2.0
// Voxels of a volume's file for replies, a piece at a time, while the client takes them. Nothing of the device is
// used. Each region has a file, records and a buffer of its own, so there are few at once; their pieces take turns on
// one thread, and frames go on beside it.
#pragma once

#include <atomic>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "protocol/region_request.h"
#include "server/base/peer_places.h"
#include "server/base/reply_body.h"
#include "server/region/block_cache.h"
#include "server/region/slice_work.h"
#include "server/region/voxel_values.h"
#include "server/render/mailbox.h"
#include "volume/volume.h"

namespace blockwalk {

struct RegionOrder {
  std::filesystem::path file;
  std::string identity;  // that the file must still have
  std::string id;        // of the volume, for messages
  RegionRequest request;
};

// Bytes of the voxels that are asked for, without a header. Throws ViewError where the volume has them not.
std::uint64_t regionBytes(const VolumeInfo& info, const RegionRequest& request, const std::string& id);

class Region;  // a reply under way

struct OpenedRegion {
  std::shared_ptr<Region> region;
  std::uint64_t bytes = 0;
  // What the voxels are: sides, channels one after the other, type: u8, i8, u16, i16, f32 or rgba8.
  glm::ivec3 dims{0};
  std::size_t channels = 1;
  std::string type;
  std::exception_ptr error;
};

struct RegionPiece {
  std::vector<std::byte> bytes;  // none at the end
  std::exception_ptr error;
};

struct ReadSlice {
  std::shared_ptr<SliceWork> slice;  // to be encoded; null where it was cancelled
  std::exception_ptr error;
};

class RegionMaker;
// The region's voxels, from their first.
std::unique_ptr<ReplyBody> bodyOf(RegionMaker& regions, std::shared_ptr<Region> region);

// Belongs to the socket thread, but for the work.
class RegionMaker {
 public:
  static constexpr int kMost = 8;
  static constexpr int kMostOfPeer = 4;

  RegionMaker(Mailbox& mailbox, boost::asio::thread_pool& threads) : mailbox_(mailbox), threads_(threads) {}

  // One of those that are open, as long as the lease lives; null when there are as many as may be.
  std::shared_ptr<void> lease(std::uint64_t peer) { return places_.lease(peer); }

  // `error` is a ProblemError where the file is not what it was.
  boost::asio::awaitable<OpenedRegion> open(RegionOrder order);
  boost::asio::awaitable<RegionPiece> next(std::shared_ptr<Region> region);
  boost::asio::awaitable<VoxelValues> values(VoxelOrder order);
  // Reads it, in turns with all others; `cancel` ends it between two of them.
  boost::asio::awaitable<ReadSlice> slice(SliceOrder order, std::shared_ptr<std::atomic<bool>> cancel);

 private:
  Mailbox& mailbox_;
  std::shared_ptr<BlockCache> blocks_ = std::make_shared<BlockCache>();
  boost::asio::thread_pool& threads_;
  PeerPlaces places_{kMost, kMostOfPeer};
};

}  // namespace blockwalk
