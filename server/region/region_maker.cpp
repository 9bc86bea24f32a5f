// SPDX-License-Identifier: Apache-2.0
#include "server/region/region_maker.h"

#include <boost/asio/post.hpp>
#include <utility>

#include "protocol/problem.h"
#include "server/base/file_look.h"
#include "server/base/volume_error.h"
#include "server/render/await_result.h"
#include "server/render/render_thread.h"
#include "view/view.h"
#include "volume/export/export_stream.h"
#include "volume/file/file.h"

namespace blockwalk {
namespace {

ExportOptions exportOptions(const RegionRequest& request) {
  return {.format = exportFormat(request.format).value_or(ExportFormat::nrrd),
          .level = request.level,
          .box = request.box,
          .channels = request.channels};
}

void requireIdentity(const RegionOrder& order) {
  const FileLook look = lookAt(order.file);
  if (look.identity == order.identity) return;
  const std::string why = look.missing.empty() ? "was replaced" : look.is_gone ? "is gone" : "cannot be looked at";
  throw ProblemError({.status = 503, .detail = fmt::format("{}: the file {}", order.id, why), .field = {}});
}

}  // namespace

std::uint64_t regionBytes(const VolumeInfo& info, const RegionRequest& request, const std::string& id) {
  try {
    return measureExport(info, exportOptions(request), id);
  } catch (const ExportError& error) {
    throw ViewError(error.field, error.what());
  }
}

class Region {
 public:
  Region(const RegionOrder& order, std::shared_ptr<BlockCache> blocks)
      : order_(order), blocks_(std::move(blocks)), file_(order.file), stream_(file_, exportOptions(order.request)) {
    requireIdentity(order);  // looked at when it is open: another one under its name would have been opened
  }

  const ExportStream& stream() const { return stream_; }
  std::vector<std::byte> next() {
    if (blocks_ != nullptr) stream_.useBlocks(blocks_->of(file_, order_.identity, order_.request.level));
    blocks_ = nullptr;
    return stream_.next();
  }

 private:
  RegionOrder order_;
  std::shared_ptr<BlockCache> blocks_;  // until they were asked for
  VolumeFile file_;
  ExportStream stream_;
};

namespace {

// Has the counts in common, as coroutines may be destroyed after all else.
class Lease {
 public:
  Lease(std::shared_ptr<std::map<std::uint64_t, int>> open, std::uint64_t peer) : open_(std::move(open)), peer_(peer) {
    ++(*open_)[peer_];
  }
  ~Lease() {
    const auto entry = open_->find(peer_);
    if (--entry->second == 0) open_->erase(entry);
  }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;

 private:
  std::shared_ptr<std::map<std::uint64_t, int>> open_;
  std::uint64_t peer_;
};

OpenedRegion openRegion(const RegionOrder& order, const std::shared_ptr<BlockCache>& blocks) noexcept {
  OpenedRegion opened;
  try {
    requireIdentity(order);
    opened.region = std::make_shared<Region>(order, blocks);
    const ExportStream& stream = opened.region->stream();
    opened.bytes = stream.bytes();
    opened.dims = stream.dims();
    opened.channels = stream.channels();
    opened.type = stream.type();
  } catch (const ProblemError&) {
    opened.error = std::current_exception();
  } catch (const DataError& error) {
    opened.error = std::make_exception_ptr(VolumeError(withoutFolder(error.what(), order.file)));
  } catch (...) {
    opened.error = std::current_exception();
  }
  return opened;
}

RegionPiece nextPiece(Region& region) noexcept {
  RegionPiece piece;
  try {
    piece.bytes = region.next();
  } catch (...) {
    piece.error = std::current_exception();
  }
  return piece;
}

}  // namespace

std::shared_ptr<void> RegionMaker::lease(std::uint64_t peer) {
  int all = 0;
  for (const auto& [other, count] : *open_) all += count;
  const auto own = open_->find(peer);
  if (all >= kMost || (own != open_->end() && own->second >= kMostOfPeer)) return nullptr;
  return std::make_shared<Lease>(open_, peer);
}

asio::awaitable<OpenedRegion> RegionMaker::open(RegionOrder order) {
  const auto work = [this, &order](Answer<OpenedRegion> answer) {
    asio::post(threads_, [answer = std::move(answer), order, blocks = blocks_] { answer(openRegion(order, blocks)); });
  };
  co_return co_await awaitResult<OpenedRegion>(mailbox_, work);
}

asio::awaitable<RegionPiece> RegionMaker::next(std::shared_ptr<Region> region) {
  const auto work = [this, &region](Answer<RegionPiece> answer) {
    asio::post(threads_, [answer = std::move(answer), region] { answer(nextPiece(*region)); });
  };
  co_return co_await awaitResult<RegionPiece>(mailbox_, work);
}

}  // namespace blockwalk
