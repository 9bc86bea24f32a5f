// SPDX-License-Identifier: Apache-2.0
// JPEG, JPEG 2000, WebP and GIF files, made by the libraries that others use.
#pragma once

#include <gif_lib.h>
#include <openjpeg.h>
#include <turbojpeg.h>
#include <webp/encode.h>
#include <webp/mux.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace blockwalk {

inline void require(bool is_done) {
  if (!is_done) std::abort();
}

// `samples` a pixel: 1 grey, 3 RGB.
inline std::string jpegFile(const std::string& pixels, int width, int height, int samples, bool is_progressive) {
  void* handle = tjInitCompress();
  unsigned char* packed = nullptr;
  unsigned long size = 0;
  const int format = samples == 1 ? TJPF_GRAY : TJPF_RGB;
  const int done =
      tjCompress2(handle, reinterpret_cast<const unsigned char*>(pixels.data()), width, 0, height, format, &packed,
                  &size, samples == 1 ? TJSAMP_GRAY : TJSAMP_444, 100, is_progressive ? TJFLAG_PROGRESSIVE : 0);
  require(done == 0);
  std::string file(reinterpret_cast<const char*>(packed), size);
  tjFree(packed);
  tjDestroy(handle);
  return file;
}

// Without loss; `samples` 3 RGB, 4 RGBA.
inline std::string webpFile(const std::string& pixels, int width, int height, int samples) {
  std::uint8_t* packed = nullptr;
  const auto* from = reinterpret_cast<const std::uint8_t*>(pixels.data());
  const std::size_t size = samples == 3 ? WebPEncodeLosslessRGB(from, width, height, 3 * width, &packed)
                                        : WebPEncodeLosslessRGBA(from, width, height, 4 * width, &packed);
  std::string file(reinterpret_cast<const char*>(packed), size);
  WebPFree(packed);
  return file;
}

// An animation of RGBA pictures, without loss.
inline std::string webpAnimation(const std::vector<std::string>& pictures, int width, int height) {
  WebPAnimEncoder* encoder = WebPAnimEncoderNew(width, height, nullptr);
  WebPConfig config;
  require(WebPConfigInit(&config) != 0);
  config.lossless = 1;
  config.exact = 1;
  int time = 0;
  for (const std::string& pixels : pictures) {
    WebPPicture picture;
    require(WebPPictureInit(&picture) != 0);
    picture.use_argb = 1;
    picture.width = width;
    picture.height = height;
    require(WebPPictureImportRGBA(&picture, reinterpret_cast<const std::uint8_t*>(pixels.data()), 4 * width) != 0);
    require(WebPAnimEncoderAdd(encoder, &picture, time, &config) != 0);
    WebPPictureFree(&picture);
    time += 100;
  }
  require(WebPAnimEncoderAdd(encoder, nullptr, time, nullptr) != 0);
  WebPData data;
  WebPDataInit(&data);
  require(WebPAnimEncoderAssemble(encoder, &data) != 0);
  std::string file(reinterpret_cast<const char*>(data.bytes), data.size);
  WebPDataClear(&data);
  WebPAnimEncoderDelete(encoder);
  return file;
}

struct GifImage {
  int left = 0;
  int top = 0;
  int width = 0;
  int height = 0;
  std::string pixels = {};  // indices of the palette
  int disposal = DISPOSAL_UNSPECIFIED;
  int transparent = NO_TRANSPARENT_COLOR;
  bool is_interlaced = false;
};

// `palette`: 4 colours.
inline std::string gifFile(int width, int height, const std::array<GifColorType, 4>& palette,
                           const std::vector<GifImage>& images) {
  std::string file;
  const auto append = [](GifFileType* gif, const GifByteType* bytes, int count) {
    static_cast<std::string*>(gif->UserData)->append(reinterpret_cast<const char*>(bytes), static_cast<size_t>(count));
    return count;
  };
  GifFileType* gif = EGifOpen(&file, append, nullptr);
  EGifSetGifVersion(gif, true);
  ColorMapObject* colors = GifMakeMapObject(4, palette.data());
  require(EGifPutScreenDesc(gif, width, height, 2, 0, colors) == GIF_OK);
  for (const GifImage& image : images) {
    const GraphicsControlBlock control{
        .DisposalMode = image.disposal, .UserInputFlag = false, .DelayTime = 10, .TransparentColor = image.transparent};
    std::array<GifByteType, 4> extension{};
    EGifGCBToExtension(&control, extension.data());
    require(EGifPutExtension(gif, GRAPHICS_EXT_FUNC_CODE, 4, extension.data()) == GIF_OK);
    require(EGifPutImageDesc(gif, image.left, image.top, image.width, image.height, image.is_interlaced, nullptr) ==
            GIF_OK);
    std::vector<GifPixelType> pixels(image.pixels.begin(), image.pixels.end());
    for (int row = 0; row < image.height; ++row) {
      require(EGifPutLine(gif, pixels.data() + row * image.width, image.width) == GIF_OK);
    }
  }
  GifFreeMapObject(colors);
  require(EGifCloseFile(gif, nullptr) == GIF_OK);
  return file;
}

// Without loss; samples voxel after voxel.
inline std::string jpeg2000File(const std::vector<int>& samples, unsigned width, unsigned height, unsigned components,
                                unsigned bits, bool is_signed, bool is_bare = false) {
  opj_cparameters_t parameters;
  opj_set_default_encoder_parameters(&parameters);
  parameters.numresolution = 1;
  parameters.tcp_numlayers = 1;
  parameters.cp_disto_alloc = 1;
  std::vector<opj_image_cmptparm_t> parts(components);
  for (opj_image_cmptparm_t& part : parts) {
    part = {};
    part.dx = part.dy = 1;
    part.w = width;
    part.h = height;
    part.prec = bits;
    part.sgnd = is_signed ? 1 : 0;
  }
  opj_image_t* image = opj_image_create(components, parts.data(), components >= 3 ? OPJ_CLRSPC_SRGB : OPJ_CLRSPC_GRAY);
  image->x1 = width;
  image->y1 = height;
  for (std::size_t i = 0; i < samples.size(); ++i) image->comps[i % components].data[i / components] = samples[i];
  opj_codec_t* codec = opj_create_compress(is_bare ? OPJ_CODEC_J2K : OPJ_CODEC_JP2);
  require(opj_setup_encoder(codec, &parameters, image) != OPJ_FALSE);
  struct Out {
    std::string bytes;
    std::size_t position = 0;
  } out;
  opj_stream_t* stream = opj_stream_create(std::size_t{1} << 16, OPJ_FALSE);
  opj_stream_set_user_data(stream, &out, nullptr);
  opj_stream_set_write_function(stream, [](void* bytes, OPJ_SIZE_T count, void* user) {
    auto& to = *static_cast<Out*>(user);
    if (to.bytes.size() < to.position + count) to.bytes.resize(to.position + count);
    std::memcpy(&to.bytes[to.position], bytes, count);
    to.position += count;
    return count;
  });
  opj_stream_set_skip_function(stream, [](OPJ_OFF_T count, void* user) {
    static_cast<Out*>(user)->position += static_cast<std::size_t>(count);
    return count;
  });
  opj_stream_set_seek_function(stream, [](OPJ_OFF_T position, void* user) {
    static_cast<Out*>(user)->position = static_cast<std::size_t>(position);
    return static_cast<OPJ_BOOL>(OPJ_TRUE);
  });
  require(opj_start_compress(codec, image, stream) != OPJ_FALSE);
  require(opj_encode(codec, stream) != OPJ_FALSE);
  require(opj_end_compress(codec, stream) != OPJ_FALSE);
  opj_stream_destroy(stream);
  opj_destroy_codec(codec);
  opj_image_destroy(image);
  return out.bytes;
}

}  // namespace blockwalk
