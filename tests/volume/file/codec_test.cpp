// SPDX-License-Identifier: Apache-2.0
#include "volume/file/codec.h"

#include <gtest/gtest.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <string>

#include "volume/codec_name.h"

namespace blockwalk::volume_test {
namespace {

std::span<const std::byte> bytesOf(const std::string& text) { return std::as_bytes(std::span(text)); }

// Whether `packed` unpacks to exactly `page`.
bool unpacksTo(Codec codec, const std::string& packed, const std::string& page) {
  std::string out(page.size(), '?');
  return unpackPage(codec, bytesOf(packed), std::as_writable_bytes(std::span(out))) && out == page;
}
bool unpacks(Codec codec, const std::string& packed, std::size_t bytes) {
  std::string out(bytes, '?');
  return unpackPage(codec, bytesOf(packed), std::as_writable_bytes(std::span(out)));
}

// Bytes as both formats' own documents say them: whoever changes these changes the file format.
const std::string kPage = std::string(61, 'a') + "bcd";
// One literal, a match of 58 at distance 1, five literals.
const std::string kLz4("\x1f\x61\x01\x00\x27\x50\x61\x61\x62\x63\x64", 11);
// Magic, a single segment of 64 bytes, one compressed block.
const std::string kZstd("\x28\xb5\x2f\xfd\x20\x40\x5d\x00\x00\x28\x61\x61\x62\x63\x64\x01\x00\x90\x00\x16", 20);

TEST(Codec, GoldenBytesOfPackedPages) {
  EXPECT_TRUE(unpacksTo(Codec::raw, kPage, kPage));
  EXPECT_TRUE(unpacksTo(Codec::lz4, kLz4, kPage));
  EXPECT_TRUE(unpacksTo(Codec::zstd, kZstd, kPage));
  EXPECT_FALSE(unpacks(Codec::lz4, kZstd, kPage.size()));
  EXPECT_FALSE(unpacks(Codec::zstd, kLz4, kPage.size()));
}

TEST(Codec, APageIsNeitherCutNorLongerNorOfAnotherLength) {
  for (const auto& [codec, packed] : {std::pair(Codec::lz4, kLz4), std::pair(Codec::zstd, kZstd)}) {
    for (std::size_t size = 0; size < packed.size(); ++size) {
      EXPECT_FALSE(unpacks(codec, packed.substr(0, size), kPage.size())) << codecName(codec) << " " << size;
    }
    EXPECT_FALSE(unpacks(codec, packed + '\0', kPage.size()));
    EXPECT_FALSE(unpacks(codec, packed + packed, kPage.size()));
    EXPECT_FALSE(unpacks(codec, packed + packed, 2 * kPage.size()));
    for (const std::size_t bytes : {0, 1, 63, 65, 1 << 20}) EXPECT_FALSE(unpacks(codec, packed, bytes)) << bytes;
  }
}

TEST(Codec, AFlippedBitIsRefusedOrGivesAWholePage) {
  for (const auto& [codec, packed] : {std::pair(Codec::lz4, kLz4), std::pair(Codec::zstd, kZstd)}) {
    int refused = 0;
    for (std::size_t bit = 0; bit < 8 * packed.size(); ++bit) {
      std::string broken = packed;
      broken[bit / 8] = static_cast<char>(broken[bit / 8] ^ (1 << bit % 8));
      refused += unpacks(codec, broken, kPage.size()) ? 0 : 1;
    }
    EXPECT_GT(refused, 30) << codecName(codec);
  }
}

TEST(Codec, AFrameOfZstdStatesItsLength) {
  std::string packed(100, '\0');
  ZSTD_CCtx* context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, 0);
  packed.resize(ZSTD_compress2(context, packed.data(), packed.size(), kPage.data(), kPage.size()));
  ZSTD_freeCCtx(context);
  EXPECT_FALSE(unpacks(Codec::zstd, packed, kPage.size()));
  // A frame to skip, before it or behind, is a second frame.
  EXPECT_FALSE(unpacks(Codec::zstd, kZstd + std::string("\x50\x2a\x4d\x18\x01\0\0\0x", 9), kPage.size()));
  EXPECT_FALSE(unpacks(Codec::zstd, std::string("\x50\x2a\x4d\x18\x01\0\0\0x", 9) + kZstd, kPage.size()));
}

TEST(Codec, WhatDoesNotGetShorterStaysRaw) {
  std::mt19937 random(5);
  std::string noise(4096, '\0');
  std::ranges::generate(noise, [&] { return static_cast<char>(random()); });
  std::string ramp(4096, '\0');
  for (std::size_t i = 0; i < ramp.size(); ++i) ramp[i] = static_cast<char>(i / 100);
  for (const Codec codec : {Codec::raw, Codec::lz4, Codec::zstd}) {
    PagePacker packer(codec);
    std::vector<std::byte> out;
    EXPECT_EQ(packer.append(bytesOf(noise), out), Codec::raw);
    ASSERT_EQ(out.size(), noise.size());
    EXPECT_EQ(std::memcmp(out.data(), noise.data(), noise.size()), 0);
    EXPECT_EQ(packer.append(bytesOf(ramp), out), codec);
    const std::string packed(reinterpret_cast<const char*>(out.data()) + noise.size(), out.size() - noise.size());
    EXPECT_TRUE(unpacksTo(codec, packed, ramp));
    if (codec != Codec::raw) {
      EXPECT_LT(packed.size(), ramp.size());
    }
  }
}

}  // namespace
}  // namespace blockwalk::volume_test
