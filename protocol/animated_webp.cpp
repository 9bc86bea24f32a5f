// SPDX-License-Identifier: Apache-2.0
#include "protocol/animated_webp.h"

#include <webp/encode.h>
#include <webp/mux.h>

#include <cmath>
#include <new>

#include "protocol/view_fields.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

struct FreePicture {
  void operator()(WebPPicture* picture) const { WebPPictureFree(picture); }
};

struct ClearData {
  void operator()(WebPData* data) const { WebPDataClear(data); }
};

}  // namespace

struct AnimatedWebp::State {
  struct DeleteEncoder {
    void operator()(WebPAnimEncoder* made) const { WebPAnimEncoderDelete(made); }
  };
  int width = 0;
  int height = 0;
  double frame_ms = 0;
  int frames = 0;
  WebPConfig config{};
  std::unique_ptr<WebPAnimEncoder, DeleteEncoder> encoder;

  int timestamp() const { return static_cast<int>(std::lround(frames * frame_ms)); }
};

AnimatedWebp::AnimatedWebp(int width, int height, double fps, int quality) : state_(std::make_unique<State>()) {
  state_->width = width;
  state_->height = height;
  state_->frame_ms = 1000 / fps;
  WebPAnimEncoderOptions options;
  if (WebPConfigInit(&state_->config) == 0 || WebPAnimEncoderOptionsInit(&options) == 0) {
    failData("webp: this libwebp is not the one that was built against");
  }
  if (quality == kLosslessWebp) {
    WebPConfigLosslessPreset(&state_->config, 1);
    state_->config.exact = 1;
  } else {
    state_->config.quality = static_cast<float>(quality);
    state_->config.method = 2;
  }
  state_->encoder.reset(WebPAnimEncoderNew(width, height, &options));
  if (!state_->encoder) throw std::bad_alloc();
}

AnimatedWebp::~AnimatedWebp() = default;

void AnimatedWebp::add(std::span<const std::uint32_t> pixels) {
  BLOCKWALK_CHECK(pixels.size(), ==,
                  static_cast<std::size_t>(state_->width) * static_cast<std::size_t>(state_->height));
  WebPPicture picture;
  if (WebPPictureInit(&picture) == 0) failData("webp: this libwebp is not the one that was built against");
  const std::unique_ptr<WebPPicture, FreePicture> kept(&picture);
  picture.width = state_->width;
  picture.height = state_->height;
  picture.use_argb = 1;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(pixels.data());
  if (WebPPictureImportRGBA(&picture, bytes, picture.width * 4) == 0) throw std::bad_alloc();
  if (WebPAnimEncoderAdd(state_->encoder.get(), &picture, state_->timestamp(), &state_->config) == 0) {
    failData("webp: {}", WebPAnimEncoderGetError(state_->encoder.get()));
  }
  ++state_->frames;
}

std::vector<std::byte> AnimatedWebp::finish() {
  WebPData data;
  WebPDataInit(&data);
  const std::unique_ptr<WebPData, ClearData> kept(&data);
  if (WebPAnimEncoderAdd(state_->encoder.get(), nullptr, state_->timestamp(), nullptr) == 0 ||
      WebPAnimEncoderAssemble(state_->encoder.get(), &data) == 0) {
    failData("webp: {}", WebPAnimEncoderGetError(state_->encoder.get()));
  }
  const auto* begin = reinterpret_cast<const std::byte*>(data.bytes);
  return {begin, begin + data.size};
}

}  // namespace blockwalk
