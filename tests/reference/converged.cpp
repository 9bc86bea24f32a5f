// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/converged.h"

#include <algorithm>
#include <cmath>

#include "tests/reference/classify.h"
#include "tests/reference/field.h"
#include "tests/reference/light.h"
#include "tests/reference/modes.h"
#include "tests/reference/quadrature.h"
#include "volume/error.h"

namespace blockwalk::reference {
namespace {

constexpr double kPrecision = 1e-14;  // of one smooth piece
constexpr double kDeepest = 4;        // of one panel
constexpr double kDark = 100;         // depth behind which there is no light
constexpr int kMaxHalvings = 50;      // towards an opacity that reaches 1
constexpr int kMaxPanels = 4000;      // of one smooth piece

// Both ends of the ray's part and where it crosses a plane between cells, ascending. The light's differences reach half
// a voxel to each side and have planes of their own between those.
std::vector<double> cellCrossings(const CutRay& cut, bool lit) {
  const auto [t_min, t_max] = cut.interval;
  std::vector<double> t{t_min, t_max};
  for (int a = 0; a < 3; ++a) {
    if (cut.ray.direction[a] == 0) continue;
    const double from = cut.ray.at(t_min)[a], to = cut.ray.at(t_max)[a];
    const double first = std::floor(std::min(from, to)) - (lit ? 1 : 0.5), spacing = lit ? 0.5 : 1;
    const auto planes = static_cast<std::int64_t>(std::ceil((std::max(from, to) + 1 - first) / spacing));
    for (std::int64_t i = 0; i < planes; ++i) {
      const double crossing = (first + static_cast<double>(i) * spacing - cut.ray.origin[a]) / cut.ray.direction[a];
      if (crossing > t_min && crossing < t_max) t.push_back(crossing);
    }
  }
  sortUnique(t);
  return t;
}

// Adds where the density is `value` in a section in which it only rises or only falls.
void addCrossing(const Cubic& cubic, double value, double a, double b, std::vector<double>& crossings) {
  const bool above_a = cubic.at(a).w > value, above_b = cubic.at(b).w > value;
  if (above_a == above_b) return;
  for (double middle = (a + b) / 2; middle != a && middle != b; middle = (a + b) / 2) {
    ((cubic.at(middle).w > value) == above_a ? a : b) = middle;
  }
  crossings.push_back(b);
}

// Both ends of a piece of one cell and where its density takes one of the values, ascending.
std::vector<double> valueCrossings(const Cubic& cubic, Interval piece, const std::vector<double>& values) {
  std::vector<double> sections{piece.t_min, piece.t_max};
  // Turning points: c1 + 2 c2 s + 3 c3 s^2 = 0 without cancellation.
  const double q2 = 3 * cubic.c[3].w, q1 = 2 * cubic.c[2].w, q0 = cubic.c[1].w;
  const double root = std::sqrt(std::max(q1 * q1 - 4 * q2 * q0, 0.0));
  const double larger = -(q1 + std::copysign(root, q1)) / 2;
  for (double s : {larger / q2, q0 / larger}) {
    const double t = cubic.t_origin + s;
    if (t > piece.t_min && t < piece.t_max) sections.push_back(t);
  }
  sortUnique(sections);
  std::vector<double> crossings{piece.t_min, piece.t_max};
  for (std::size_t i = 1; i < sections.size(); ++i) {
    for (double value : values) addCrossing(cubic, value, sections[i - 1], sections[i], crossings);
  }
  sortUnique(crossings);
  return crossings;
}

// What a stretch of the ray absorbs and sends, seen from its near end.
struct Panel {
  double depth = 0;
  glm::dvec3 light{0};

  Panel before(const Panel& farther) const {
    return {.depth = depth + farther.depth, .light = light + std::exp(-depth) * farther.light};
  }
};

// Integrates where `materialAt(t)`, with extinction per unit distance, is smooth. `scale` is 1 / unit distance.
template <typename MaterialAt>
class SmoothIntegral {
 public:
  SmoothIntegral(MaterialAt material_at, double scale) : material_at_(material_at), scale_(scale) {}

  Panel over(Interval piece) {
    const Panel whole = panel(piece);
    depth_tolerance_ = kPrecision * whole.depth;
    light_tolerance_ = kPrecision * -std::expm1(-whole.depth);
    return refined(piece, whole, 0, 0);
  }

 private:
  Panel panel(Interval piece) {
    ++panels_;
    const double length = (piece.t_max - piece.t_min) * scale_;
    std::array<Material, kGaussNodes> materials{};
    Panel result;
    for (std::size_t i = 0; i < kGaussNodes; ++i) {
      materials[i] = material_at_(piece.t_min + gaussRule()[i].x * (piece.t_max - piece.t_min));
      result.depth += length * gaussRule()[i].weight * materials[i].sigma;
    }
    for (std::size_t i = 0; i < kGaussNodes; ++i) {
      double depth = 0;
      for (std::size_t j = 0; j < kGaussNodes; ++j) depth += length * gaussPrimitive()[i][j] * materials[j].sigma;
      result.light += length * gaussRule()[i].weight * materials[i].sigma * std::exp(-depth) * materials[i].color;
    }
    return result;
  }

  // `before` is the depth from the start of the smooth piece.
  Panel refined(Interval piece, const Panel& whole, double before, int halvings) {
    const double middle = piece.t_min + (piece.t_max - piece.t_min) / 2;
    const Interval near{.t_min = piece.t_min, .t_max = middle}, far{.t_min = middle, .t_max = piece.t_max};
    const Panel first = panel(near), second = panel(far);
    Panel both = first.before(second);
    const glm::dvec3 light_error = glm::abs(both.light - whole.light);
    // In a deep panel all light comes from before the first node, and both rules agree in seeing none.
    const bool sees_light = both.depth <= kDeepest || before > kDark;
    const bool agree = sees_light && std::abs(both.depth - whole.depth) <= depth_tolerance_ &&
                       std::max({light_error.r, light_error.g, light_error.b}) <= light_tolerance_;
    if (agree || halvings == kMaxHalvings || panels_ > kMaxPanels) return both;
    const Panel refined_first = refined(near, first, before, halvings + 1);
    return refined_first.before(refined(far, second, before + refined_first.depth, halvings + 1));
  }

  MaterialAt material_at_;
  double scale_;
  double depth_tolerance_ = 0;
  double light_tolerance_ = 0;
  int panels_ = 0;
};

// One smooth stretch of one cell.
Panel smoothPanel(const Scene& scene, const CutRay& cut, const Classifier& classifier, const Cubic& cubic,
                  Interval piece) {
  const double middle_density = cubic.at((piece.t_min + piece.t_max) / 2).w;
  if (!classifier.isVisible(middle_density)) return {};
  const bool scalar = scene.volume.type != VoxelType::rgba8;
  const double middle = classifier.dataOf(middle_density);
  const TransferPiece transfer =
      scalar ? transferPieceAt(scene.view.channels[scene.volume.channel].transfer, middle, scene.view.transfer_shape)
             : TransferPiece{};
  const auto material_at = [&](double t) {
    Material material;
    if (scalar) {
      const TransferPoint point = transfer.at(classifier.dataOf(cubic.at(t).w));
      material = {.color = point.color, .sigma = extinctionOf(point.opacity)};
    } else {
      material = classifier.materialAt(cubic.at(t));
    }
    if (scene.view.lit) {
      material.color =
          shade(scene.volume, scene.view, cut.world, material.color, gradientAt(scene.volume, cut.ray.at(t), 0.5));
    }
    return material;
  };
  return SmoothIntegral(material_at, 1 / unitDistanceOf(scene.volume)).over(piece);
}

}  // namespace

Pixel renderPixelConverged(const DenseVolume& volume, const View& resolved, int x, int y, glm::dvec2 place) {
  BLOCKWALK_CHECK(resolved.mode == Mode::blend, ==, true);
  BLOCKWALK_CHECK(resolved.filter == Filter::linear, ==, true);
  const Scene scene{.volume = volume, .view = resolved};
  const CutRay cut = cutRay(volume, resolved, x, y, place);
  Pixel pixel{.edge_distance = cut.edge_distance, .face_distance = faceDistance(cut)};
  Panel seen;
  if (cut.interval.t_max > cut.interval.t_min) {
    const Classifier classifier(volume, resolved);
    const std::vector<double> kinks = classifier.kinks();
    const std::vector<double> cells = cellCrossings(cut, resolved.lit);
    for (std::size_t i = 1; i < cells.size(); ++i) {
      const double middle = (cells[i - 1] + cells[i]) / 2;
      const Cubic cubic = cubicAlong(cellAround(volume, cut.ray.at(middle)), cut.ray, middle);
      const std::vector<double> t = valueCrossings(cubic, {.t_min = cells[i - 1], .t_max = cells[i]}, kinks);
      for (std::size_t j = 1; j < t.size(); ++j) {
        seen = seen.before(smoothPanel(scene, cut, classifier, cubic, {.t_min = t[j - 1], .t_max = t[j]}));
      }
    }
  }
  pixel.color = overBackground(resolved, seen.light, std::exp(-seen.depth));
  return pixel;
}

Image renderImageConverged(const DenseVolume& volume, const View& resolved) {
  return renderEach(resolved, [&](int x, int y) { return renderPixelConverged(volume, resolved, x, y); });
}

}  // namespace blockwalk::reference
