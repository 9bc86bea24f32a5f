// SPDX-License-Identifier: Apache-2.0
// The way back: a request as the query string that gives it.
#include "protocol/view_choices.h"
#include "protocol/view_fields.h"
#include "protocol/view_values.h"

namespace blockwalk {
namespace {

class QueryWriter {
 public:
  void add(std::string_view name, std::string_view text) {
    if (!query_.empty()) query_ += '&';
    query_.append(name).append("=");
    for (char c : text) query_ += c == '+' ? std::string_view("%2B") : std::string_view(&c, 1);  // 1e+30: + is a space
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

// One item a channel up to the last that is not the default.
template <typename ItemText>
void addChannels(QueryWriter& query, std::string_view name, const View& view, ItemText itemText) {
  std::string text;
  std::string between;
  for (const ChannelView& channel : view.channels) {
    const std::string item = itemText(channel);
    if (!item.empty()) {
      text += between + item;
      between.clear();
    }
    between += ';';
  }
  if (!text.empty()) query.add(name, text);
}

std::string transferItem(const ChannelView& channel) {
  if (!channel.transfer.empty()) return transferText(channel.transfer);
  if (channel.transfer_preset == TransferPreset::automatic) return {};
  return std::string(choiceName(channel.transfer_preset, kTransferPresetChoices));
}

void addVolume(QueryWriter& query, const View& view) {
  const View plain;
  if (!view.drawn.empty()) query.add("channels", channelsText(view.drawn));
  addChannels(query, "range", view,
              [](const ChannelView& channel) { return channel.range ? rangeText(*channel.range) : std::string(); });
  if (view.mode != plain.mode) query.add("mode", choiceName(view.mode, kModeChoices));
  if (view.filter != plain.filter) query.add("filter", choiceName(view.filter, kFilterChoices));
  if (view.step != plain.step) query.add("step", numberText(view.step));
  if (view.classification != plain.classification) {
    query.add("classification", choiceName(view.classification, kClassificationChoices));
  }
  if (view.extinction != plain.extinction) query.add("extinction", numberText(view.extinction));
  if (view.attenuation != plain.attenuation) query.add("attenuation", numberText(view.attenuation));
  addChannels(query, "tf", view, transferItem);
  if (view.transfer_shape != plain.transfer_shape) {
    query.add("tf-shape", choiceName(view.transfer_shape, kTransferShapeChoices));
  }
  if (view.termination != plain.termination) query.add("termination", numberText(view.termination));
  if (view.lit) query.add("lit", "on");
  if (view.lights != plain.lights) query.add("light", lightsText(view.lights));
  if (view.key_light != plain.key_light) query.add("key-light", vectorText(view.key_light));
  if (view.shadow) query.add("shadow", "on");
  if (view.occlusion != plain.occlusion) query.add("occlusion", numberText(view.occlusion));
  if (view.aperture != plain.aperture) query.add("aperture", numberText(view.aperture));
  if (view.focus != plain.focus) query.add("focus", numberText(view.focus));
  if (view.iso) query.add("iso", numberText(*view.iso));
  if (view.clip) query.add("clip", vectorText(view.clip->min) + "," + vectorText(view.clip->max));
  if (!view.planes.empty()) query.add("planes", planesText(view.planes));
  if (view.level != kAutoLevel) query.add("level", std::to_string(view.level));
  if (view.time != plain.time) query.add("time", std::to_string(view.time));
  if (view.lod != plain.lod) query.add("lod", view.lod == kOneLevel ? "off" : numberText(view.lod));
  if (view.lod_alpha != plain.lod_alpha) query.add("lod-alpha", numberText(view.lod_alpha));
  if (view.requests != plain.requests) query.add("requests", choiceName(view.requests, kRequestsChoices));
  if (view.stand_in != plain.stand_in) query.add("stand-in", choiceName(view.stand_in, kStandInChoices));
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
  if (view.finder != plain.view.finder) query.add("finder", choiceName(view.finder, kFinderChoices));
  if (view.macrocell != plain.view.macrocell) {
    query.add("macrocell", choiceName(view.macrocell, kMacrocellChoices));
  }
  if (!view.walk) query.add("walk", "off");
  if (!view.cull) query.add("cull", "off");
  if (view.output != plain.view.output) query.add("output", choiceName(view.output, kOutputChoices));
  if (view.samples != plain.view.samples) query.add("samples", std::to_string(view.samples));
  if (request.format != plain.format) query.add("format", choiceName(request.format, kFormatChoices));
  if (request.quality != plain.quality) query.add("quality", std::to_string(request.quality));
  return query.take();
}

}  // namespace blockwalk
