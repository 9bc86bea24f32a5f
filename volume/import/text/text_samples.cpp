// SPDX-License-Identifier: Apache-2.0
#include "volume/import/text/text_samples.h"

#include <charconv>
#include <cstring>
#include <string>

#include "volume/error.h"

namespace blockwalk {
namespace {

template <typename T>
void appendSample(std::vector<std::byte>& samples, const InputFile& file, SampleType type, const char* begin,
                  const char* end) {
  T value{};
  const auto [stop, failure] = std::from_chars(begin, end, value);
  if (failure != std::errc{} || stop != end) {
    failData("{}: value {} is '{}', which is no {}", file.name(), samples.size() / sizeof(T), std::string(begin, end),
             sampleTypeName(type));
  }
  const auto* bytes = reinterpret_cast<const std::byte*>(&value);
  samples.insert(samples.end(), bytes, bytes + sizeof(T));
}

using Append = void (*)(std::vector<std::byte>&, const InputFile&, SampleType, const char*, const char*);

Append appendFor(SampleType type) {
  switch (type) {
    case SampleType::u8:
      return appendSample<std::uint8_t>;
    case SampleType::i8:
      return appendSample<std::int8_t>;
    case SampleType::u16:
      return appendSample<std::uint16_t>;
    case SampleType::i16:
      return appendSample<std::int16_t>;
    case SampleType::u32:
      return appendSample<std::uint32_t>;
    case SampleType::i32:
      return appendSample<std::int32_t>;
    case SampleType::u64:
      return appendSample<std::uint64_t>;
    case SampleType::i64:
      return appendSample<std::int64_t>;
    case SampleType::f32:
      return appendSample<float>;
    case SampleType::f64:
      return appendSample<double>;
  }
  return nullptr;
}

}  // namespace

std::vector<std::byte> readTextSamples(const InputFile& file, std::uint64_t first, SampleType type, std::uint64_t count,
                                       std::uint64_t memory_bytes) {
  const std::uint64_t text_bytes = file.bytes() - std::min(first, file.bytes());
  // A number takes a digit and a separator, so the text bounds the count before anything is allocated for it.
  if (count > (text_bytes + 1) / 2)
    failData("{}: {} values were declared, {} bytes of text follow", file.name(), count, text_bytes);
  const std::uint64_t needed = text_bytes + count * sampleBytes(type);
  if (needed > memory_bytes) {
    failData("{}: values written as text need {} bytes of memory, {} are allowed; raise --memory", file.name(), needed,
             memory_bytes);
  }
  std::string text(text_bytes, '\0');
  file.read(first, std::as_writable_bytes(std::span(text)));
  std::vector<std::byte> samples;
  samples.reserve(count * sampleBytes(type));
  const Append append = appendFor(type);
  constexpr const char* kSeparators = " \t\r\n,";
  std::uint64_t found = 0;
  std::size_t begin = text.find_first_not_of(kSeparators);
  while (begin != std::string::npos) {
    const std::size_t end = std::min(text.find_first_of(kSeparators, begin), text.size());
    if (++found <= count) append(samples, file, type, text.data() + begin, text.data() + end);
    begin = text.find_first_not_of(kSeparators, end);
  }
  if (found != count) failData("{}: {} values were declared, {} are written", file.name(), count, found);
  return samples;
}

}  // namespace blockwalk
