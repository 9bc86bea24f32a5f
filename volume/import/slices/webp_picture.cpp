// SPDX-License-Identifier: Apache-2.0
#include <webp/demux.h>

#include <cstring>
#include <memory>
#include <utility>

#include "volume/error.h"
#include "volume/import/slices/picture_file.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

struct EndDecoder {
  void operator()(WebPAnimDecoder* decoder) const { WebPAnimDecoderDelete(decoder); }
};

// Pictures of an animation are the whole canvas, each with what it leaves of those before. The decoder gives RGBA.
class WebpPicture final : public PictureFile {
 public:
  explicit WebpPicture(PackedPicture packed) : packed_(std::move(packed)) {
    const WebPData data{reinterpret_cast<const std::uint8_t*>(packed_.bytes.data()), packed_.bytes.size()};
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(data.bytes, data.size, &features) != VP8_STATUS_OK) fail("the header is broken");
    shape_.width = features.width;
    shape_.height = features.height;
    shape_.format = {.type = SampleType::u8, .channels = features.has_alpha != 0 ? 4 : 3};
    checkPicture(packed_, features.width, features.height, shape_.format, 4);  // two canvases, and what is unpacked
    decoder_.reset(WebPAnimDecoderNew(&data, nullptr));
    WebPAnimInfo info;
    if (!decoder_ || WebPAnimDecoderGetInfo(decoder_.get(), &info) == 0) fail("it cannot be unpacked");
    if (info.frame_count < 1 || info.frame_count > kMaxDim) {
      fail(fmt::format("{} pictures are outside 1..{}", info.frame_count, kMaxDim));
    }
    pictures_ = static_cast<int>(info.frame_count);
  }

  SliceShape shape() const override { return shape_; }
  int pictures() const override { return pictures_; }
  void readNext(std::span<std::byte> out) override {
    std::uint8_t* canvas = nullptr;
    int time = 0;
    if (WebPAnimDecoderGetNext(decoder_.get(), &canvas, &time) == 0) fail("a picture is broken");
    const auto samples = static_cast<std::size_t>(shape_.format.channels);
    const std::byte* from = reinterpret_cast<const std::byte*>(canvas);
    for (std::size_t at = 0; at < out.size(); at += samples, from += 4) std::memcpy(&out[at], from, samples);
  }

 private:
  [[noreturn]] void fail(const std::string& why) const { failData("{}: WebP: {}", packed_.name, why); }

  PackedPicture packed_;
  std::unique_ptr<WebPAnimDecoder, EndDecoder> decoder_;
  SliceShape shape_;
  int pictures_ = 1;
};

}  // namespace

std::unique_ptr<PictureFile> openWebp(PackedPicture packed) { return std::make_unique<WebpPicture>(std::move(packed)); }

}  // namespace blockwalk
