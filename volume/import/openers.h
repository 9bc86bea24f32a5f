// SPDX-License-Identifier: Apache-2.0
// One function a format; each throws DataError for what it cannot read.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "volume/import/import.h"
#include "volume/import/input_file.h"

namespace blockwalk {

std::unique_ptr<Source> openRaw(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openNrrd(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openMetaImage(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openNifti(std::shared_ptr<const InputFile> file, const ImportOptions& options);
// The header of an image that has it in a file of its own; nothing where there is none beside it.
std::optional<std::filesystem::path> niftiHeaderOf(const std::filesystem::path& image);
std::unique_ptr<Source> openIdx(std::shared_ptr<const InputFile> file, const ImportOptions& options);
// The file is the folder's metadata.json.
std::unique_ptr<Source> openPrism(std::shared_ptr<const InputFile> file, const ImportOptions& options);

std::unique_ptr<Source> openNpy(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openMrc(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openIsq(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openAim(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openVgi(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openEsrfVol(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openAmira(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openPvm(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openKvx(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openVox(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openHdf5(std::shared_ptr<const InputFile> file, const ImportOptions& options);
// The XML file of BigDataViewer, which names a file of HDF5 in its own folder.
std::unique_ptr<Source> openSpimData(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openVdb(std::shared_ptr<const InputFile> file, const ImportOptions& options);
std::unique_ptr<Source> openNanoVdb(std::shared_ptr<const InputFile> file, const ImportOptions& options);
// A folder, or a zip file.
std::unique_ptr<Source> openZarr(const std::filesystem::path& path, const ImportOptions& options);
bool isZarrFolder(const std::filesystem::path& folder);

// Each path is a source of its own and a channel.
std::unique_ptr<Source> openSeparate(const std::vector<std::filesystem::path>& paths, const ImportOptions& options);

// The images of one series, in any order; `name` is the volume's.
std::unique_ptr<Source> openDicom(const std::vector<std::filesystem::path>& paths, const std::string& name,
                                  const ImportOptions& options);

// A stack of slices, in order; `name` is the stack's.
std::unique_ptr<Source> openPng(const std::vector<std::filesystem::path>& slices, const std::string& name,
                                const ImportOptions& options);
std::unique_ptr<Source> openTiff(const std::vector<std::filesystem::path>& slices, const std::string& name,
                                 const ImportOptions& options);
// JPEG, JPEG 2000, WebP or GIF.
std::unique_ptr<Source> openPictures(const std::vector<std::filesystem::path>& slices, const std::string& name,
                                     const ImportOptions& options);

}  // namespace blockwalk
