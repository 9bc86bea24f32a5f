// SPDX-License-Identifier: Apache-2.0
#include <gif_lib.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/slices/picture_file.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

struct GifBytes {
  const PackedPicture* packed;
  std::size_t position = 0;
};

int readGif(GifFileType* gif, GifByteType* out, int count) {
  auto* bytes = static_cast<GifBytes*>(gif->UserData);
  const std::size_t left = bytes->packed->bytes.size() - bytes->position;
  const std::size_t taken = std::min(left, static_cast<std::size_t>(std::max(count, 0)));
  std::memcpy(out, bytes->packed->bytes.data() + bytes->position, taken);
  bytes->position += taken;
  return static_cast<int>(taken);
}

struct EndGif {
  void operator()(GifFileType* gif) const { DGifCloseFile(gif, nullptr); }
};

// What a picture leaves behind for the next (GIF89a, 23, disposal method).
enum class Disposal { keep, clear, restore };

// Pictures are the whole screen, each drawn over what those before left. They are grey where all palettes are, and
// have opacity where some pixel may have none.
class GifPicture final : public PictureFile {
 public:
  explicit GifPicture(PackedPicture packed) : packed_(std::move(packed)) {
    open();
    shape_.width = gif_->SWidth;
    shape_.height = gif_->SHeight;
    shape_.format = {.type = SampleType::u8, .channels = 4};
    checkPicture(packed_, shape_.width, shape_.height, shape_.format, 3);
    bool is_grey = true;
    bool is_opaque = true;
    while (toNextImage()) {
      if (++pictures_ > kMaxDim) failData("{}: GIF: more than {} pictures", packed_.name, kMaxDim);
      is_grey = is_grey && isGrey(colorsOf(checkedPlace()));
      is_opaque = is_opaque && transparent_ == NO_TRANSPARENT_COLOR && disposal_ != Disposal::clear &&
                  (pictures_ > 1 || coversScreen(gif_->Image));
      skipImage();
    }
    if (is_opaque) shape_.format.channels = is_grey ? 1 : 3;
    if (pictures_ == 0) failData("{}: GIF: holds no picture", packed_.name);
    open();
    screen_.resize(cellCount({shape_.width, shape_.height, 1}) * kPixelBytes);
  }

  SliceShape shape() const override { return shape_; }
  int pictures() const override { return pictures_; }
  void readNext(std::span<std::byte> out) override {
    dispose();
    if (!toNextImage()) failData("{}: GIF: the next picture is not there", packed_.name);
    drawImage();
    const auto samples = static_cast<std::size_t>(shape_.format.channels);
    const std::byte* from = screen_.data();
    for (std::size_t at = 0; at < out.size(); at += samples, from += kPixelBytes) std::memcpy(&out[at], from, samples);
  }

 private:
  static constexpr std::size_t kPixelBytes = 4;

  [[noreturn]] void fail() const {
    const char* why = GifErrorString(gif_ != nullptr ? gif_->Error : error_);
    failData("{}: GIF: {}", packed_.name, why != nullptr ? why : "it is broken");
  }

  void open() {
    bytes_ = {.packed = &packed_};
    gif_.reset(DGifOpen(&bytes_, readGif, &error_));
    if (!gif_) fail();
  }

  // To the description of the next image, with what the blocks before say of it; false at the end.
  bool toNextImage() {
    disposal_ = Disposal::keep;
    transparent_ = NO_TRANSPARENT_COLOR;
    GifRecordType record = UNDEFINED_RECORD_TYPE;
    while (record != TERMINATE_RECORD_TYPE) {
      if (DGifGetRecordType(gif_.get(), &record) == GIF_ERROR) fail();
      if (record == IMAGE_DESC_RECORD_TYPE) {
        if (DGifGetImageDesc(gif_.get()) == GIF_ERROR) fail();
        return true;
      }
      if (record == EXTENSION_RECORD_TYPE) readExtension();
    }
    return false;
  }

  void readExtension() {
    int code = 0;
    GifByteType* block = nullptr;
    if (DGifGetExtension(gif_.get(), &code, &block) == GIF_ERROR) fail();
    while (block != nullptr) {
      GraphicsControlBlock control;
      if (code == GRAPHICS_EXT_FUNC_CODE && DGifExtensionToGCB(block[0], block + 1, &control) == GIF_OK) {
        transparent_ = control.TransparentColor;
        disposal_ = control.DisposalMode == DISPOSE_BACKGROUND ? Disposal::clear
                    : control.DisposalMode == DISPOSE_PREVIOUS ? Disposal::restore
                                                               : Disposal::keep;
      }
      if (DGifGetExtensionNext(gif_.get(), &block) == GIF_ERROR) fail();
    }
  }

  // libgif keeps a record of each image it has come to.
  GifImageDesc checkedPlace() const {
    const GifImageDesc& place = gif_->Image;
    if (place.Left < 0 || place.Top < 0 || place.Width < 1 || place.Height < 1 ||
        place.Left + place.Width > shape_.width || place.Top + place.Height > shape_.height) {
      failData("{}: GIF: a picture of {} x {} at {}, {} lies outside the screen of {} x {}", packed_.name, place.Width,
               place.Height, place.Left, place.Top, shape_.width, shape_.height);
    }
    return place;
  }

  const ColorMapObject& colorsOf(const GifImageDesc& place) const {
    const ColorMapObject* colors = place.ColorMap != nullptr ? place.ColorMap : gif_->SColorMap;
    if (colors == nullptr) failData("{}: GIF: a picture has no colours", packed_.name);
    return *colors;
  }

  static bool isGrey(const ColorMapObject& colors) {
    return std::all_of(colors.Colors, colors.Colors + colors.ColorCount,
                       [](const GifColorType& color) { return color.Red == color.Green && color.Green == color.Blue; });
  }

  bool coversScreen(const GifImageDesc& place) const {
    return place.Width == shape_.width && place.Height == shape_.height;
  }

  void skipImage() {
    int size = 0;
    GifByteType* block = nullptr;
    if (DGifGetCode(gif_.get(), &size, &block) == GIF_ERROR) fail();
    while (block != nullptr) {
      if (DGifGetCodeNext(gif_.get(), &block) == GIF_ERROR) fail();
    }
  }

  void drawImage() {
    const GifImageDesc place = checkedPlace();
    const ColorMapObject& colors = colorsOf(place);
    if (disposal_ == Disposal::restore) before_ = screen_;
    drawn_ = place;
    std::vector<GifPixelType> row(static_cast<std::size_t>(place.Width));
    // Interlaced: every eighth row, those between, and so on (GIF89a, appendix E).
    constexpr int kFirst[] = {0, 4, 2, 1};
    constexpr int kStep[] = {8, 8, 4, 2};
    for (int pass = 0; pass < (place.Interlace ? 4 : 1); ++pass) {
      const int step = place.Interlace ? kStep[pass] : 1;
      for (int y = place.Interlace ? kFirst[pass] : 0; y < place.Height; y += step) {
        if (DGifGetLine(gif_.get(), row.data(), place.Width) == GIF_ERROR) fail();
        drawRow(row, colors, place.Left, place.Top + y);
      }
    }
  }

  void drawRow(const std::vector<GifPixelType>& row, const ColorMapObject& colors, int left, int y) {
    std::byte* pixel = at(left, y);
    for (const GifPixelType index : row) {
      if (index != transparent_) {
        if (index >= colors.ColorCount) {
          failData("{}: GIF: colour {} is outside 0..{}", packed_.name, index, colors.ColorCount - 1);
        }
        const GifColorType& color = colors.Colors[index];
        pixel[0] = std::byte{color.Red};
        pixel[1] = std::byte{color.Green};
        pixel[2] = std::byte{color.Blue};
        pixel[3] = std::byte{255};
      }
      pixel += kPixelBytes;
    }
  }

  void dispose() {
    if (disposal_ == Disposal::restore && !before_.empty()) screen_ = before_;
    if (disposal_ != Disposal::clear) return;
    for (int y = drawn_.Top; y < drawn_.Top + drawn_.Height; ++y) {
      std::fill_n(at(drawn_.Left, y), static_cast<std::size_t>(drawn_.Width) * kPixelBytes, std::byte{0});
    }
  }

  std::byte* at(int x, int y) {
    return &screen_[(static_cast<std::size_t>(y) * static_cast<std::size_t>(shape_.width) +
                     static_cast<std::size_t>(x)) *
                    kPixelBytes];
  }

  PackedPicture packed_;
  GifBytes bytes_{};
  std::unique_ptr<GifFileType, EndGif> gif_;
  int error_ = 0;
  SliceShape shape_;
  int pictures_ = 0;
  std::vector<std::byte> screen_;
  std::vector<std::byte> before_;
  GifImageDesc drawn_{};
  Disposal disposal_ = Disposal::keep;
  int transparent_ = NO_TRANSPARENT_COLOR;
};

}  // namespace

std::unique_ptr<PictureFile> openGif(PackedPicture packed) { return std::make_unique<GifPicture>(std::move(packed)); }

}  // namespace blockwalk
