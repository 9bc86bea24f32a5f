// SPDX-License-Identifier: Apache-2.0
#include "volume/import/sniff.h"

#include <array>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "volume/error.h"
#include "volume/import/dicom/dicom_set.h"
#include "volume/import/grids/amira_header.h"
#include "volume/import/grids/esrf_vol.h"
#include "volume/import/grids/kvx.h"
#include "volume/import/grids/mrc.h"
#include "volume/import/grids/scanco.h"
#include "volume/import/header_text.h"
#include "volume/import/nifti/nifti_header.h"
#include "volume/import/packed_stream.h"
#include "volume/import/unread_format.h"

namespace blockwalk {
namespace {

// MetaImage has no magic: it is text whose first line is one of its fields.
bool startsLikeMetaImage(std::string_view text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) return false;
  const std::string_view key = trimmed(line.substr(0, equals));
  for (const std::string_view known :
       {"ObjectType", "NDims", "Comment", "ObjectSubType", "TransformType", "Name", "ID"}) {
    if (key == known) return text.find("NDims") != std::string_view::npos;
  }
  return false;
}

// JSON that begins with an object of one of its fields.
bool startsLikePrism(std::string_view text) {
  if (!trimmed(text).starts_with('{')) return false;
  for (const std::string_view known : {"\"bricks\"", "\"globalSize\"", "\"minLevel\"", "\"octree\""}) {
    if (text.find(known) != std::string_view::npos) return true;
  }
  return false;
}

// One file of a folder's metadata: JSON with the one field that all of them have.
bool startsLikeZarr(std::string_view text) {
  return trimmed(text).starts_with('{') && text.find("\"zarr_format\"") != std::string_view::npos;
}

// Text whose first line is the section of a volume.
bool startsLikeVgi(std::string_view text) {
  const std::string_view begin = trimmed(text);
  return begin.starts_with("{volume") || begin.starts_with("[representation]");
}

// The XML of BigDataViewer, whose images lie in a file of HDF5.
bool startsLikeSpimData(std::string_view text) {
  return trimmed(text).starts_with('<') && text.find("<SpimData") != std::string_view::npos;
}

// The signature stands at the beginning, or behind what another program put there: at 512, 1024, 2048 and so on.
bool startsLikeHdf5(const InputFile& file) {
  constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";
  std::string found(kSignature.size(), '\0');
  for (std::uint64_t at = 0; at + kSignature.size() <= file.bytes(); at = at == 0 ? 512 : 2 * at) {
    file.readSome(at, std::as_writable_bytes(std::span(found)));
    if (found == kSignature) return true;
  }
  return false;
}

}  // namespace

bool startsLikeGzip(const InputFile& file, std::uint64_t offset) {
  std::array<std::byte, 2> magic{};
  return file.readSome(offset, magic) == 2 && magic[0] == std::byte{0x1f} && magic[1] == std::byte{0x8b};
}

std::vector<std::byte> firstBytes(const InputFile& file, std::size_t count) {
  std::vector<std::byte> start(count);
  if (!startsLikeGzip(file, 0)) {
    start.resize(file.readSome(0, start));
    return start;
  }
  // The stream shares ownership of nothing here: `file` outlives it.
  const auto stream = openPacked(Packing::gzip, std::shared_ptr<const InputFile>(std::shared_ptr<void>(), &file), 0);
  try {
    start.resize(stream->read(start));
  } catch (const DataError&) {
    start.clear();  // packed, and broken so soon: nothing that is known
  }
  return start;
}

FileKind fileKind(const InputFile& file) {
  std::string start(1024, '\0');
  start.resize(file.readSome(0, std::as_writable_bytes(std::span(start))));
  const auto bytes = std::as_bytes(std::span(start));
  if (start.starts_with("NRRD000")) return FileKind::nrrd;
  // Before TIFF: in front of DICOM there may be the start of one.
  if (startsLikeDicom(start)) return FileKind::dicom;
  if (start.starts_with("\x89PNG\r\n\x1a\n")) return FileKind::png;
  for (const std::string_view magic : {std::string_view("II\x2a\0", 4), std::string_view("MM\0\x2a", 4),
                                       std::string_view("II\x2b\0", 4), std::string_view("MM\0\x2b", 4)}) {
    if (start.starts_with(magic)) return FileKind::tiff;
  }
  if (start.starts_with("\xff\xd8\xff")) return FileKind::jpeg;
  if (start.starts_with(std::string_view("\0\0\0\x0cjP  \r\n\x87\n", 12))) return FileKind::jpeg2000;
  if (start.starts_with("\xff\x4f\xff\x51")) return FileKind::jpeg2000;
  if (start.starts_with("GIF87a") || start.starts_with("GIF89a")) return FileKind::gif;
  if (start.size() >= 12 && start.starts_with("RIFF") && start.substr(8, 4) == "WEBP") return FileKind::webp;
  if (surelyUnread(file, start) != nullptr) return FileKind::unread;
  if (start.starts_with("\x89HDF\r\n\x1a\n")) return FileKind::hdf5;
  if (start.starts_with("\x93NUMPY")) return FileKind::npy;
  if (start.starts_with("VOX ")) return FileKind::vox;
  if (start.starts_with(std::string_view(" BDV\0\0\0\0", 8))) return FileKind::vdb;
  if (start.starts_with("NanoVDB")) return FileKind::nanovdb;
  for (const std::string_view magic : {"PVM\n", "PVM2\n", "PVM3\n", "DDS v3d\n", "DDS v3e\n"}) {
    if (start.starts_with(magic)) return FileKind::pvm;
  }
  if (startsLikeAmira(start)) return FileKind::amira;
  if (startsLikeIsq(bytes)) return FileKind::isq;
  if (startsLikeVgi(start)) return FileKind::vgi;
  if (startsLikeEsrfInfo(start) || startsLikeEsrfXml(start)) return FileKind::esrf;
  if (startsLikeMetaImage(start)) return FileKind::metaimage;
  if (startsLikeZarr(start)) return FileKind::zarr;
  if (startsLikePrism(start)) return FileKind::prism;
  if (start.starts_with("PK\x03\x04") || start.starts_with("PK\x05\x06")) return FileKind::zip;
  if (trimmed(start).starts_with("(version)")) return FileKind::idx;
  if (startsLikeSpimData(start)) return FileKind::spimdata;
  if (startsLikeNifti(firstBytes(file, kNiftiHeaderBytes))) return FileKind::nifti;
  if (startsLikeHdf5(file)) return FileKind::hdf5;
  // These have no word of their own, or may lack it: those whose sizes must fit come first.
  if (startsLikeMrc(bytes, file.bytes())) return FileKind::mrc;
  if (startsLikeKvx(bytes, file.bytes())) return FileKind::kvx;
  if (startsLikeAim(bytes)) return FileKind::aim;
  if (startsLikeBareDicom(start)) return FileKind::dicom;
  return likelyUnread(file, start) != nullptr ? FileKind::unread : FileKind::unknown;
}

}  // namespace blockwalk
