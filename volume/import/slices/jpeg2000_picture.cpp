// SPDX-License-Identifier: Apache-2.0
#include <openjpeg.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>

#include "volume/error.h"
#include "volume/import/slices/picture_file.h"

namespace blockwalk {
namespace {

struct EndCodec {
  void operator()(opj_codec_t* codec) const { opj_destroy_codec(codec); }
};
struct EndStream {
  void operator()(opj_stream_t* stream) const { opj_stream_destroy(stream); }
};
struct EndImage {
  void operator()(opj_image_t* image) const { opj_image_destroy(image); }
};

struct StreamState {
  const PackedPicture* packed;
  std::size_t position = 0;
};

OPJ_SIZE_T readStream(void* out, OPJ_SIZE_T count, void* user) {
  auto* state = static_cast<StreamState*>(user);
  const std::size_t taken = std::min<std::size_t>(count, state->packed->bytes.size() - state->position);
  if (taken == 0) return static_cast<OPJ_SIZE_T>(-1);
  std::memcpy(out, state->packed->bytes.data() + state->position, taken);
  state->position += taken;
  return taken;
}

OPJ_OFF_T skipStream(OPJ_OFF_T count, void* user) {
  auto* state = static_cast<StreamState*>(user);
  const auto left = static_cast<OPJ_OFF_T>(state->packed->bytes.size() - state->position);
  if (count < 0 || count > left) return -1;
  state->position += static_cast<std::size_t>(count);
  return count;
}

OPJ_BOOL seekStream(OPJ_OFF_T position, void* user) {
  auto* state = static_cast<StreamState*>(user);
  if (position < 0 || static_cast<std::uint64_t>(position) > state->packed->bytes.size()) return OPJ_FALSE;
  state->position = static_cast<std::size_t>(position);
  return OPJ_TRUE;
}

void keepFault(const char* text, void* user) {
  auto& message = *static_cast<std::string*>(user);
  if (!message.empty()) return;
  message = text;
  while (!message.empty() && (message.back() == '\n' || message.back() == ' ')) message.pop_back();
}
void dropText(const char*, void*) {}

// Grey or RGB, maybe with opacity, all of one precision and none of them coarser than the others.
class Jpeg2000Picture final : public PictureFile {
 public:
  explicit Jpeg2000Picture(PackedPicture packed) : packed_(std::move(packed)) {
    constexpr std::byte kCodestream{0xff};
    codec_.reset(opj_create_decompress(packed_.bytes[0] == kCodestream ? OPJ_CODEC_J2K : OPJ_CODEC_JP2));
    stream_.reset(opj_stream_create(std::size_t{1} << 16, OPJ_TRUE));
    if (!codec_ || !stream_) throw std::bad_alloc();
    opj_set_error_handler(codec_.get(), keepFault, &fault_);
    opj_set_warning_handler(codec_.get(), keepFault, &fault_);
    opj_set_info_handler(codec_.get(), dropText, nullptr);
    state_.packed = &packed_;
    opj_stream_set_user_data(stream_.get(), &state_, nullptr);
    opj_stream_set_user_data_length(stream_.get(), packed_.bytes.size());
    opj_stream_set_read_function(stream_.get(), readStream);
    opj_stream_set_skip_function(stream_.get(), skipStream);
    opj_stream_set_seek_function(stream_.get(), seekStream);
    opj_dparameters_t parameters;
    opj_set_default_decoder_parameters(&parameters);
    if (opj_setup_decoder(codec_.get(), &parameters) == OPJ_FALSE) fail();
    opj_image_t* image = nullptr;
    const bool is_read = opj_read_header(stream_.get(), codec_.get(), &image) != OPJ_FALSE;
    image_.reset(image);
    if (!is_read || !image_) fail();
    readShape();
  }

  SliceShape shape() const override { return shape_; }
  int pictures() const override { return 1; }
  void readNext(std::span<std::byte> out) override {
    fault_.clear();
    // What is cut short is unpacked with a warning, and would be grey where nothing is.
    if (opj_decode(codec_.get(), stream_.get(), image_.get()) == OPJ_FALSE || !fault_.empty()) fail();
    checkMeaning();
    const auto count = static_cast<std::size_t>(shape_.format.channels);
    const std::size_t bytes = sampleBytes(shape_.format.type);
    const std::size_t pixels = out.size() / (count * bytes);
    for (std::size_t c = 0; c < count; ++c) {
      const opj_image_comp_t& part = image_->comps[c];
      if (part.data == nullptr || static_cast<std::size_t>(part.w) * part.h != pixels) fail();
      for (std::size_t i = 0; i < pixels; ++i) {
        // The lowest bytes of a number of 32 bits: little endian.
        std::memcpy(&out[(i * count + c) * bytes], &part.data[i], bytes);
      }
    }
  }

 private:
  [[noreturn]] void fail() const {
    failData("{}: JPEG 2000: {}", packed_.name, fault_.empty() ? "it cannot be unpacked" : fault_);
  }

  // What is known only now: a palette has made colours of indices, or the colours are no RGB.
  void checkMeaning() const {
    if (image_->numcomps != static_cast<std::uint32_t>(shape_.format.channels)) {
      failData("{}: JPEG 2000: it has a palette, which cannot be read", packed_.name);
    }
    const bool is_other = image_->color_space == OPJ_CLRSPC_SYCC || image_->color_space == OPJ_CLRSPC_EYCC ||
                          image_->color_space == OPJ_CLRSPC_CMYK;
    if (is_other) failData("{}: JPEG 2000: its colours are neither grey nor RGB, which cannot be read", packed_.name);
  }

  void readShape() {
    const std::uint32_t count = image_->numcomps;
    if (count < 1 || count > 4) failData("{}: JPEG 2000: {} components are outside 1..4", packed_.name, count);
    const opj_image_comp_t& first = image_->comps[0];
    for (std::uint32_t c = 0; c < count; ++c) {
      const opj_image_comp_t& part = image_->comps[c];
      if (part.dx != 1 || part.dy != 1 || part.w != first.w || part.h != first.h || part.prec != first.prec ||
          part.sgnd != first.sgnd) {
        failData("{}: JPEG 2000: its components are of several sizes or precisions, which cannot be read",
                 packed_.name);
      }
    }
    if (first.prec < 1 || first.prec > 32)
      failData("{}: JPEG 2000: {} bits are outside 1..32", packed_.name, first.prec);
    const bool is_signed = first.sgnd != 0;
    SampleFormat format{.channels = static_cast<int>(count)};
    format.type = first.prec <= 8    ? (is_signed ? SampleType::i8 : SampleType::u8)
                  : first.prec <= 16 ? (is_signed ? SampleType::i16 : SampleType::u16)
                                     : (is_signed ? SampleType::i32 : SampleType::u32);
    shape_.format = format;
    // It holds 32 bits a sample, twice.
    checkPicture(packed_, first.w, first.h, format, static_cast<int>(8 / sampleBytes(format.type)) + 1);
    shape_.width = static_cast<int>(first.w);
    shape_.height = static_cast<int>(first.h);
  }

  PackedPicture packed_;
  StreamState state_{};
  std::string fault_;
  std::unique_ptr<opj_codec_t, EndCodec> codec_;
  std::unique_ptr<opj_stream_t, EndStream> stream_;
  std::unique_ptr<opj_image_t, EndImage> image_;
  SliceShape shape_;
};

}  // namespace

std::unique_ptr<PictureFile> openJpeg2000(PackedPicture packed) {
  return std::make_unique<Jpeg2000Picture>(std::move(packed));
}

}  // namespace blockwalk
