// SPDX-License-Identifier: Apache-2.0
// Voxels of a volume's file for replies, a piece at a time, while the client takes them. Nothing of the device is
// used. Each region has a file, records and a buffer of its own, so there are few at once; their pieces take turns on
// one thread, and frames go on beside it.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocol/region_request.h"
#include "server/region/block_cache.h"
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

// Belongs to the socket thread, but for the work.
class RegionMaker {
 public:
  static constexpr int kMost = 8;
  static constexpr int kMostOfPeer = 4;

  RegionMaker(Mailbox& mailbox, boost::asio::thread_pool& threads) : mailbox_(mailbox), threads_(threads) {}

  // One of those that are open, as long as the lease lives; null when there are as many as may be.
  std::shared_ptr<void> lease(std::uint64_t peer);

  // `error` is a ProblemError where the file is not what it was.
  boost::asio::awaitable<OpenedRegion> open(RegionOrder order);
  boost::asio::awaitable<RegionPiece> next(std::shared_ptr<Region> region);

 private:
  Mailbox& mailbox_;
  std::shared_ptr<BlockCache> blocks_ = std::make_shared<BlockCache>();
  boost::asio::thread_pool& threads_;
  std::shared_ptr<std::map<std::uint64_t, int>> open_ = std::make_shared<std::map<std::uint64_t, int>>();  // by peer
};

}  // namespace blockwalk
