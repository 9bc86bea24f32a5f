// SPDX-License-Identifier: Apache-2.0
// Frames of DICOM files that are packed as JPEG, JPEG-LS or JPEG 2000, by GDCM where this program has it.
#include <array>

#include "volume/error.h"
#include "volume/import/child_bounds.h"
#include "volume/import/dicom/dicom_frames.h"

#ifdef BLOCKWALK_GDCM
#include <gdcmImage.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTrace.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>

namespace blockwalk {
namespace {

gdcm::PixelFormat formatOf(const DicomPixels& pixels) {
  return gdcm::PixelFormat(
      static_cast<unsigned short>(pixels.samples), static_cast<unsigned short>(pixels.bits_allocated),
      static_cast<unsigned short>(pixels.bits_stored), static_cast<unsigned short>(pixels.high_bit),
      static_cast<unsigned short>(pixels.is_signed ? 1 : 0));
}

// Returns whether `out` was filled.
bool unpackInto(const DicomImage& image, std::span<const std::byte> packed, std::span<std::byte> out) {
  const DicomPixels& pixels = image.pixels;
  // Counts who has it: the element alone, in the end.
  auto* const fragments = new gdcm::SequenceOfFragments;
  gdcm::Fragment fragment;
  fragment.SetByteValue(reinterpret_cast<const char*>(packed.data()), static_cast<std::uint32_t>(packed.size()));
  fragments->AddFragment(fragment);
  gdcm::DataElement element(gdcm::Tag(0x7fe0, 0x0010));
  element.SetValue(*fragments);

  gdcm::SmartPointer<gdcm::Image> frame = new gdcm::Image;
  frame->SetNumberOfDimensions(2);
  frame->SetDimension(0, static_cast<unsigned>(pixels.width));
  frame->SetDimension(1, static_cast<unsigned>(pixels.height));
  frame->SetPixelFormat(formatOf(pixels));
  const bool is_color = pixels.samples == 3;
  frame->SetPhotometricInterpretation(is_color ? gdcm::PhotometricInterpretation::RGB
                                               : gdcm::PhotometricInterpretation::MONOCHROME2);
  frame->SetTransferSyntax(gdcm::TransferSyntax::GetTSType(image.transfer_syntax.c_str()));
  frame->SetDataElement(element);
  return frame->GetBufferLength() == out.size() && frame->GetBuffer(reinterpret_cast<char*>(out.data()));
}

// Bytes that two processes share.
class SharedBytes {
 public:
  explicit SharedBytes(std::size_t bytes) : bytes_(bytes) {
    at_ = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  }
  ~SharedBytes() {
    if (at_ != MAP_FAILED) munmap(at_, bytes_);
  }
  SharedBytes(const SharedBytes&) = delete;
  SharedBytes& operator=(const SharedBytes&) = delete;
  bool isThere() const { return at_ != MAP_FAILED; }
  std::span<std::byte> get() const { return {static_cast<std::byte*>(at_), bytes_}; }

 private:
  std::size_t bytes_;
  void* at_;
};

// What broken data does to the codecs, an assertion or worse, it does to a process of its own.
[[noreturn]] void unpackAndExit(const DicomImage& image, std::span<const std::byte> packed, std::span<std::byte> out,
                                pid_t parent, std::uint64_t most_bytes) {
  boundChild(parent, most_bytes);
  constexpr unsigned kMostSeconds = 120;
  alarm(kMostSeconds);
  bool done = false;
  try {
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
    gdcm::Trace::DebugOff();
    done = unpackInto(image, packed, out);
  } catch (...) {
    done = false;
  }
  _exit(done ? 0 : 1);
}

}  // namespace

bool canUnpackDicom(const std::string& transfer_syntax) {
  constexpr std::array<const char*, 8> kSyntaxes = {"4.50", "4.51", "4.57", "4.70", "4.80", "4.81", "4.90", "4.91"};
  for (const char* syntax : kSyntaxes) {
    if (transfer_syntax == std::string("1.2.840.10008.1.2.") + syntax) return true;
  }
  return false;
}

void unpackDicomFrame(const DicomImage& image, std::span<const std::byte> packed, std::span<std::byte> out,
                      std::uint64_t memory_bytes) {
  const SharedBytes shared(out.size());
  constexpr std::uint64_t kCodecBytes = std::uint64_t{64} << 20;
  const std::uint64_t most_bytes = usedAddressSpace() + memory_bytes + kCodecBytes;
  const pid_t parent = getpid();
  const pid_t child = shared.isThere() ? fork() : -1;
  if (child < 0) failData("{}: PixelData: no process to unpack a frame: {}", image.name, std::strerror(errno));
  if (child == 0) unpackAndExit(image, packed, shared.get(), parent, most_bytes);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    failData(
        "{}: PixelData: a frame of transfer syntax {} cannot be unpacked: its data is broken, or takes more memory",
        image.name, image.transfer_syntax);
  }
  std::ranges::copy(shared.get(), out.begin());
}

}  // namespace blockwalk

#else

namespace blockwalk {

bool canUnpackDicom(const std::string& /*transfer_syntax*/) { return false; }

void unpackDicomFrame(const DicomImage& image, std::span<const std::byte> /*packed*/, std::span<std::byte> /*out*/,
                      std::uint64_t /*memory_bytes*/) {
  failData("{}: TransferSyntaxUID {}: this program was built without GDCM, which unpacks it", image.name,
           image.transfer_syntax);
}

}  // namespace blockwalk

#endif
