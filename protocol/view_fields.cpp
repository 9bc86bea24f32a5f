// SPDX-License-Identifier: Apache-2.0
#include "protocol/view_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "protocol/view_values.h"

namespace blockwalk {
namespace {

using Text = std::string_view;

constexpr double kMinFov = 1e-9;

// A choice that INTERFACE knows and this version lacks gets the same message as one nobody knows: what is supported.
[[noreturn]] void failSupport(Text field, Text supported, Text text) {
  failValue(field, fmt::format("this version supports {}", supported), text);
}

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
  // Below this a volume that is framed lies so far away that its coordinates lose their digits, and at last overflow.
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

void parseMode(ImageRequest& request, Text text) {
  if (text == "blend") {
    request.view.mode = Mode::blend;
  } else if (text == "first-hit") {
    request.view.mode = Mode::first_hit;
  } else if (text == "blocks") {
    request.view.mode = Mode::blocks;
  } else {
    failSupport("mode", "blend, first-hit and blocks", text);
  }
}

void parseFinder(ImageRequest& request, Text text) {
  if (text == "auto") {
    request.view.finder = Finder::automatic;
  } else if (text == "query") {
    request.view.finder = Finder::query;
  } else if (text == "grid") {
    request.view.finder = Finder::grid;
  } else {
    failSupport("finder", "auto, query and grid", text);
  }
}

void parseFormat(ImageRequest& request, Text text) {
  if (text == "png") {
    request.format = ImageFormat::png;
  } else if (text == "jpeg") {
    request.format = ImageFormat::jpeg;
  } else if (text == "raw") {
    request.format = ImageFormat::raw;
  } else {
    failSupport("format", "png, jpeg and raw", text);
  }
}

void parseExtinction(ImageRequest& request, Text text) {
  const double extinction = parseNumber("extinction", text);
  // Beyond this the kernel's floats overflow, and an opaque voxel cannot become more opaque.
  if (extinction < 0 || extinction > 1e6) failValue("extinction", "must be a number from 0 to 1000000", text);
  request.view.extinction = extinction;
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
    ViewField{"eye", "x,y,z", "world position of the eye (auto: the volume framed from (1, 0.8, 1.2))",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.eye, text, "auto", [](Text t) { return parseVector("eye", t); });
              }},
    ViewField{"target", "x,y,z", "world position looked at (auto: the volume's centre)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.target, text, "auto", [](Text t) { return parseVector("target", t); });
              }},
    ViewField{"up", "x,y,z", "world direction that is up (auto: +y)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.up, text, "auto", [](Text t) { return parseVector("up", t); });
              }},
    ViewField{"fov", "DEGREES", "vertical field of view, 1e-9 to less than 180 (40)", parseFov},
    ViewField{"ortho", "HEIGHT", "orthographic view of this world height, instead of fov", parseOrtho},
    ViewField{"range", "lo:hi", "density range, inclusive, data units (auto: the volume's non-empty range)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.range, text, "auto", [](Text t) { return parseRange("range", t); });
              }},
    ViewField{"mode", "MODE", "blend, first-hit or blocks (blend)", parseMode},
    ViewField{"filter", "nearest", "interpolation between voxels (nearest)",
              [](ImageRequest&, Text text) {
                if (text != "nearest") failSupport("filter", "nearest", text);
              }},
    ViewField{"step", "VOXELS", "sample distance of filter=linear, which this version lacks (0.5)",
              [](ImageRequest&, Text text) {
                if (parseNumber("step", text) != 0.5) failSupport("step", "0.5, as it has filter=nearest only", text);
              }},
    ViewField{"extinction", "SIGMA", "rgba8: extinction per unit distance at full density, 0..1000000 (0.2)",
              parseExtinction},
    ViewField{"tf", "value:rrggbb:opacity,...",
              "scalar volumes: transfer function, ascending (auto: from the histogram)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.transfer, text, "auto", [](Text t) { return parseTransfer("tf", t); });
              }},
    ViewField{"lit", "off", "gradient shading, which this version lacks (off)",
              [](ImageRequest&, Text text) {
                if (parseSwitch("lit", text)) failSupport("lit", "off", text);
              }},
    ViewField{"iso", "VALUE", "value of mode=iso, which this version lacks",
              [](ImageRequest&, Text text) { failSupport("iso", "no mode=iso", text); }},
    ViewField{"clip", "x0,y0,z0,x1,y1,z1", "world box outside of which nothing is shown (none)",
              [](ImageRequest& request, Text text) {
                setOptional(request.view.clip, text, "none", [](Text t) { return parseClip("clip", t); });
              }},
    ViewField{"level", "auto|N", "resolution level, 0 is the finest (auto)",
              [](ImageRequest& request, Text text) {
                request.view.level = text == "auto" ? kAutoLevel : parseInteger("level", text, 0, kMaxLevels - 1);
              }},
    ViewField{"background", "rrggbb[aa]", "colour behind the volume (000000)",
              [](ImageRequest& request, Text text) { request.view.background = parseColor("background", text); }},
    ViewField{"finder", "FINDER", "auto, query or grid (auto)", parseFinder},
    ViewField{"walk", "on|off", "step through stored neighbours after a block (on)",
              [](ImageRequest& request, Text text) { request.view.walk = parseSwitch("walk", text); }},
    ViewField{"cull", "on|off", "skip what masks and ranges exclude (on)",
              [](ImageRequest& request, Text text) { request.view.cull = parseSwitch("cull", text); }},
    ViewField{"output", "color", "what a pixel holds (color)",
              [](ImageRequest&, Text text) {
                if (text != "color") failSupport("output", "color", text);
              }},
    ViewField{"format", "FORMAT", "png, jpeg or raw (rows of rgba8) (png)", parseFormat},
    ViewField{"quality", "1..100", "jpeg quality (85)",
              [](ImageRequest& request, Text text) { request.quality = parseInteger("quality", text, 1, 100); }},
};

}  // namespace

std::span<const ViewField> viewFields() { return kFields; }

void setViewField(ImageRequest& request, std::string_view name, std::string_view text) {
  const auto field = std::find_if(kFields.begin(), kFields.end(), [&](const ViewField& f) { return f.name == name; });
  if (field == kFields.end()) failValue(name, "is no member of a view", text);
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
      if (pairs[earlier].first == name) failValue(name, "is given twice", text);
      const bool both =
          (name == "fov" && pairs[earlier].first == "ortho") || (name == "ortho" && pairs[earlier].first == "fov");
      if (both) failValue(name, "excludes " + pairs[earlier].first + ": give one of fov and ortho", text);
    }
    setViewField(changed, name, text);
  }
  request = std::move(changed);
}

}  // namespace blockwalk
