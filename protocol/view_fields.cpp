// SPDX-License-Identifier: Apache-2.0
#include "protocol/view_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "protocol/view_choices.h"
#include "protocol/view_values.h"

namespace blockwalk {
namespace {

using Text = std::string_view;

void parseSize(ImageRequest& request, Text text) {
  const std::size_t cross = text.find('x');
  if (cross == Text::npos) failValue("size", "must be WxH", text);
  const int width = parseInteger("size", text.substr(0, cross), 1, kMaxImageSide);
  request.view.height = parseInteger("size", text.substr(cross + 1), 1, kMaxImageSide);
  request.view.width = width;
}

// Perspective and orthographic exclude each other, so that each patch to a session says which one is meant.
void parseFov(ImageRequest& request, Text text) {
  const double fov = parseNumber("fov", text);
  if (!(fov >= kMinFov && fov < 180)) {
    failValue("fov", fmt::format("must be at least {} and less than 180 degrees", kMinFov), text);
  }
  request.view.fov_degrees = fov;
  request.view.ortho_height.reset();
}

void parseOrtho(ImageRequest& request, Text text) {
  const double height = parseNumber("ortho", text);
  if (!(height > 0)) failValue("ortho", "must be greater than 0", text);
  request.view.ortho_height = height;
  request.view.fov_degrees = View{}.fov_degrees;
}

void parseStep(ImageRequest& request, Text text) {
  const double step = parseNumber("step", text);
  if (step < kMinStep || step > kMaxStep) {
    failValue("step", fmt::format("must be from {} to {} voxels", kMinStep, kMaxStep), text);
  }
  request.view.step = step;
}

void parseLod(ImageRequest& request, Text text) {
  const double lod = text == "off" ? kOneLevel : parseNumber("lod", text);
  if (text != "off" && !(lod >= kMinLod && lod <= kMaxLod)) {
    failValue("lod", fmt::format("must be from {} to {}, or off", kMinLod, kMaxLod), text);
  }
  request.view.lod = lod;
}

void parseLodAlpha(ImageRequest& request, Text text) {
  const double lambda = parseNumber("lod-alpha", text);
  if (lambda < 0 || lambda > 1) failValue("lod-alpha", "must be from 0 to 1", text);
  request.view.lod_alpha = lambda;
}

void parseTermination(ImageRequest& request, Text text) {
  const double bound = parseNumber("termination", text);
  if (bound < 0 || bound > 0.5) failValue("termination", "must be from 0 to 0.5", text);
  request.view.termination = bound;
}

// One item a channel, each judged by `set`; of several, an empty one leaves its channel at the default, and so do the
// channels for which there is none.
template <typename Set, typename Reset>
void setChannels(std::string_view field, ImageRequest& request, Text text, Reset reset, Set set) {
  const std::vector<Text> items = splitChannels(field, text);
  for (std::size_t i = 0; i < request.view.channels.size(); ++i) {
    ChannelView& channel = request.view.channels[i];
    reset(channel);
    if (i < items.size() && (!items[i].empty() || items.size() == 1)) set(channel, items[i]);
  }
}

void parseRanges(ImageRequest& request, Text text) {
  setChannels(
      "range", request, text, [](ChannelView& channel) { channel.range.reset(); },
      [](ChannelView& channel, Text item) {
        if (item != "auto") channel.range = parseRange("range", item);
      });
}

// A preset's name, or points; each takes the place of the other.
void parseTf(ImageRequest& request, Text text) {
  setChannels(
      "tf", request, text,
      [](ChannelView& channel) {
        channel.transfer.clear();
        channel.transfer_preset = TransferPreset::automatic;
      },
      [](ChannelView& channel, Text item) {
        if (item.find(':') != Text::npos) {
          channel.transfer = parseTransfer("tf", item);
        } else {
          channel.transfer_preset = parseChoice("tf", item, kTransferPresetChoices);
        }
      });
}

void parseExtinction(ImageRequest& request, Text text) {
  const double extinction = parseNumber("extinction", text);
  // An opaque voxel cannot become more opaque.
  if (extinction < 0 || extinction > 1e12) failValue("extinction", "must be a number from 0 to 1e12", text);
  request.view.extinction = extinction;
}

void parseAttenuation(ImageRequest& request, Text text) {
  const double attenuation = parseNumber("attenuation", text);
  if (attenuation < 0 || attenuation > kMaxAttenuation) {
    failValue("attenuation", fmt::format("must be from 0 to {}", kMaxAttenuation), text);
  }
  request.view.attenuation = attenuation;
}

void setFocus(ImageRequest& request, Text text) {
  const double focus = text == "auto" ? kAtTarget : parseNumber("focus", text);
  if (text != "auto" && !(focus > 0)) failValue("focus", "must be greater than 0, or auto", text);
  request.view.focus = focus;
}

// "auto" (or "none") takes an optional member back to what resolveView() chooses.
template <typename Member, typename Parse>
void setOptional(Member& member, Text text, Text absent, Parse parse) {
  if (text == absent) {
    member = {};
  } else {
    member = parse(text);
  }
}

constexpr std::array kFields = {
    ViewField{"size", "WxH", "image size in pixels, 1..8192 each (1024x768)", parseSize},
    ViewField{"eye", "x,y,z",
              "world position of the eye (auto: what is not empty framed from (1, 0.8, 1.2), patients from the front)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.eye, text, "auto", [](Text t) { return parseVector("eye", t); });
              }},
    ViewField{"target", "x,y,z", "world position looked at (auto: the middle of what is not empty)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.target, text, "auto", [](Text t) { return parseVector("target", t); });
              }},
    ViewField{"up", "x,y,z", "world direction that is up (auto: +y, of patients towards the head)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.up, text, "auto", [](Text t) { return parseVector("up", t); });
              }},
    ViewField{"fov", "DEGREES", "vertical field of view, 1e-9 to less than 180 (40)", parseFov},
    ViewField{"ortho", "HEIGHT", "orthographic view of this world height, instead of fov", parseOrtho},
    ViewField{"channels", "0,2,...", "channels of the volume that are drawn (all)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.drawn, text, "all", [](Text t) { return parseChannels("channels", t); });
              }},
    ViewField{"range", "lo:hi[;...]",
              "density range, inclusive, data units; one a channel (auto: the channel's non-empty range)", parseRanges},
    ViewField{"mode", "MODE", "blend, first-hit, mip, minip, attenuated-mip, mean, iso or blocks (blend)",
              [](ImageRequest& request, Text text) { request.view.mode = parseChoice("mode", text, kModeChoices); }},
    ViewField{
        "filter", "FILTER", "interpolation between voxels: nearest or linear (nearest)",
        [](ImageRequest& request, Text text) { request.view.filter = parseChoice("filter", text, kFilterChoices); }},
    ViewField{"step", "VOXELS", "filter linear: sample distance, 1/64..16 (0.5)", parseStep},
    ViewField{"classification", "post|pre-integrated",
              "filter linear: transfer function at samples, or integrated between them (post)",
              [](ImageRequest& request, Text text) {
                request.view.classification = parseChoice("classification", text, kClassificationChoices);
              }},
    ViewField{"extinction", "SIGMA", "rgba8: extinction per unit distance at full density, 0..1e12 (0.2)",
              parseExtinction},
    ViewField{"attenuation", "A",
              "mode attenuated-mip: attenuation per unit distance at the range's upper end, 0..1000 (0.05)",
              parseAttenuation},
    ViewField{"tf", "value:rrggbb:opacity,...|PRESET[;...]",
              "scalars: transfer function, ascending, or grey, viridis, cividis, inferno, ct-bone, ct-soft-tissue, "
              "angiography; one a channel (auto: of CT ct-soft-tissue, else from the histogram)",
              parseTf},
    ViewField{"tf-shape", "linear|stepped", "between the points of tf: linear, or held up to the next (linear)",
              [](ImageRequest& request, Text text) {
                request.view.transfer_shape = parseChoice("tf-shape", text, kTransferShapeChoices);
              }},
    ViewField{"termination", "T",
              "mode blend: a ray with less transmittance left stops, 0..0.5 (1/1024 = 0.0009765625)", parseTermination},
    ViewField{"lit", "on|off", "gradient shading (off)",
              [](ImageRequest& request, Text text) { request.view.lit = parseSwitch("lit", text); }},
    ViewField{"light", "A,H,K,S",
              "lit: strengths of ambient, head and key light and of the highlight (0.3,0.4,0.3,0.2)",
              [](ImageRequest& request, Text text) { request.view.lights = parseLights("light", text); }},
    ViewField{"key-light", "x,y,z", "lit: direction to the key light: right, up, towards the eye (-1,1,1)",
              [](ImageRequest& request, Text text) { request.view.key_light = parseVector("key-light", text); }},
    ViewField{"shadow", "on|off", "lit: the key light comes through the volume; blend, first-hit, iso (off)",
              [](ImageRequest& request, Text text) { request.view.shadow = parseSwitch("shadow", text); }},
    ViewField{"occlusion", "REACH|off",
              "lit: within so many unit distances something takes the ambient light away (off)",
              [](ImageRequest& request, Text text) {
                request.view.occlusion = text == "off" ? 0 : parseNumber("occlusion", text);
              }},
    ViewField{"aperture", "RADIUS", "radius of the lens, world; perspective, of several samples (0)",
              [](ImageRequest& request, Text text) { request.view.aperture = parseNumber("aperture", text); }},
    ViewField{"focus", "DISTANCE|auto", "distance before the eye of what is sharp, world (auto: the target's)",
              [](ImageRequest& request, Text text) { setFocus(request, text); }},
    ViewField{"iso", "VALUE", "mode iso: the surface's value, data units (auto: middle of the range)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.iso, text, "auto", [](Text t) { return parseNumber("iso", t); });
              }},
    ViewField{"clip", "x0,y0,z0,x1,y1,z1", "world box outside of which nothing is shown (none)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.clip, text, "none", [](Text t) { return parseClip("clip", t); });
              }},
    ViewField{"planes", "nx,ny,nz,d;...", "up to 6 world planes, shown where nx x + ny y + nz z + d >= 0 (none)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.planes, text, "none", [](Text t) { return parsePlanes("planes", t); });
              }},
    ViewField{"level", "auto|N", "resolution level, 0 is the finest (auto)",
              [](ImageRequest& request, Text text) {
                request.view.level = text == "auto" ? kAutoLevel : parseInteger("level", text, 0, kMaxLevels - 1);
              }},
    ViewField{
        "time", "N", "step in time of a volume that has several, counted from 0 (0)",
        [](ImageRequest& request, Text text) { request.view.time = parseInteger("time", text, 0, kMaxSteps - 1); }},
    ViewField{"lod", "N|off",
              "level auto: farther parts of coarser levels, of whose voxels a pixel covers N in a row, 1..64 (2)",
              parseLod},
    ViewField{"lod-alpha", "0..1", "the same, mode blend: how much coarser is what lies behind an opacity (0)",
              parseLodAlpha},
    ViewField{"requests", "ORDER",
              "of a moving view, what is read first of what it lacks: by file, shells (nearest first) or transmittance "
              "(file)",
              [](ImageRequest& request, Text text) {
                request.view.requests = parseChoice("requests", text, kRequestsChoices);
              }},
    ViewField{"stand-in", "VALUES",
              "of a moving view, what stands in for voxels that it lacks: mean, maximum, or auto: by the mode (auto)",
              [](ImageRequest& request, Text text) {
                request.view.stand_in = parseChoice("stand-in", text, kStandInChoices);
              }},
    ViewField{"background", "rrggbb[aa]", "colour behind the volume (000000)",
              [](ImageRequest& request, Text text) { request.view.background = parseColor("background", text); }},
    ViewField{
        "finder", "FINDER", "auto, query, grid, clusters, boundary, octree or none (auto)",
        [](ImageRequest& request, Text text) { request.view.finder = parseChoice("finder", text, kFinderChoices); }},
    ViewField{"macrocell", "auto|8|16|32", "finders clusters and boundary: side of a macrocell, voxels (auto)",
              [](ImageRequest& request, Text text) {
                request.view.macrocell = parseChoice("macrocell", text, kMacrocellChoices);
              }},
    ViewField{"walk", "on|off", "step through stored neighbours after a block (on)",
              [](ImageRequest& request, Text text) { request.view.walk = parseSwitch("walk", text); }},
    ViewField{"cull", "on|off", "skip what masks and ranges exclude (on)",
              [](ImageRequest& request, Text text) { request.view.cull = parseSwitch("cull", text); }},
    ViewField{
        "output", "OUTPUT", "what a pixel holds: color, depth, position, value, cost, queries or mesh (color)",
        [](ImageRequest& request, Text text) { request.view.output = parseChoice("output", text, kOutputChoices); }},
    ViewField{
        "samples", "1..256", "rays a pixel, averaged (1)",
        [](ImageRequest& request, Text text) { request.view.samples = parseInteger("samples", text, 1, kMaxSamples); }},
    ViewField{"format", "FORMAT", "png, jpeg, webp or raw (rows of rgba8, or of f32 where output is not color) (png)",
              [](ImageRequest& request, Text text) { request.format = parseChoice("format", text, kFormatChoices); }},
    ViewField{"quality", "1..100", "jpeg and webp quality; 100 is lossless in webp (85)",
              [](ImageRequest& request, Text text) { request.quality = parseInteger("quality", text, 1, 100); }},
};

}  // namespace

std::span<const ViewField> viewFields() { return kFields; }

void setViewField(ImageRequest& request, std::string_view name, std::string_view text) {
  const auto field = std::find_if(kFields.begin(), kFields.end(), [&](const ViewField& f) { return f.name == name; });
  if (field == kFields.end()) failName(name, "is no member of a view");
  // A parser that throws half way leaves the request as it was.
  ImageRequest changed = request;
  field->parse(changed, text);
  request = std::move(changed);
}

void setViewFields(ImageRequest& request, std::span<const std::pair<std::string, std::string>> pairs) {
  ImageRequest changed = request;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto& [name, text] = pairs[i];
    for (std::size_t earlier = 0; earlier < i; ++earlier) {
      if (pairs[earlier].first == name) failName(name, "is given twice");
      const bool both =
          (name == "fov" && pairs[earlier].first == "ortho") || (name == "ortho" && pairs[earlier].first == "fov");
      if (both) failName(name, "excludes " + pairs[earlier].first + ": give one of fov and ortho");
    }
    setViewField(changed, name, text);
  }
  request = std::move(changed);
}

}  // namespace blockwalk
