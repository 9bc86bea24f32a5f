// SPDX-License-Identifier: Apache-2.0
// Files whose pages are packed: they say what the same file says with raw pages, and a reader believes nothing of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/volume/file/broken_file.h"
#include "tests/volume/file/file_contents.h"
#include "tests/volume/file/seal.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/codec_name.h"
#include "volume/error.h"
#include "volume/file/checksum.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

std::string packedFile(const ScratchFolder& folder, Codec codec, VoxelType type = VoxelType::u8,
                       std::size_t channels = 1) {
  MemorySource source = randomSource(type, {41, 23, 19}, 31, false, channels);
  // A block that no codec makes shorter: random bits, as f32 finite and not negative.
  std::mt19937 random(9);
  for (std::size_t channel = 0; channel < channels; ++channel) {
    for (int i = 0; i < 512; ++i) {
      const std::uint32_t bits = random() & 0x7f7fffffu;
      std::memcpy(source.at({i % 8, i / 8 % 8, i / 64}, channel), &bits, voxelBytes(type));
    }
  }
  buildVolume(source, folder / "packed.bwv", {.subblock_side = 4, .block_side = 2, .codec = codec});
  return readBytes(folder / "packed.bwv");
}

// The first page of level 0 that is packed: where its entry is, and where its bytes are.
struct PackedPage {
  std::size_t entry_at = 0;
  std::size_t at = 0;
  PageEntry entry;
};
PackedPage firstPacked(const std::string& bytes) {
  const auto sections = valueAt<ChannelSections>(bytes, sectionsAt(bytes, 0, 0));
  PackedPage page{.entry_at = sections.pages.offset, .at = sections.voxels.offset, .entry = {}};
  for (;; page.entry_at += sizeof(PageEntry), page.at += page.entry.bytes) {
    page.entry = valueAt<PageEntry>(bytes, page.entry_at);
    if (page.entry.codec != 0) return page;
  }
}

TEST(PackedFile, SaysWhatTheRawFileSays) {
  const ScratchFolder folder;
  for (const VoxelType type : {VoxelType::rgba8, VoxelType::u8, VoxelType::u16, VoxelType::f32}) {
    const std::size_t channels = type == VoxelType::rgba8 ? 1 : 2;
    const std::string raw_file = packedFile(folder, Codec::raw, type, channels);
    const std::string expected = readContents(folder / "packed.bwv");
    for (const Codec codec : {Codec::lz4, Codec::zstd}) {
      const std::string packed_file = packedFile(folder, codec, type, channels);
      EXPECT_EQ(readContents(folder / "packed.bwv"), expected);
      EXPECT_LT(packed_file.size(), raw_file.size());
      const VolumeFile file(folder / "packed.bwv");
      EXPECT_GT(file.info().pages[static_cast<std::size_t>(codec)], 0u);
      EXPECT_GT(file.info().pages[0], 0u) << "no page that stays raw: the other path is not tried";
      EXPECT_EQ(file.info().pages[3 - static_cast<std::size_t>(codec)], 0u);
    }
  }
}

TEST(PackedFile, TheReportAndTheFileCountTheSamePages) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {70, 60, 50}, 3);
  const BuildReport report = buildVolume(source, folder / "p.bwv", {.codec = Codec::lz4});
  EXPECT_EQ(VolumeFile(folder / "p.bwv").info().pages, report.info.pages);
  EXPECT_EQ(std::filesystem::file_size(folder / "p.bwv"), report.file_bytes);
  EXPECT_EQ(report.file_bytes, report.level0_voxel_bytes + report.coarser_level_bytes + report.overhead_bytes);
}

TEST(PackedFile, AGoldenPageOfEachCodecIsRead) {
  // One block of one subblock of 4^3: its page is replaced by bytes that no program of ours made.
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {4, 4, 4});
  const std::string page = std::string(61, 'a') + "bcd";
  std::memcpy(source.voxels.data(), page.data(), page.size());
  for (const auto& [codec, packed] :
       {std::pair(Codec::lz4, std::string("\x1f\x61\x01\x00\x27\x50\x61\x61\x62\x63\x64", 11)),
        std::pair(Codec::zstd, std::string("\x28\xb5\x2f\xfd\x20\x40\x5d\x00\x00\x28\x61\x61\x62\x63\x64\x01\x00\x90"
                                           "\x00\x16",
                                           20))}) {
    buildVolume(source, folder / "one.bwv", {.subblock_side = 4, .block_side = 1});
    std::string bytes = readBytes(folder / "one.bwv");
    const std::string expected = readContents(folder / "one.bwv");
    auto sections = valueAt<ChannelSections>(bytes, sectionsAt(bytes, 0, 0));
    ASSERT_EQ(sections.voxels.offset + 64, bytes.size());
    bytes.replace(sections.voxels.offset, 64, packed);
    sections.voxels.bytes = packed.size();
    bytes.replace(sectionsAt(bytes, 0, 0), sizeof sections, raw(sections));
    auto entry = valueAt<PageEntry>(bytes, sections.pages.offset);
    entry.codec = static_cast<std::uint8_t>(codec);
    entry.bytes = static_cast<std::uint32_t>(packed.size());
    bytes.replace(sections.pages.offset, sizeof entry, raw(entry));
    bytes.replace(offsetof(FileHeader, file_bytes), 8, raw(std::uint64_t{bytes.size()}));
    seal(bytes);
    writeBytes(folder / "one.bwv", bytes);
    EXPECT_EQ(messageOf(folder / "one.bwv"), "no error");
    EXPECT_EQ(readContents(folder / "one.bwv"), expected);
  }
}

TEST(PackedFile, ChecksumsAreOverThePackedBytes) {
  const ScratchFolder folder;
  for (const Codec codec : {Codec::lz4, Codec::zstd}) {
    const std::string whole = packedFile(folder, codec);
    const PackedPage page = firstPacked(whole);
    EXPECT_EQ(page.entry.checksum, checksumOf(std::as_bytes(std::span(whole)).subspan(page.at, page.entry.bytes)));
    std::string broken = whole;
    broken[page.at] = static_cast<char>(broken[page.at] ^ 1);
    writeBytes(folder / "broken.bwv", broken);
    EXPECT_THAT(messageOf(folder / "broken.bwv"),
                HasSubstr(fmt::format("broken.bwv: level 0 voxels at offset {}, {} bytes: checksum is", page.at,
                                      page.entry.bytes)));
  }
}

TEST(PackedFile, WhatDoesNotUnpackNamesItsOffset) {
  const ScratchFolder folder;
  for (const Codec codec : {Codec::lz4, Codec::zstd}) {
    const std::string whole = packedFile(folder, codec);
    const PackedPage page = firstPacked(whole);
    std::string broken = whole;
    broken.replace(page.at, page.entry.bytes, page.entry.bytes, '\xff');
    seal(broken);
    writeBytes(folder / "broken.bwv", broken);
    EXPECT_THAT(messageOf(folder / "broken.bwv"),
                HasSubstr(fmt::format("broken.bwv: level 0 voxels at offset {}, {} bytes: do not unpack as {} to {} "
                                      "bytes",
                                      page.at, page.entry.bytes, codecName(codec), page.entry.subblocks * 64)));
  }
}

TEST(PackedFile, PageEntriesAreBounded) {
  const ScratchFolder folder;
  const std::string whole = packedFile(folder, Codec::zstd);
  const PackedPage page = firstPacked(whole);
  const std::uint32_t unpacked = page.entry.subblocks * 64u;
  const auto breaks = [&](std::size_t offset, const std::string& bytes, const std::string& what) {
    std::string broken = whole;
    broken.replace(page.entry_at + offset, bytes.size(), bytes);
    seal(broken);
    writeBytes(folder / "broken.bwv", broken);
    EXPECT_THAT(messageOf(folder / "broken.bwv"),
                HasSubstr(fmt::format("record at offset {}: {}", page.entry_at, what)));
  };
  breaks(12, "\x03", "page codec is 3, must be 0 (raw), 1 (lz4) or 2 (zstd)");
  breaks(12, std::string(1, '\0'), fmt::format("page bytes is {}, must be {}", page.entry.bytes, unpacked));
  const std::string bound = fmt::format("must be 1..{}, packed from {}", unpacked - 1, unpacked);
  for (const std::uint32_t bytes : {0u, unpacked, 0xffffffffu}) {
    breaks(8, raw(bytes), fmt::format("page bytes is {}, {}", bytes, bound));
  }
}

TEST(PackedFile, EveryTruncationIsAnError) {
  const ScratchFolder folder;
  expectTruncationsFail(packedFile(folder, Codec::zstd), {.thorough = 100, .end = 2000, .step = 37});
}

TEST(PackedFile, AFlippedBitIsAnErrorOrChangesNothing) {
  const ScratchFolder folder;
  for (const Codec codec : {Codec::lz4, Codec::zstd}) {
    const std::string whole = packedFile(folder, codec);
    EXPECT_GT(expectFlipsAreNoticed(whole, 700, whole.size()), 500);
  }
}

TEST(PackedFile, ABrokenPageWithARightChecksumIsAnErrorOrAWholePage) {
  const ScratchFolder folder;
  for (const Codec codec : {Codec::lz4, Codec::zstd}) {
    const std::string whole = packedFile(folder, codec);
    const PackedPage page = firstPacked(whole);
    int errors = 0;
    for (std::size_t bit = 0; bit < 8 * page.entry.bytes; ++bit) {
      std::string broken = whole;
      broken[page.at + bit / 8] = static_cast<char>(broken[page.at + bit / 8] ^ (1 << bit % 8));
      seal(broken);
      writeBytes(folder / "flipped.bwv", broken);
      errors += messageOf(folder / "flipped.bwv") == "no error" ? 0 : 1;
    }
    EXPECT_GT(errors, 8) << codecName(codec);
  }
}

TEST(PackedFile, AReadTouchesOnlyThePagesOfWhatItReturns) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {192, 96, 96});
  for (std::size_t i = 0; i < source.voxels.size(); ++i) source.voxels[i] = static_cast<std::byte>(1 + i / 7 % 50);
  buildVolume(source, folder / "full.bwv", {.codec = Codec::zstd});
  const std::string bytes = readBytes(folder / "full.bwv");
  const auto sections = valueAt<ChannelSections>(bytes, sectionsAt(bytes, 0, 0));
  const VolumeFile file(folder / "full.bwv");
  const Level level = file.readLevel(0, 0);
  ASSERT_EQ(level.blocks.size(), 16u);
  for (std::size_t i = 0; i < level.blocks.size(); ++i) {
    const auto entry = valueAt<PageEntry>(bytes, sections.pages.offset + i * sizeof(PageEntry));
    ASSERT_EQ(entry.codec, 2);
    // A subblock in the middle of the page.
    std::vector<std::byte> voxels(512);
    const std::uint64_t before = file.bytesRead();
    file.readVoxels(0, 0, level.blocks[i].first_subblock + 7, 1, voxels);
    EXPECT_EQ(file.bytesRead() - before, entry.bytes);
    const glm::ivec3 corner = level.blocks[i].origin * 48 + glm::ivec3(8, 8, 0);  // local 7 is 1, 1, 0
    EXPECT_EQ(std::memcmp(voxels.data(), source.at(corner), 8), 0);
  }
}

}  // namespace
}  // namespace blockwalk::volume_test
