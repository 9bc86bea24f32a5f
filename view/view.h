// SPDX-License-Identifier: Apache-2.0
// A view: the camera, the density range and everything else that one image depends on. Plain data, no Vulkan. What its
// members mean for a pixel is docs/integration.md.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "volume/error.h"
#include "volume/volume.h"

namespace blockwalk {

enum class Mode : std::uint8_t { blend, first_hit, blocks, mip, mean, iso, minip, attenuated_mip };
// Modes that show the density of one point of a ray, which comes of all of them.
constexpr bool showsExtreme(Mode mode) {
  return mode == Mode::mip || mode == Mode::minip || mode == Mode::attenuated_mip;
}
enum class Filter : std::uint8_t { nearest, linear };
// In which order the blocks are read that a frame lacked which waits for nothing (docs/large.md).
enum class Requests : std::uint8_t { file, shells, transmittance };
// What stands in for voxels that are absent: a coarser level's means, or the greatest densities that it covers.
enum class StandIn : std::uint8_t { automatic, mean, maximum };
enum class TransferShape : std::uint8_t { linear, stepped };
// How a transfer function is chosen where no points are given (view/transfer_presets.cpp). The CT presets are in
// Hounsfield units.
enum class TransferPreset : std::uint8_t {
  automatic,
  grey,
  viridis,
  cividis,
  inferno,
  ct_bone,
  ct_soft_tissue,
  angiography
};
enum class Classification : std::uint8_t { post, pre_integrated };
// What a pixel holds; all but color as numbers (Frame::values).
enum class Output : std::uint8_t { color, depth, position, cost, queries, mesh, value };
// Whether a pixel is a colour; of the others it is numbers.
constexpr bool isPicture(Output output) { return output == Output::color || output == Output::mesh; }
// What finds the next block along a ray (docs/finders.md). Numbers are the kernel's (shaders/kernel_interface.h).
enum class Finder : std::uint8_t { automatic, query, grid, clusters, boundary, octree, none };

constexpr int kMaxImageSide = 8192;
constexpr int kAutoLevel = -1;
constexpr double kOneLevel = 0;  // View::lod: of all of a frame
constexpr double kMinLod = 1;
constexpr double kMaxLod = 64;
// Below this a volume that is framed lies so far away that its coordinates lose their digits, and at last overflow.
constexpr double kMinFov = 1e-9;  // degrees
// How far from the volume an eye may be, and how high an orthographic picture: there doubles tell a hundred thousandth
// of it apart. Farther away nothing is drawn right, and at last coordinates overflow.
constexpr double kFarthestDiagonals = 1e11;
constexpr double kAtTarget = 0;        // View::focus
constexpr double kMaxLight = 10;       // a strength of View::lights
constexpr double kMaxReach = 1e6;      // View::occlusion, unit distances
constexpr double kMinStep = 1.0 / 64;  // voxels
constexpr double kMaxStep = 16;
constexpr std::size_t kMaxPlanes = 6;
constexpr double kMaxAttenuation = 1000;
constexpr int kMaxSamples = 256;
constexpr int kAutoMacrocell = 0;  // 8, or a subblock's side where that is more

struct DensityRange {
  double lo = 0;  // data units, inclusive
  double hi = 0;
  bool operator==(const DensityRange&) const = default;
};

// A control point of a transfer function: value in data units, display-referred colour 0..1, opacity over the unit
// distance.
struct TransferPoint {
  double value = 0;
  glm::dvec3 color{0};
  double opacity = 0;
  bool operator==(const TransferPoint&) const = default;
};

struct ClipBox {
  glm::dvec3 min{0};  // world
  glm::dvec3 max{0};
  bool operator==(const ClipBox&) const = default;
};

// What `lit` shades with (docs/integration.md, "Light").
struct Lights {
  double ambient = 0.3;
  double head = 0.4;  // from the eye
  double key = 0.3;
  double highlight = 0.2;
  bool operator==(const Lights&) const = default;
};

// A world half-space: inside where dot(normal, p) + offset >= 0. The normal may have any length but 0.
struct ClipPlane {
  glm::dvec3 normal{0};
  double offset = 0;
  bool operator==(const ClipPlane&) const = default;
};

// How one channel is drawn. What is absent is chosen for the channel by resolveView().
struct ChannelView {
  std::optional<DensityRange> range;    // default the channel's non-empty range
  std::vector<TransferPoint> transfer;  // scalars; empty: what the preset says
  TransferPreset transfer_preset = TransferPreset::automatic;
  bool operator==(const ChannelView&) const = default;
};

// The members of a view that mean the same for every volume.
struct ViewChoices {
  int width = 1024;
  int height = 768;
  double fov_degrees = 40;  // vertical
  Mode mode = Mode::blend;
  Filter filter = Filter::nearest;
  Classification classification = Classification::post;
  bool lit = false;
  Lights lights{};
  glm::dvec3 key_light{-1, 1, 1};  // to it, of any length: to the right, up, towards the eye
  bool shadow = false;             // the key light comes through the volume
  double occlusion = 0;  // unit distances: so far around it something takes the ambient light away; 0: nowhere
  TransferShape transfer_shape = TransferShape::linear;
  double step = 0.5;  // sample distance of the linear filter, voxels of the level drawn
  double termination =
      1.0 / 1024;                 // blend: a ray of which less transmittance is left stops; half an 8-bit step at most
  double extinction = 0.2;        // rgba8: per unit distance at density 255
  double attenuation = 0.05;      // mode attenuated-mip: per unit distance at the range's upper end
  std::optional<ClipBox> clip;    // none: nothing is clipped
  std::vector<ClipPlane> planes;  // at most kMaxPlanes, beside the clip box
  // Where the level is left to choose: what is farther away is drawn of coarser levels, of whose voxels a pixel is to
  // cover so many in a row.
  double lod = 2;
  // Reese's lambda, mode blend: how much coarser is what lies behind an opacity, 0: not at all, 1: behind one of 1 the
  // coarsest, or as coarse as a frame's levels go.
  double lod_alpha = 0;
  Requests requests = Requests::file;
  StandIn stand_in = StandIn::automatic;
  int level = kAutoLevel;
  int time = 0;                                          // step, of a volume that has several
  std::array<std::uint8_t, 4> background{0, 0, 0, 255};  // straight, not premultiplied, opacity
  Finder finder = Finder::automatic;
  int macrocell = kAutoMacrocell;  // voxels: 8, 16 or 32; finders clusters and boundary
  bool walk = true;
  bool cull = true;
  Output output = Output::color;
  int samples = 1;           // rays a pixel, 1: through its centre; more: output color
  double aperture = 0;       // radius of the lens, world; perspective, several samples
  double focus = kAtTarget;  // distance before the eye of what is sharp, world
  bool operator==(const ViewChoices&) const = default;
};

// What is asked for. What is absent is chosen for the volume by resolveView() (view/resolved_view.h).
struct View : ViewChoices {
  std::optional<glm::dvec3> eye;       // world
  std::optional<glm::dvec3> target;    // world; default the middle of what is not empty
  std::optional<glm::dvec3> up;        // default +y, of patients towards the head (view/first_look.h)
  std::optional<double> ortho_height;  // world; orthographic when present
  std::vector<int> drawn;              // channels of the volume; empty: all
  std::array<ChannelView, kMaxChannels> channels;
  std::optional<double> iso;  // data units; mode iso, default the middle of the first drawn channel's range
  bool operator==(const View&) const = default;
};

// A view that cannot be drawn: `field` is the name of INTERFACE's view member that is to blame.
struct ViewError : DataError {
  ViewError(std::string field_name, const std::string& detail) : DataError(detail), field(std::move(field_name)) {}
  std::string field;
};

// Of one among several channels: its own, else one that its neighbours have not.
Color channelColor(const ChannelInfo& channel, std::size_t number);

// The points of a preset for a channel; automatic: of CT, one channel in Hounsfield units that reaches bone, those of
// ct-soft-tissue; of labels a colour each; else from the histogram, transparent below the body of the data, above it a
// warm ramp or, of several channels, one from dark to full in the channel's colour. The colour maps run over the body
// of the data, of CT too. Throws ViewError for a CT preset where the channel's values cannot be Hounsfield units.
std::vector<TransferPoint> presetTransfer(TransferPreset preset, const VolumeInfo& info, std::size_t number);

}  // namespace blockwalk
