// SPDX-License-Identifier: Apache-2.0
#include "volume/import/import.h"

#include <algorithm>
#include <utility>

#include "volume/error.h"
#include "volume/import/openers.h"
#include "volume/import/slices/slice_order.h"
#include "volume/import/sniff.h"
#include "volume/import/unread_format.h"
#include "volume/import/zip_folder.h"

namespace blockwalk {
namespace {

using Paths = std::vector<std::filesystem::path>;

void refuseRawFlags(const std::string& name, const ImportOptions& options) {
  if (options.dims || options.type || options.big_endian || options.skip_bytes > 0 || options.planar) {
    failData("{}: says its size and type itself; leave --dims, --type, --big-endian, --skip and --planar out", name);
  }
}

// Which choices between what lies in one file a format has.
struct Choices {
  bool level = false;
  bool dataset = false;
};

Choices choicesOf(FileKind kind) {
  if (kind == FileKind::tiff) return {.level = true};
  if (kind == FileKind::zarr || kind == FileKind::zip) return {.level = true};
  if (kind == FileKind::hdf5 || kind == FileKind::spimdata) return {.level = true, .dataset = true};
  if (kind == FileKind::dicom) return {.dataset = true};
  if (kind == FileKind::vdb || kind == FileKind::nanovdb) return {.dataset = true};
  return {};
}

void refuseOtherChoices(const std::string& name, FileKind kind, const ImportOptions& options) {
  const Choices has = choicesOf(kind);
  if (options.level && !has.level)
    failData("{}: --level is for OME-Zarr, Imaris, BigDataViewer and TIFF, which have levels", name);
  if (options.dataset && !has.dataset) failData("{}: --dataset is for files that hold several by name", name);
}

std::unique_ptr<Source> openStack(Paths slices, const std::string& name, const ImportOptions& options) {
  if (options.type) failData("{}: type: slices say their type themselves; leave it out", name);
  const FileKind kind = fileKind(InputFile(slices.front()));
  refuseOtherChoices(name, kind, options);
  for (const auto& slice : slices) {
    const InputFile file(slice);
    const FileKind found = fileKind(file);
    if (found == FileKind::unread) throw DataError(unreadMessage(file));
    if (!isSliceKind(found)) {
      failData("{}: is neither {}; several files are the slices of one stack", slice.string(), kSliceFormats);
    }
    if (found != kind) failData("{}: is of another kind than {}", slice.string(), slices.front().string());
  }
  if (kind == FileKind::png) return openPng(slices, name, options);
  return kind == FileKind::tiff ? openTiff(slices, name, options) : openPictures(slices, name, options);
}

constexpr std::string_view kKnownFormats =
    "NRRD, MetaImage, NIfTI, DICOM, PNG, TIFF, JPEG, JPEG 2000, WebP, GIF, Zarr, HDF5, OpenVDB, NanoVDB, npy, MRC, "
    ".vox, "
    "KVX, PVM, Amira, VGI, ESRF .vol, ISQ, AIM, PRISM, IDX";

using Opener = std::unique_ptr<Source> (*)(std::shared_ptr<const InputFile> file, const ImportOptions& options);

// Of a file that says all about itself.
Opener openerOf(FileKind kind) {
  switch (kind) {
    case FileKind::nrrd:
      return openNrrd;
    case FileKind::metaimage:
      return openMetaImage;
    case FileKind::nifti:
      return openNifti;
    case FileKind::prism:
      return openPrism;
    case FileKind::idx:
      return openIdx;
    case FileKind::npy:
      return openNpy;
    case FileKind::mrc:
      return openMrc;
    case FileKind::vox:
      return openVox;
    case FileKind::kvx:
      return openKvx;
    case FileKind::amira:
      return openAmira;
    case FileKind::vgi:
      return openVgi;
    case FileKind::esrf:
      return openEsrfVol;
    case FileKind::isq:
      return openIsq;
    case FileKind::aim:
      return openAim;
    case FileKind::pvm:
      return openPvm;
    case FileKind::hdf5:
      return openHdf5;
    case FileKind::spimdata:
      return openSpimData;
    case FileKind::vdb:
      return openVdb;
    case FileKind::nanovdb:
      return openNanoVdb;
    case FileKind::unknown:
    case FileKind::dicom:
    case FileKind::png:
    case FileKind::tiff:
    case FileKind::jpeg:
    case FileKind::jpeg2000:
    case FileKind::webp:
    case FileKind::gif:
    case FileKind::unread:
    case FileKind::zarr:
    case FileKind::zip:
      break;
  }
  return nullptr;
}

std::unique_ptr<Source> openAny(const std::filesystem::path& path, const ImportOptions& options);

std::unique_ptr<Source> openFile(const std::filesystem::path& path, const ImportOptions& options) {
  auto file = std::make_shared<InputFile>(path);
  if (options.dims && options.type) {
    refuseOtherChoices(file->name(), FileKind::unknown, options);
    return openRaw(file, options);
  }
  if (options.raw_channels > 1) {
    failData("{}: channels: only raw data needs their number; --channels fields makes each sample a channel",
             file->name());
  }
  const FileKind kind = fileKind(*file);
  if (isSliceKind(kind)) return openStack({path}, file->name(), options);
  if (kind == FileKind::unread) throw DataError(unreadMessage(*file));
  if (kind == FileKind::unknown) {
    if (const auto header = niftiHeaderOf(path)) return openFile(*header, options);
    failData("{}: is no file of a known format ({}); raw data needs --dims and --type", file->name(), kKnownFormats);
  }
  if (kind == FileKind::zip && !isZarrZip(file, options.memory_bytes)) {
    return openZipFolder(file, options.memory_bytes, [&](const std::filesystem::path& unpacked) {
      const bool is_zip = !std::filesystem::is_directory(unpacked) && fileKind(InputFile(unpacked)) == FileKind::zip;
      if (is_zip) failData("{}: zip: holds another zip file; unpack it", file->name());
      return openAny(unpacked, options);
    });
  }
  refuseRawFlags(file->name(), options);
  refuseOtherChoices(file->name(), kind, options);
  if (kind == FileKind::zarr) return openZarr(std::filesystem::absolute(path).parent_path(), options);
  if (kind == FileKind::zip) return openZarr(path, options);
  if (kind == FileKind::dicom) return openDicom({path}, file->name(), options);
  return openerOf(kind)(file, options);
}

// The DICOM files of a folder and of those below it, in an order of their names. None where slices of other kinds lie
// there too.
Paths dicomIn(const std::filesystem::path& folder) {
  constexpr std::size_t kMostFiles = 200000;
  Paths found;
  std::size_t looked = 0;
  std::error_code failure;
  for (std::filesystem::recursive_directory_iterator at(folder, failure), end; !failure && at != end;
       at.increment(failure)) {
    std::error_code unknown;
    if (!at->is_regular_file(unknown) || at->path().filename().string().starts_with('.')) continue;
    if (++looked > kMostFiles) failData("{}: holds more than {} files", folder.string(), kMostFiles);
    const FileKind kind = fileKind(InputFile(at->path()));
    if (at.depth() == 0 && isSliceKind(kind)) return {};
    if (kind == FileKind::dicom) found.push_back(at->path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Of Zarr, of bricks, of DICOM, or of slices, whatever else lies there.
std::unique_ptr<Source> openFolder(const std::filesystem::path& path, const ImportOptions& options) {
  if (isZarrFolder(path)) {
    refuseRawFlags(path.string(), options);
    refuseOtherChoices(path.string(), FileKind::zarr, options);
    return openZarr(path, options);
  }
  const auto metadata = path / "metadata.json";
  std::error_code absent;
  if (std::filesystem::is_regular_file(metadata, absent) && fileKind(InputFile(metadata)) == FileKind::prism) {
    return openFile(metadata, options);
  }
  const auto folder = std::filesystem::absolute(path / "").parent_path();
  if (const Paths images = dicomIn(path); !images.empty()) {
    refuseOtherChoices(path.string(), FileKind::dicom, options);
    return openDicom(images, folder.filename().string(), options);
  }
  return openStack(slicesInFolder(path), folder.filename().string(), options);
}

std::unique_ptr<Source> openAny(const std::filesystem::path& path, const ImportOptions& options) {
  return std::filesystem::is_directory(path) ? openFolder(path, options) : openFile(path, options);
}

}  // namespace

namespace {

std::unique_ptr<Source> openPaths(const Paths& paths, const ImportOptions& options) {
  if (paths.empty()) failData("no file to import is named");
  if (options.channels == ChannelRule::separate) return openSeparate(paths, options);
  if (paths.size() == 1) {
    return openAny(paths[0], options);
  }
  Paths slices = paths;
  orderByName(slices);
  if (fileKind(InputFile(slices.front())) == FileKind::dicom) {
    refuseOtherChoices(slices.front().filename().string(), FileKind::dicom, options);
    return openDicom(slices, slices.front().filename().string(), options);
  }
  return openStack(slices, slices.front().filename().string(), options);
}

}  // namespace

std::unique_ptr<Source> openSource(const Paths& paths, const ImportOptions& options) {
  ImportOptions counting = options;
  if (counting.step_count == nullptr) counting.step_count = std::make_shared<std::int64_t>(0);
  auto source = openPaths(paths, counting);
  if (options.time.value_or(0) != 0 && *counting.step_count == 0) {
    failData("{}: time {} is asked for, it has no steps in time", source->info().name, *options.time);
  }
  return source;
}

}  // namespace blockwalk
