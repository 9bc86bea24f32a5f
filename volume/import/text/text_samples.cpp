// SPDX-License-Identifier: Apache-2.0
#include "volume/import/text/text_samples.h"

#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

#include "volume/error.h"
#include "volume/import/header_text.h"

namespace blockwalk {
namespace {

// A whole number that is written as a real one: 12.0, 3e2.
template <typename T>
bool parseWhole(std::string_view text, T& value) {
  const auto real = parseReal(text);
  if (!real || *real != std::trunc(*real)) return false;
  const double beyond = std::ldexp(1.0, std::numeric_limits<T>::digits);
  if (*real < static_cast<double>(std::numeric_limits<T>::min()) || *real >= beyond) return false;
  value = static_cast<T>(*real);
  return true;
}

// Other programs write a plus in front, which std::from_chars does not take.
template <typename T>
bool parseSample(std::string_view text, T& value) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  const auto [stop, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure == std::errc{} && stop == text.data() + text.size()) return true;
  if constexpr (std::is_integral_v<T>) return parseWhole(text, value);
  return false;
}

template <typename T>
void appendSample(std::vector<std::byte>& samples, const InputFile& file, SampleType type, const char* begin,
                  const char* end) {
  T value{};
  if (!parseSample(std::string_view(begin, static_cast<std::size_t>(end - begin)), value)) {
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
    case SampleType::f16:
      break;  // no text header has it
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

std::vector<std::byte> readHexSamples(const InputFile& file, std::uint64_t first, std::uint64_t bytes,
                                      std::uint64_t memory_bytes) {
  const std::uint64_t text_bytes = file.bytes() - std::min(first, file.bytes());
  if (bytes > text_bytes / 2) {
    failData("{}: {} bytes were declared, {} characters of hexadecimal text follow", file.name(), bytes, text_bytes);
  }
  if (text_bytes + bytes > memory_bytes) {
    failData("{}: values written as text need {} bytes of memory, {} are allowed; raise --memory", file.name(),
             text_bytes + bytes, memory_bytes);
  }
  std::string text(text_bytes, '\0');
  file.read(first, std::as_writable_bytes(std::span(text)));
  std::vector<std::byte> samples(bytes);
  std::uint64_t digits = 0;
  for (const char letter : text) {
    if (letter == ' ' || letter == '\t' || letter == '\r' || letter == '\n') continue;
    unsigned digit = 0;
    if (std::from_chars(&letter, &letter + 1, digit, 16).ec != std::errc{}) {
      failData("{}: digit {} of the hexadecimal data is '{}'", file.name(), digits, letter);
    }
    if (digits / 2 < bytes) samples[digits / 2] |= static_cast<std::byte>(digits % 2 == 0 ? digit << 4 : digit);
    ++digits;
  }
  if (digits != 2 * bytes) {
    failData("{}: {} bytes were declared, {} hexadecimal digits are written", file.name(), bytes, digits);
  }
  return samples;
}

}  // namespace blockwalk
