// SPDX-License-Identifier: Apache-2.0
// The pixels of DICOM frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "volume/import/dicom/dicom_image.h"

namespace blockwalk {

// Whether the transfer syntax can be read by this program: some need a library that it may be built without.
bool canReadDicom(const std::string& transfer_syntax);

// The file of an image, for its frames.
DicomBytes openDicomBytes(const DicomImage& image);

// One frame as samples of image.pixels.format(), this machine's byte order, pixel after pixel; `file` is the
// image's. Throws DataError, also where it does not fit `memory_bytes`.
std::vector<std::byte> readDicomFrame(const DicomImage& image, std::size_t frame, DicomBytes& file,
                                      std::uint64_t memory_bytes);

// A frame that is packed as JPEG, JPEG-LS or JPEG 2000, unpacked as it is stored: `out` has its size. Throws DataError.
// The work is done in a process of its own, that takes `memory_bytes` at most.
void unpackDicomFrame(const DicomImage& image, std::span<const std::byte> packed, std::span<std::byte> out,
                      std::uint64_t memory_bytes);
bool canUnpackDicom(const std::string& transfer_syntax);

}  // namespace blockwalk
