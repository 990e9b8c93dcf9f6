#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/contact/far_field.hpp"
#include "core/contact/kernel/grid_interpolation.hpp"
#include "core/contact/solver/rigid_contact.hpp"
#include "core/contact/surface_map.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/contact_input.hpp"

namespace merkel {

/// The contact of a surface that slides under a finger, solved while it slides.
///
/// The pixels are fixed to the surface, so that its features never fall between them; the finger's
/// curvature moves over them, which changes the gap smoothly. Every few ticks (SlidingPlan), a
/// solution starts from the pressure of the one before, runs a fixed number of iterations spread
/// over the ticks until the next one, and then computes the fields. Between two solutions, the
/// fields are interpolated linearly in the surface's frame. The contact therefore lags the probe by
/// exactly plan().latency() ticks; it is a function of the readings of the ticks alone.
/// Real-time: yes, after construction.
class SlidingContact {
 public:
  /// \param limit_kPa  of the energy density, for reach_mm(); 0: unlimited
  SlidingContact(const Indenter& surface, const SkinParameters& skin, std::chrono::nanoseconds tick,
                 double limit_kPa);

  void reset() noexcept MERKEL_REALTIME;
  /// The reading of a tick: starts it.
  void take(const ContactInput& input) noexcept MERKEL_REALTIME;
  /// This tick's part of the solution in progress. Changes nothing that the other functions read.
  void work() noexcept MERKEL_REALTIME;

  /// Repeats a reading until the contact has settled. Real-time: no.
  const Press& settle(const ContactInput& input) noexcept;

  /// The contact, at the finger's apex, as the probe was latency() ticks ago.
  [[nodiscard]] const Press& press() const noexcept { return press_; }
  /// The field at a point, from the apex.
  [[nodiscard]] SkinField at(double x_mm, double y_mm) const noexcept MERKEL_REALTIME;
  /// The energy density there, in skin at rest. Far away, from a table.
  [[nodiscard]] double energy_kPa(double x_mm, double y_mm) const noexcept MERKEL_REALTIME;
  /// Beyond this distance from the apex, the energy density is below the limit.
  [[nodiscard]] double reach_mm() const noexcept MERKEL_REALTIME;
  /// Changes with every tick in contact.
  [[nodiscard]] std::uint64_t revision() const noexcept { return ticks_; }

  /// What went on since reset.
  struct Report {
    std::uint64_t solutions = 0;    ///< in contact
    std::uint64_t poor = 0;         ///< with an error above kPoorError
    std::uint64_t cut_off = 0;      ///< that touched the border of the pixels
    std::uint64_t off_surface = 0;  ///< with the apex beyond the end of the surface
    double sum_of_errors = 0.0;     ///< of the gap, relative to the depth
    double farthest_mm = 0.0;       ///< that the surface moved between two solutions in contact

    static constexpr double kPoorError = 0.01;
  };
  [[nodiscard]] const Report& report() const noexcept { return report_; }
  /// About how far energy densities are off, relative to the largest, because the fields are linear
  /// between two solutions: a fiftieth of the square of the movement in depths of the receptors.
  [[nodiscard]] double movement_error() const noexcept {
    const double depths = report_.farthest_mm / skin_.receptor_depth_mm;
    return 0.02 * depths * depths;
  }
  [[nodiscard]] const SlidingPlan& plan() const noexcept { return plan_; }
  /// The last solution, on skin at rest, and the gap before its press.
  [[nodiscard]] const RigidContact& solver() const noexcept { return solver_; }
  [[nodiscard]] const HeightMap& gap() const noexcept { return gap_; }
  /// Centre of their first pixel, from the apex.
  [[nodiscard]] Position first_pixel() const noexcept {
    return {map_.x_mm(column_) - surface_x_mm_, map_.y_mm(row_) - surface_y_mm_};
  }

 private:
  /// The fields of a solution.
  struct Table {
    double depth_mm = 0.0;
    double force_mN = 0.0;      ///< on skin at rest
    double area_mm2 = 0.0;      ///< in contact
    std::ptrdiff_t column = 0;  ///< of the surface, at the first node
    std::ptrdiff_t row = 0;
    double load_x_mm = 0.0;  ///< of the force, on the surface
    double load_y_mm = 0.0;
    double rim_mm = 0.0;  ///< of the contact, from the load
    std::vector<GridNode> nodes;
  };
  enum class Stage { kIdle, kGap, kIterate, kFields };

  void begin(const ContactInput& input) noexcept;
  void work_part() noexcept;
  void find_gap() noexcept;
  void finish_iterations() noexcept;
  /// The force that would press skin at rest to this depth. \param area_mm2  in contact
  [[nodiscard]] double rest_force_mN(double depth_mm, double area_mm2) const noexcept;
  void compute_fields(std::size_t first) noexcept;
  void publish(int phase) noexcept;
  /// The nodes around a place on the surface. \return whether all tables have them
  [[nodiscard]] bool place(double x_mm, double y_mm, GridPatch& patch) const noexcept;

  SlidingPlan plan_;
  SurfaceMap map_;
  Position apex_;
  double limit_kPa_;
  SkinParameters skin_;
  SkinMaterial material_;
  bool by_force_;
  double plate_mN_;  ///< force of a plate at 1 mm, for a first guess of the depth
  FarField far_;
  FarEnergy far_energy_;
  RigidContact solver_;
  GridTransform transform_;
  std::vector<GridSpectrum> kernels_;
  GridSpectrum pressure_;
  std::vector<double> image_;
  std::vector<double> loads_;
  HeightMap gap_;
  Table older_, newer_, next_;
  std::vector<ContactInput> inputs_;  ///< of the last ticks
  ContactInput input_;                ///< of the solution in progress
  std::ptrdiff_t column_ = 0;         ///< of the surface, at the first pixel of the contact
  std::ptrdiff_t row_ = 0;
  Stage stage_ = Stage::kIdle;
  std::size_t field_ = 0;
  std::uint64_t ticks_ = 0;
  double weight_ = 0.0;        ///< of the newer table
  double surface_x_mm_ = 0.0;  ///< of the apex, now
  double surface_y_mm_ = 0.0;
  double load_mN_ = 0.0;  ///< on skin at rest, now
  double load_x_mm_ = 0.0;
  double load_y_mm_ = 0.0;
  Press press_;
  Report report_;
};

}  // namespace merkel
