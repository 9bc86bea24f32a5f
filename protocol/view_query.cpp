// SPDX-License-Identifier: Apache-2.0
// The way back: a request as the query string that gives it.
#include "protocol/view_fields.h"
#include "protocol/view_values.h"

namespace blockwalk {
namespace {

class QueryWriter {
 public:
  void add(std::string_view name, std::string_view text) {
    if (!query_.empty()) query_ += '&';
    query_.append(name).append("=").append(text);
  }
  std::string take() { return std::move(query_); }

 private:
  std::string query_;
};

void addCamera(QueryWriter& query, const View& view) {
  if (view.eye) query.add("eye", vectorText(*view.eye));
  if (view.target) query.add("target", vectorText(*view.target));
  if (view.up) query.add("up", vectorText(*view.up));
  if (view.ortho_height) {
    query.add("ortho", numberText(*view.ortho_height));
  } else if (view.fov_degrees != View{}.fov_degrees) {
    query.add("fov", numberText(view.fov_degrees));
  }
}

void addVolume(QueryWriter& query, const View& view) {
  const View plain;
  if (view.range) query.add("range", numberText(view.range->lo) + ":" + numberText(view.range->hi));
  if (view.mode == Mode::first_hit) query.add("mode", "first-hit");
  if (view.mode == Mode::blocks) query.add("mode", "blocks");
  if (view.extinction != plain.extinction) query.add("extinction", numberText(view.extinction));
  if (!view.transfer.empty()) query.add("tf", transferText(view.transfer));
  if (view.clip) query.add("clip", vectorText(view.clip->min) + "," + vectorText(view.clip->max));
  if (view.level != kAutoLevel) query.add("level", std::to_string(view.level));
  if (view.background != plain.background) query.add("background", colorText(view.background));
}

}  // namespace

std::string viewQuery(const ImageRequest& request) {
  const ImageRequest plain;
  const View& view = request.view;
  QueryWriter query;
  if (view.width != plain.view.width || view.height != plain.view.height) {
    query.add("size", std::to_string(view.width) + "x" + std::to_string(view.height));
  }
  addCamera(query, view);
  addVolume(query, view);
  if (view.finder == Finder::query) query.add("finder", "query");
  if (view.finder == Finder::grid) query.add("finder", "grid");
  if (!view.walk) query.add("walk", "off");
  if (!view.cull) query.add("cull", "off");
  if (request.format == ImageFormat::jpeg) query.add("format", "jpeg");
  if (request.format == ImageFormat::raw) query.add("format", "raw");
  if (request.quality != plain.quality) query.add("quality", std::to_string(request.quality));
  return query.take();
}

}  // namespace blockwalk
