// SPDX-License-Identifier: Apache-2.0
#include "server/voxel_routes.h"

#include "protocol/pick_request.h"
#include "protocol/query_string.h"
#include "protocol/region_request.h"
#include "protocol/slice_request.h"

namespace blockwalk {
namespace {

// Questions that are drawn to be answered.
void requireJson(const Asked& asked) {
  if (!acceptsType(asked.request, kJson)) refuse(406, "this path has application/json", "Accept");
}

}  // namespace

RouteResult answerRegion(const Asked& asked) {
  const HttpRequest& request = asked.request;
  const CatalogEntry& entry = asked.volume();
  const RegionRequest region = readRegionRequest(readQuery(request));
  const ServedVolume& volume = requireReady(entry, asked.state);
  const std::uint64_t bytes = regionBytes(*volume.info, region, volume.id);
  const std::uint64_t most = asked.state.options.max_region;
  if (bytes > most) {
    refuse(413, fmt::format("the region has {} bytes, of which a reply has at most {}", bytes, most), "box");
  }
  const std::string type = region.format == "nrrd" ? "application/x-nrrd" : "application/octet-stream";
  if (!acceptsType(request, type)) refuse(406, fmt::format("this region is {}", type), "Accept");
  const std::string content = fmt::format("{}|{}|{}", BLOCKWALK_VERSION, volume.identity, regionQuery(region));
  const std::string etag = fmt::format("\"{}\"", contentTag(content));
  if (matchesTag(request, etag)) return *replyWithout(request, etag, type);
  return RegionJob{.order = {.file = entry.file, .identity = volume.identity, .id = volume.id, .request = region},
                   .type = type,
                   .etag = etag};
}

RouteResult answerSlice(const Asked& asked) {
  const HttpRequest& request = asked.request;
  const CatalogEntry& entry = asked.volume();
  const SliceRequest wanted = readSliceRequest(readQuery(request));
  const ServedVolume& volume = requireReady(entry, asked.state);
  ResolvedSlice slice = resolveSlice(wanted, *volume.info);
  const std::uint64_t bytes = slice.plan.pixels() * slice.plan.channels.size() * voxelBytes(volume.info->type);
  const std::uint64_t most = asked.state.options.max_region;
  if (!slice.isPicture() && bytes > most) {
    refuse(413, fmt::format("the slice has {} bytes, of which a reply has at most {}", bytes, most), "level");
  }
  const std::string_view type = sliceMimeType(slice.format);
  if (!acceptsType(request, type)) refuse(406, fmt::format("this slice is {}", type), "Accept");
  const std::string content =
      fmt::format("{}|{}|slice?{}", BLOCKWALK_VERSION, volume.identity, queryText(wanted.members));
  const std::string etag = fmt::format("\"{}\"", contentTag(content));
  if (auto reply = replyWithout(request, etag, type)) return *reply;
  return Question(SliceJob{.order = {.served = {.file = entry.file, .identity = volume.identity, .id = volume.id},
                                     .step = wanted.time,
                                     .slice = std::move(slice)},
                           .etag = etag});
}

RouteResult answerExplain(const Asked& asked) {
  const CatalogEntry& entry = asked.volume();
  ImageRequest image;
  setViewFields(image, readQuery(asked.request));
  const ServedVolume& volume = requireReady(entry, asked.state);
  resolveView(image.view, *volume.info);  // the view that is asked about is to blame, not the small one
  requireJson(asked);
  return Question(ExplainJob{.volume = entry.served, .view = resolveView(smallPicture(image.view), *volume.info)});
}

RouteResult answerPick(const Asked& asked) {
  const CatalogEntry& entry = asked.volume();
  const PickRequest pick = readPickRequest(readQuery(asked.request));
  const ServedVolume& volume = requireReady(entry, asked.state);
  ResolvedView view = resolveView(pick.view, *volume.info);
  requireJson(asked);
  return Question(PickJob{.volume = entry.served,
                          .view = std::move(view),
                          .pixel = pick.pixel,
                          .file = {.file = entry.file, .identity = volume.identity, .id = volume.id}});
}

}  // namespace blockwalk
