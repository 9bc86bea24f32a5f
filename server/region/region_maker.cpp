// SPDX-License-Identifier: Apache-2.0
#include "server/region/region_maker.h"

#include <boost/asio/post.hpp>
#include <utility>

#include "protocol/problem.h"
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

ServedFile servedOf(const RegionOrder& order) {
  return {.file = order.file, .identity = order.identity, .id = order.id};
}

}  // namespace

std::uint64_t regionBytes(const VolumeInfo& info, const RegionRequest& request, const std::string& id) {
  if (request.time >= info.steps) {
    throw ViewError("time", fmt::format("{} is not within 0..{}, the volume's steps", request.time, info.steps - 1));
  }
  try {
    return measureExport(info, exportOptions(request), id);
  } catch (const ExportError& error) {
    throw ViewError(error.field, error.what());
  }
}

class Region {
 public:
  Region(const RegionOrder& order, std::shared_ptr<BlockCache> blocks)
      : order_(order),
        blocks_(std::move(blocks)),
        file_(openStep(order.file, order.request.time)),
        stream_(file_, exportOptions(order.request)) {
    requireIdentity(servedOf(order));  // looked at when it is open: another one under its name would have been opened
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

OpenedRegion openRegion(const RegionOrder& order, const std::shared_ptr<BlockCache>& blocks) noexcept {
  OpenedRegion opened;
  try {
    requireIdentity(servedOf(order));
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

class RegionBody final : public ReplyBody {
 public:
  RegionBody(RegionMaker& regions, std::shared_ptr<Region> region) : regions_(regions), region_(std::move(region)) {}
  const char* name() const override { return "a region"; }
  asio::awaitable<BodyPiece> next(std::shared_ptr<std::atomic<bool>> /*cancel*/) override {
    RegionPiece piece = co_await regions_.next(region_);
    BodyPiece body;
    body.bytes = ownBytes(std::move(piece.bytes));
    body.error = piece.error;
    co_return body;
  }

 private:
  RegionMaker& regions_;
  std::shared_ptr<Region> region_;
};

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

std::unique_ptr<ReplyBody> bodyOf(RegionMaker& regions, std::shared_ptr<Region> region) {
  return std::make_unique<RegionBody>(regions, std::move(region));
}

asio::awaitable<OpenedRegion> RegionMaker::open(RegionOrder order) {
  const auto work = [this, &order](Answer<OpenedRegion> answer) {
    asio::post(threads_, [answer = std::move(answer), order, blocks = blocks_] { answer(openRegion(order, blocks)); });
  };
  co_return co_await awaitResult<OpenedRegion>(mailbox_, work);
}

asio::awaitable<VoxelValues> RegionMaker::values(VoxelOrder order) {
  const auto work = [this, &order](Answer<VoxelValues> answer) {
    asio::post(threads_, [answer = std::move(answer), order, blocks = blocks_] { answer(readVoxel(order, *blocks)); });
  };
  co_return co_await awaitResult<VoxelValues>(mailbox_, work);
}

asio::awaitable<ReadSlice> RegionMaker::slice(SliceOrder order, std::shared_ptr<std::atomic<bool>> cancel) {
  const auto slice = std::make_shared<SliceWork>(std::move(order), blocks_);
  SliceStep last;
  while (!last.is_done) {
    if (cancel->load()) co_return ReadSlice{};
    const auto work = [this, &slice](Answer<SliceStep> answer) {
      asio::post(threads_, [answer = std::move(answer), slice] { answer(slice->step()); });
    };
    last = co_await awaitResult<SliceStep>(mailbox_, work);
    if (last.error) co_return ReadSlice{.slice = nullptr, .error = last.error};
  }
  co_return ReadSlice{.slice = slice, .error = nullptr};
}

asio::awaitable<RegionPiece> RegionMaker::next(std::shared_ptr<Region> region) {
  const auto work = [this, &region](Answer<RegionPiece> answer) {
    asio::post(threads_, [answer = std::move(answer), region] { answer(nextPiece(*region)); });
  };
  co_return co_await awaitResult<RegionPiece>(mailbox_, work);
}

}  // namespace blockwalk
