// SPDX-License-Identifier: Apache-2.0
#include <turbojpeg.h>

#include <memory>
#include <utility>

#include "volume/error.h"
#include "volume/import/slices/picture_file.h"

namespace blockwalk {
namespace {

struct EndJpeg {
  void operator()(void* handle) const { tjDestroy(handle); }
};

class JpegPicture final : public PictureFile {
 public:
  explicit JpegPicture(PackedPicture packed) : packed_(std::move(packed)), handle_(tjInitDecompress()) {
    if (!handle_) throw std::bad_alloc();
    int subsampling = 0;
    int space = 0;
    if (tjDecompressHeader3(handle_.get(), data(), packed_.bytes.size(), &shape_.width, &shape_.height, &subsampling,
                            &space) != 0) {
      fail();
    }
    if (space == TJCS_CMYK || space == TJCS_YCCK)
      failData("{}: JPEG: its colours are CMYK, which cannot be read", packed_.name);
    shape_.format = {.type = SampleType::u8, .channels = space == TJCS_GRAY ? 1 : 3};
    // Progressive files are held as coefficients of 16 bits.
    checkPicture(packed_, shape_.width, shape_.height, shape_.format, 4);
  }

  SliceShape shape() const override { return shape_; }
  int pictures() const override { return 1; }
  void readNext(std::span<std::byte> out) override {
    const int format = shape_.format.channels == 1 ? TJPF_GRAY : TJPF_RGB;
    const int done =
        tjDecompress2(handle_.get(), data(), packed_.bytes.size(), reinterpret_cast<unsigned char*>(out.data()),
                      shape_.width, 0, shape_.height, format, TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING);
    if (done != 0) fail();
  }

 private:
  const unsigned char* data() const { return reinterpret_cast<const unsigned char*>(packed_.bytes.data()); }
  [[noreturn]] void fail() const { failData("{}: JPEG: {}", packed_.name, tjGetErrorStr2(handle_.get())); }

  PackedPicture packed_;
  std::unique_ptr<void, EndJpeg> handle_;
  SliceShape shape_;
};

}  // namespace

std::unique_ptr<PictureFile> openJpeg(PackedPicture packed) { return std::make_unique<JpegPicture>(std::move(packed)); }

}  // namespace blockwalk
