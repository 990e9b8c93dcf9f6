#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/contact/solver/tip_heights.hpp"
#include "core/contact/taxel_array.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/parameters/position.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

// The tips of probes: one struct each, with the same members. A new tip is a struct here, its keys
// in tip_kinds.cpp, and an alternative of Tip.
//
//   kName          as a scene says it
//   fields()       its keys of [probe]
//   check()        rejects what its fields alone do not; not every tip has it
//   half_size()    half of its extent along x and y, before it is turned
//   height()       of its surface, before it is turned; infinite beyond its end
//   feature_mm()   its smallest part, which the pixels must resolve; not every tip has one
//
// Spheres have no size, and tactile arrays no surface. `edge_radius_mm` rounds the rims of flat
// ends, the ridge of a wedge and the apex of a cone.

/// A sphere, or a flat plate.
struct SphereTip {
  static constexpr std::string_view kName = "sphere";
  double radius_mm = 2.0;  ///< infinity is a flat plate, on curved skin only

  [[nodiscard]] static FieldTable fields();
  void check(const SkinParameters& skin, ParameterCheck& all) const;
  friend bool operator==(const SphereTip&, const SphereTip&) = default;
};

/// A row of rigid flat-ended bars that move together, as in the gratings of Phillips & Johnson
/// (1981). The bars lie side by side along x, have the same length along y, and end at the same
/// height.
struct BarTip {
  static constexpr std::string_view kName = "bars";
  static constexpr std::size_t kMaxBars = 40;
  std::vector<double> widths_mm{5.0, 5.0, 5.0};  ///< along x
  std::vector<double> gaps_mm{3.0, 5.0};         ///< between neighbours; one fewer than widths
  double length_mm = 20.0;                       ///< along y
  double edge_radius_mm = 0.0;

  /// Distance from the first bar's outer edge to the last bar's.
  [[nodiscard]] double total_width_mm() const noexcept;
  /// x of a bar's centre, relative to the middle of the row.
  [[nodiscard]] double centre_mm(std::size_t bar) const noexcept;

  [[nodiscard]] static FieldTable fields();
  void check(const SkinParameters& skin, ParameterCheck& all) const;
  [[nodiscard]] Position half_size() const noexcept {
    return {0.5 * total_width_mm(), 0.5 * length_mm};
  }
  [[nodiscard]] TipHeight height() const;
  [[nodiscard]] double feature_mm() const noexcept;
  friend bool operator==(const BarTip&, const BarTip&) = default;
};

/// A rigid pin with a flat round end, as in most recordings of single afferents.
struct PinTip {
  static constexpr std::string_view kName = "pin";
  double diameter_mm = 1.0;
  double edge_radius_mm = 0.0;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Position half_size() const noexcept {
    return {0.5 * diameter_mm, 0.5 * diameter_mm};
  }
  [[nodiscard]] TipHeight height() const { return pin_height(diameter_mm, edge_radius_mm); }
  [[nodiscard]] double feature_mm() const noexcept { return diameter_mm; }
  friend bool operator==(const PinTip&, const PinTip&) = default;
};

/// A flat-ended bar.
struct EdgeTip {
  static constexpr std::string_view kName = "edge";
  double width_mm = 0.5;   ///< along x
  double length_mm = 5.0;  ///< along y
  double edge_radius_mm = 0.0;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Position half_size() const noexcept { return {0.5 * width_mm, 0.5 * length_mm}; }
  [[nodiscard]] TipHeight height() const {
    return rectangles_height({{0.0, 0.0, width_mm, length_mm}}, edge_radius_mm);
  }
  [[nodiscard]] double feature_mm() const noexcept { return std::min(width_mm, length_mm); }
  friend bool operator==(const EdgeTip&, const EdgeTip&) = default;
};

/// A ridge along y.
struct WedgeTip {
  static constexpr std::string_view kName = "wedge";
  double width_mm = 0.5;  ///< of its base, along x
  double length_mm = 5.0;
  double angle_deg = 90.0;  ///< between its faces
  double edge_radius_mm = 0.0;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Position half_size() const noexcept { return {0.5 * width_mm, 0.5 * length_mm}; }
  [[nodiscard]] TipHeight height() const {
    return wedge_height(width_mm, length_mm, angle_deg, edge_radius_mm);
  }
  friend bool operator==(const WedgeTip&, const WedgeTip&) = default;
};

struct ConeTip {
  static constexpr std::string_view kName = "cone";
  double diameter_mm = 1.0;  ///< of its base
  double angle_deg = 90.0;   ///< between opposite flanks
  double edge_radius_mm = 0.0;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Position half_size() const noexcept {
    return {0.5 * diameter_mm, 0.5 * diameter_mm};
  }
  [[nodiscard]] TipHeight height() const {
    return cone_height(diameter_mm, angle_deg, edge_radius_mm);
  }
  friend bool operator==(const ConeTip&, const ConeTip&) = default;
};

/// A cylinder that lies along y.
struct CylinderTip {
  static constexpr std::string_view kName = "cylinder";
  double radius_mm = 2.0;
  double length_mm = 5.0;

  [[nodiscard]] static FieldTable fields();
  void check(const SkinParameters& skin, ParameterCheck& all) const;
  [[nodiscard]] Position half_size() const noexcept { return {radius_mm, 0.5 * length_mm}; }
  [[nodiscard]] TipHeight height() const { return cylinder_height(radius_mm, length_mm); }
  friend bool operator==(const CylinderTip&, const CylinderTip&) = default;
};

/// Flat round ends side by side, as in Braille.
struct DotsTip {
  static constexpr std::string_view kName = "dots";
  static constexpr std::size_t kMaxDots = 200;
  std::vector<Position> centres;
  double diameter_mm = 1.0;
  double edge_radius_mm = 0.0;

  [[nodiscard]] static FieldTable fields();
  void check(const SkinParameters& skin, ParameterCheck& all) const;
  [[nodiscard]] Position half_size() const noexcept;
  [[nodiscard]] TipHeight height() const {
    return dots_height(centres, diameter_mm, edge_radius_mm);
  }
  [[nodiscard]] double feature_mm() const noexcept { return diameter_mm; }
  friend bool operator==(const DotsTip&, const DotsTip&) = default;
};

/// A measured shape.
struct ShapeTip {
  static constexpr std::string_view kName = "shape";
  std::string file;                      ///< with the heights
  double pixel_mm = 0.0;                 ///< of the file; 0: not set
  std::shared_ptr<const HeightMap> map;  ///< read from the file

  [[nodiscard]] static FieldTable fields();
  void check(const SkinParameters& skin, ParameterCheck& all) const;
  [[nodiscard]] Position half_size() const noexcept;
  [[nodiscard]] TipHeight height() const { return map_height(*map); }
  friend bool operator==(const ShapeTip&, const ShapeTip&) = default;
};

using Tip = std::variant<SphereTip, BarTip, PinTip, EdgeTip, WedgeTip, ConeTip, CylinderTip,
                         DotsTip, ShapeTip, TaxelArray>;

/// Names of the tips in a scene, in the order of Tip.
inline constexpr auto kTipNames = []<std::size_t... I>(std::index_sequence<I...>) {
  return std::array{std::variant_alternative_t<I, Tip>::kName...};
}
(std::make_index_sequence<std::variant_size_v<Tip>>());

/// The default tip of a kind, an index into kTipNames. Real-time: no.
[[nodiscard]] Tip default_tip(std::size_t kind);

}  // namespace merkel
