// SPDX-License-Identifier: Apache-2.0
#include "volume/import/unread_format.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "volume/error.h"
#include "volume/import/header_bytes.h"
#include "volume/import/header_text.h"
#include "volume/import/sniff.h"

namespace blockwalk {
namespace {

using std::string_view_literals::operator""sv;

constexpr std::size_t kStartBytes = 1024;

std::string startOf(const InputFile& file) {
  std::string start(kStartBytes, '\0');
  start.resize(file.readSome(0, std::as_writable_bytes(std::span(start))));
  return start;
}

bool has(std::string_view start, std::size_t at, std::string_view word) {
  return start.size() >= at + word.size() && start.substr(at, word.size()) == word;
}

HeaderBytes numbers(std::string_view start, std::endian order) { return {std::as_bytes(std::span(start)), order}; }

// The brand of an ISO base media file; empty where it is none.
std::string_view brandOf(std::string_view start) { return has(start, 4, "ftyp") ? start.substr(8, 4) : ""sv; }

bool isHeif(const InputFile& /*file*/, std::string_view start) {
  const std::string_view brand = brandOf(start);
  for (const std::string_view known :
       {"heic", "heix", "heim", "heis", "hevc", "hevx", "hevm", "hevs", "mif1", "mif2", "msf1"}) {
    if (brand == known) return true;
  }
  return false;
}

bool isAvif(const InputFile& /*file*/, std::string_view start) {
  return brandOf(start) == "avif" || brandOf(start) == "avis";
}

// MP4 and QuickTime, Matroska and WebM, AVI, MPEG program streams, Ogg.
bool isVideo(const InputFile& /*file*/, std::string_view start) {
  if (start.size() < 12) return false;
  if (has(start, 4, "ftyp") || has(start, 4, "moov")) return true;
  if (start.starts_with("RIFF")) return has(start, 8, "AVI ");
  return start.starts_with("\x1a\x45\xdf\xa3") || start.starts_with("\0\0\1\xba"sv) || start.starts_with("OggS");
}

bool isCzi(const InputFile& /*file*/, std::string_view start) { return start.starts_with("ZISRAWFILE"); }

// A block of XML: its mark, its length, the mark of a text and how many letters of two bytes that has.
bool isLif(const InputFile& /*file*/, std::string_view start) {
  return start.starts_with("\x70\0\0\0"sv) && has(start, 8, "\x2a") && has(start, 13, "<\0"sv);
}

// Its first chunk has a mark and a name; before 2006 it was JPEG 2000.
bool isNd2(const InputFile& /*file*/, std::string_view start) {
  return start.starts_with("\xda\xce\xbe\x0a") && has(start, 16, "ND2 FILE SIGNATURE");
}

bool isCompound(std::string_view start) { return start.starts_with("\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"); }

// The names of a compound file lie in sectors of 2 to the power of what its header says; OIB always has this one.
bool isOib(const InputFile& file, std::string_view start) {
  if (!isCompound(start) || start.size() < 52) return false;
  const HeaderBytes header = numbers(start, std::endian::little);
  const std::uint32_t shift = header.u32(28) >> 16;
  if (shift < 7 || shift > 16) return false;
  std::string names(std::size_t{1} << 14, '\0');
  const std::uint64_t at = (std::uint64_t{header.u32(48)} + 1) << shift;
  names.resize(at < file.bytes() ? file.readSome(at, std::as_writable_bytes(std::span(names))) : 0);
  return names.find("O\0i\0b\0I\0n\0f\0o\0.\0t\0x\0t\0"sv) != std::string::npos;
}

bool isOtherCompound(const InputFile& /*file*/, std::string_view start) { return isCompound(start); }

bool isOir(const InputFile& /*file*/, std::string_view start) { return start.starts_with("OLYMPUSRAWFORMAT"); }

bool isFits(std::string_view start) { return start.starts_with("SIMPLE  = "); }

bool isPlainFits(const InputFile& /*file*/, std::string_view start) { return isFits(start); }

bool isLegacyVtk(const InputFile& /*file*/, std::string_view start) {
  return start.starts_with("# vtk DataFile Version");
}

bool isVti(const InputFile& /*file*/, std::string_view start) {
  const std::size_t root = start.find("<VTKFile");
  return trimmed(start).starts_with('<') && root != std::string_view::npos &&
         start.find("\"ImageData\"", root) != std::string_view::npos;
}

bool isClassicNetCdf(std::string_view start) {
  return start.starts_with("CDF\1") || start.starts_with("CDF\2") || start.starts_with("CDF\5");
}

// Its variables say of themselves that they are MINC's, somewhere in the header.
bool isMinc(const InputFile& file, std::string_view start) {
  if (!isClassicNetCdf(start)) return false;
  const std::vector<std::byte> bytes = firstBytes(file, std::size_t{1} << 16);
  const std::string_view header(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return header.find("MNI MINC") != std::string_view::npos || header.find("MINC Version") != std::string_view::npos;
}

bool isNetCdf(const InputFile& /*file*/, std::string_view start) { return isClassicNetCdf(start); }

bool isJxlBox(const InputFile& /*file*/, std::string_view start) {
  return start.starts_with("\0\0\0\x0cJXL \r\n\x87\n"sv);
}

bool isExr(const InputFile& /*file*/, std::string_view start) { return start.starts_with("\x76\x2f\x31\x01"); }

bool is7z(const InputFile& /*file*/, std::string_view start) { return start.starts_with("7z\xbc\xaf\x27\x1c"); }

bool isRar(const InputFile& /*file*/, std::string_view start) { return start.starts_with("Rar!\x1a\x07"); }

// The sum of a header's bytes stands in it, as if its own 8 were blanks.
bool startsLikeTar(std::string_view start) {
  constexpr std::size_t kHeader = 512;
  constexpr std::size_t kSum = 148;
  if (start.size() < kHeader || start[0] == '\0') return false;
  std::uint64_t sum = 8 * ' ';
  for (std::size_t i = 0; i < kHeader; ++i) {
    if (i < kSum || i >= kSum + 8) sum += static_cast<unsigned char>(start[i]);
  }
  std::uint64_t said = 0;
  bool has_digit = false;
  for (const char letter : start.substr(kSum, 8)) {
    if (letter == ' ' && !has_digit) continue;
    if (letter < '0' || letter > '7') break;
    said = 8 * said + static_cast<std::uint64_t>(letter - '0');
    has_digit = true;
  }
  return has_digit && said == sum;
}

bool isTar(const InputFile& /*file*/, std::string_view start) { return startsLikeTar(start); }

std::string unpackedStart(const InputFile& file) {
  const std::vector<std::byte> bytes = firstBytes(file, kStartBytes);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

bool isPackedTar(const InputFile& file, std::string_view /*start*/) {
  return startsLikeGzip(file, 0) && startsLikeTar(unpackedStart(file));
}

bool isPackedFits(const InputFile& file, std::string_view /*start*/) {
  return startsLikeGzip(file, 0) && isFits(unpackedStart(file));
}

// Version 1, four sizes and a type of values, big endian; .mgz is the same packed with gzip.
bool isMgh(const InputFile& file, std::string_view /*start*/) {
  const std::string start = unpackedStart(file);
  if (start.size() < 284) return false;
  const HeaderBytes header = numbers(start, std::endian::big);
  if (header.i32(0) != 1) return false;
  for (std::size_t i = 1; i <= 4; ++i) {
    if (header.i32(4 * i) < 1 || header.i32(4 * i) > (1 << 20)) return false;
  }
  const std::int32_t type = header.i32(20);
  return type == 0 || type == 1 || type == 3 || type == 4 || type == 10;
}

// Version, length of what follows, byte order; then whether the first group is sorted and open.
bool isDigitalMicrograph(std::string_view start, std::uint32_t version, std::size_t order_at) {
  if (start.size() < order_at + 6 || !start.starts_with("\0\0\0"sv)) return false;
  const HeaderBytes header = numbers(start, std::endian::big);
  const auto flag = [&](std::size_t at) { return start[at] == '\0' || start[at] == '\1'; };
  return header.u32(0) == version && header.u32(order_at) <= 1 && flag(order_at + 4) && flag(order_at + 5);
}

bool isDm3(const InputFile& /*file*/, std::string_view start) { return isDigitalMicrograph(start, 3, 8); }
bool isDm4(const InputFile& /*file*/, std::string_view start) { return isDigitalMicrograph(start, 4, 12); }

bool isJxlStream(const InputFile& /*file*/, std::string_view start) { return start.starts_with("\xff\x0a"); }

// Its length, two words of 0, where the pixels begin, and the length of the header of one of its versions.
bool isBmp(const InputFile& file, std::string_view start) {
  if (start.size() < 26 || !start.starts_with("BM") || !has(start, 6, "\0\0\0\0"sv)) return false;
  const HeaderBytes header = numbers(start, std::endian::little);
  if (header.u32(10) < 26 || header.u32(10) > file.bytes()) return false;
  for (const std::uint32_t known : {12U, 40U, 52U, 56U, 64U, 108U, 124U}) {
    if (header.u32(14) == known) return true;
  }
  return false;
}

bool isBzip2(const InputFile& /*file*/, std::string_view start) {
  return start.starts_with("BZh") && (has(start, 4, "1AY&SY") || has(start, 4, "\x17rE8P\x90"));
}
bool isXz(const InputFile& /*file*/, std::string_view start) {
  return start.starts_with(
      "\xfd"
      "7zXZ\0"sv);
}
bool isZstd(const InputFile& /*file*/, std::string_view start) { return start.starts_with("\x28\xb5\x2f\xfd"); }

constexpr std::string_view kToOmeZarr = "bioformats2raw {file} {stem}.zarr";
constexpr std::string_view kToOmeTiff = "bfconvert {file} {stem}.ome.tif";
constexpr std::string_view kFitsToNpy =
    "python3 -c \"import numpy, sys; from astropy.io import fits; numpy.save(sys.argv[2], fits.getdata(sys.argv[1]))\" "
    "{file} {stem}.npy";
constexpr std::string_view kItkToNrrd =
    "python3 -c \"import itk, sys; itk.imwrite(itk.imread(sys.argv[1]), sys.argv[2])\" {file} {stem}.nrrd";
constexpr std::string_view kVtiToMeta =
    "python3 -c \"import sys, vtk; r = vtk.vtkXMLImageDataReader(); r.SetFileName(sys.argv[1]); "
    "w = vtk.vtkMetaImageWriter(); w.SetInputConnection(r.GetOutputPort()); w.SetFileName(sys.argv[2]); w.Write()\" "
    "{file} {stem}.mhd";

// HEIF before video, which begins alike; MINC before other netCDF, OIB before other compound files.
constexpr UnreadFormat kSure[] = {
    {"a HEIC picture (HEIF)", "turn it into a picture", "magick {file} {stem}.png", isHeif},
    {"an AVIF picture", "turn it into a picture", "ffmpeg -i {file} {stem}.png", isAvif},
    {"a video", "turn it into slices", "ffmpeg -i {file} slice%05d.png", isVideo},
    {"a CZI file of Zeiss", "turn it into OME-Zarr", kToOmeZarr, isCzi},
    {"a LIF file of Leica", "turn it into OME-Zarr", kToOmeZarr, isLif},
    {"an ND2 file of Nikon", "turn it into OME-Zarr", kToOmeZarr, isNd2},
    {"an OIB file of Olympus", "turn it into OME-Zarr", kToOmeZarr, isOib},
    {"a compound file, as ZVI of Zeiss is one", "turn it into OME-TIFF", kToOmeTiff, isOtherCompound},
    {"an OIR file of Olympus", "turn it into OME-Zarr", kToOmeZarr, isOir},
    {"a FITS file", "turn it into npy", kFitsToNpy, isPlainFits},
    {"a legacy VTK file", "turn it into NRRD", kItkToNrrd, isLegacyVtk},
    {"a VTI file of VTK", "turn it into MetaImage", kVtiToMeta, isVti},
    {"a MINC 1 file", "turn it into NIfTI", "mnc2nii {file} {stem}.nii", isMinc},
    {"a classic netCDF file", "turn it into netCDF-4", "nccopy -k nc4 {file} {stem}.nc4", isNetCdf},
    {"a JPEG XL picture", "turn it into a picture", "djxl {file} {stem}.png", isJxlBox},
    {"an OpenEXR picture", "turn it into TIFF", "oiiotool {file} -o {stem}.tif", isExr},
    {"a 7z archive", "unpack it", "7z x {file}", is7z},
    {"a RAR archive", "unpack it", "7z x {file}", isRar},
    {"a tar archive", "unpack it", "tar xf {file}", isTar}};

constexpr UnreadFormat kLikely[] = {
    {"a tar archive packed with gzip", "unpack it", "tar xzf {file}", isPackedTar},
    {"a FITS file packed with gzip", "turn it into npy", kFitsToNpy, isPackedFits},
    {"an MGH file of FreeSurfer", "turn it into NIfTI", "mri_convert {file} {stem}.nii.gz", isMgh},
    {"a DM3 file of Gatan DigitalMicrograph", "turn it into OME-TIFF", kToOmeTiff, isDm3},
    {"a DM4 file of Gatan DigitalMicrograph", "turn it into OME-TIFF", kToOmeTiff, isDm4},
    {"a BMP picture", "turn it into a picture", "ffmpeg -i {file} {stem}.png", isBmp},
    {"packed with bzip2", "unpack it", "bunzip2 -k {file}", isBzip2},
    {"packed with xz", "unpack it", "xz -dk {file}", isXz},
    {"packed with zstd", "unpack it", "zstd -d {file} -o {stem}", isZstd},
    {"a JPEG XL picture", "turn it into a picture", "djxl {file} {stem}.png", isJxlStream}};

const UnreadFormat* firstOf(std::span<const UnreadFormat> formats, const InputFile& file, std::string_view start) {
  for (const UnreadFormat& format : formats) {
    if (format.begins(file, start)) return &format;
  }
  return nullptr;
}

// As a shell takes it for one word.
std::string quoted(const std::string& word) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._+-=%@,/";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char letter : word) text += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
  return text + "'";
}

}  // namespace

const UnreadFormat* surelyUnread(const InputFile& file, std::string_view start) { return firstOf(kSure, file, start); }

const UnreadFormat* likelyUnread(const InputFile& file, std::string_view start) {
  return firstOf(kLikely, file, start);
}

std::string unreadMessage(const InputFile& file) {
  const std::string start = startOf(file);
  const UnreadFormat* format = surelyUnread(file, start);
  if (format == nullptr) format = likelyUnread(file, start);
  if (format == nullptr) failData("{}: was another file when it was opened", file.name());
  // A name that begins with a dash is no option of the command.
  const std::string name = file.name().starts_with('-') ? "./" + file.name() : file.name();
  const std::string command =
      fmt::format(fmt::runtime(format->command), fmt::arg("file", quoted(name)),
                  fmt::arg("stem", quoted(std::filesystem::path(name).replace_extension().string())));
  return fmt::format("{}: is {}, which is not read; {}: {}", file.name(), format->name, format->advice, command);
}

}  // namespace blockwalk
