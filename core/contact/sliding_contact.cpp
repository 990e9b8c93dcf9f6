#include "core/contact/sliding_contact.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/contact/solver/rim_pixels.hpp"
#include "core/math/cubic_interpolation.hpp"
#include "core/skin/strain_energy_density.hpp"

namespace merkel {
namespace {

constexpr RigidContact::Accuracy kSlidingAccuracy{.tolerance = 5e-4, .most_iterations = 1 << 20};
constexpr int kSettlingSolutions = 20;  ///< of a cold start, at most

HeightMap empty_map(const PixelGrid& grid) {
  return {.grid = grid,
          .height_mm = std::vector<double>(grid.pixels()),
          .coverage = std::vector<double>(grid.pixels(), 1.0),
          .rims = std::vector<HeightMap::Rim>(grid.pixels())};
}

}  // namespace

SlidingContact::SlidingContact(const Indenter& surface, const SkinParameters& skin,
                               std::chrono::nanoseconds tick, double limit_kPa)
    : plan_(*SlidingPlan::of(surface, skin, tick)),
      map_(surface, skin, plan_.contact.pixel_mm),
      apex_(*skin.apex),
      limit_kPa_(limit_kPa),
      skin_(skin),
      material_(skin),
      by_force_(surface.control == Indenter::Control::kForce),
      plate_mN_(4.0 / 3.0 * LayeredMedium(skin).reduced_modulus_kPa() *
                std::sqrt(std::sqrt(skin.finger_along_mm() * skin.radius_mm))),
      far_(LayeredMedium(skin), skin),
      far_energy_(far_, skin),
      solver_(LayeredMedium(skin), empty_map(plan_.contact)),
      transform_(padded_pixels(plan_.contact.columns + plan_.window.columns - 1),
                 padded_pixels(plan_.contact.rows + plan_.window.rows - 1)),
      pressure_(transform_.make_spectrum()),
      image_(plan_.window.pixels()),
      loads_(plan_.contact.pixels()),
      gap_(empty_map(plan_.contact)),
      inputs_(static_cast<std::size_t>(plan_.latency() + 1)) {
  PixelKernels kernels(LayeredMedium(skin), skin.receptor_depth_mm, plan_.contact, plan_.window);
  for (std::size_t f = 0; f < kPixelFields; ++f) {
    kernels_.push_back(kernels.kernel(static_cast<PixelField>(f)));
  }
  for (Table* const table : {&older_, &newer_, &next_}) {
    table->nodes.resize(plan_.window.pixels());
  }
}

void SlidingContact::reset() noexcept {
  solver_.reset();
  for (Table* const table : {&older_, &newer_, &next_})
    table->depth_mm = table->force_mN = table->area_mm2 = 0.0;
  std::fill(inputs_.begin(), inputs_.end(), ContactInput{});
  stage_ = Stage::kIdle;
  ticks_ = 0;
  press_ = {};
  report_ = {};
  input_ = {};
}

void SlidingContact::take(const ContactInput& input) noexcept {
  const auto phase = static_cast<int>(ticks_ % static_cast<std::uint64_t>(plan_.ticks));
  inputs_[ticks_ % inputs_.size()] = input;
  ++ticks_;
  if (phase == 0) {
    // Moves no memory: the tables change places.
    std::swap(older_, newer_);
    std::swap(newer_, next_);
    begin(input);
  }
  publish(phase);
}

const Press& SlidingContact::settle(const ContactInput& input) noexcept {
  for (int tick = 0; tick < kSettlingSolutions * plan_.ticks; ++tick) {
    take(input);
    work();
  }
  return press_;
}

void SlidingContact::begin(const ContactInput& input) noexcept {
  const auto presses = [this](const ContactInput& reading) {
    return by_force_ ? reading.force_mN > 0.0 : reading.depth_mm > 0.0;
  };
  const bool pressed = presses(input);
  if (pressed && presses(input_)) {
    report_.farthest_mm = std::max(report_.farthest_mm,
                                   std::hypot(input.x_mm - input_.x_mm, input.y_mm - input_.y_mm));
  }
  input_ = input;
  next_.depth_mm = next_.force_mN = next_.area_mm2 = 0.0;
  stage_ = pressed ? Stage::kGap : Stage::kIdle;
  if (!pressed) solver_.reset();
}

void SlidingContact::publish(int phase) noexcept {
  weight_ = static_cast<double>(phase) / static_cast<double>(plan_.ticks);
  // The oldest reading in the ring is that of latency() ticks ago.
  const ContactInput& then = inputs_[ticks_ % inputs_.size()];
  surface_x_mm_ = apex_.x_mm - then.x_mm;
  surface_y_mm_ = apex_.y_mm - then.y_mm;
  const auto between = [&](double older, double newer) {
    return (1.0 - weight_) * older + weight_ * newer;
  };
  const double force_mN = between(older_.force_mN, newer_.force_mN);
  press_ = {};
  load_mN_ = force_mN;
  if (!(force_mN > 0.0)) return;
  const auto of_loads = [&](double older, double newer) {
    return between(older_.force_mN * older, newer_.force_mN * newer) / force_mN;
  };
  load_x_mm_ = of_loads(older_.load_x_mm, newer_.load_x_mm);
  load_y_mm_ = of_loads(older_.load_y_mm, newer_.load_y_mm);
  const double depth_mm = std::max(1e-9, between(older_.depth_mm, newer_.depth_mm));
  const double area_mm2 = between(older_.area_mm2, newer_.area_mm2);
  const double stiffening = skin_.stiffening_at(depth_mm, force_mN / area_mm2);
  press_ = {.contact = {.depth_mm = depth_mm,
                        .force_mN = stiffening * force_mN,
                        .stiffening = stiffening},
            .x_mm = apex_.x_mm,
            .y_mm = apex_.y_mm};
}

void SlidingContact::work() noexcept {
  for (int part = 0; part < plan_.parts_per_tick && stage_ != Stage::kIdle; ++part) work_part();
}

void SlidingContact::work_part() noexcept {
  switch (stage_) {
    case Stage::kIdle:
      return;
    case Stage::kGap:
      find_gap();
      stage_ = Stage::kIterate;
      return;
    case Stage::kIterate: {
      if (by_force_ && solver_.solution().iterations > 0) {
        const RigidContact::Solution found = solver_.solution();
        solver_.aim(rest_force_mN(found.depth_mm, found.area_mm2));
      }
      const bool found = solver_.iterate(kSlidingAccuracy);
      if (found || solver_.solution().iterations >= SlidingPlan::kIterations) finish_iterations();
      return;
    }
    case Stage::kFields:
      compute_fields(field_);
      field_ += 2;
      if (field_ >= kPixelFields) stage_ = Stage::kIdle;
      return;
  }
}

double SlidingContact::rest_force_mN(double depth_mm, double area_mm2) const noexcept {
  const double pressure_kPa = area_mm2 > 0.0 ? input_.force_mN / area_mm2 : 0.0;
  return input_.force_mN / skin_.stiffening_under(depth_mm, pressure_kPa);
}

void SlidingContact::find_gap() noexcept {
  const double apex_x = apex_.x_mm - input_.x_mm;
  const double apex_y = apex_.y_mm - input_.y_mm;
  const auto half = [](std::size_t pixels) { return static_cast<std::ptrdiff_t>(pixels / 2); };
  const std::ptrdiff_t column = map_.column_at(apex_x) - half(gap_.grid.columns);
  const std::ptrdiff_t row = map_.row_at(apex_y) - half(gap_.grid.rows);
  solver_.move_pressure(column - column_, row - row_);
  column_ = column;
  row_ = row;
  map_.copy(column, row, gap_);
  for (std::size_t j = 0; j < gap_.grid.rows; ++j) {
    const double y = map_.y_mm(row + static_cast<std::ptrdiff_t>(j)) - apex_y;
    const double across = 0.5 * (1.0 / skin_.radius_mm) * y * y;
    for (std::size_t i = 0; i < gap_.grid.columns; ++i) {
      const double x = map_.x_mm(column + static_cast<std::ptrdiff_t>(i)) - apex_x;
      gap_.height_mm[j * gap_.grid.columns + i] +=
          0.5 * (1.0 / skin_.finger_along_mm()) * x * x + across;
    }
  }
  solver_.set_gap(gap_);
  if (by_force_) {
    const double guess_mm = std::cbrt(input_.force_mN / plate_mN_ * (input_.force_mN / plate_mN_));
    const double lowest = *std::min_element(gap_.height_mm.begin(), gap_.height_mm.end());
    solver_.begin_with_force(rest_force_mN(newer_.depth_mm, newer_.area_mm2),
                             lowest + std::max(guess_mm, 1e-3));
  } else {
    solver_.begin(input_.depth_mm);
  }
  next_.column = column - half(plan_.window.columns - gap_.grid.columns);
  next_.row = row - half(plan_.window.rows - gap_.grid.rows);
  if (!map_.contains(apex_x, apex_y)) ++report_.off_surface;
}

void SlidingContact::finish_iterations() noexcept {
  const RigidContact::Solution solution = solver_.solution();
  stage_ = Stage::kIdle;
  if (!(solution.force_mN > 0.0)) return;
  stage_ = Stage::kFields;
  field_ = 0;
  next_.depth_mm = solution.depth_mm;
  next_.force_mN = solution.force_mN;
  next_.area_mm2 = solution.area_mm2;
  ++report_.solutions;
  if (std::isfinite(solution.error)) report_.sum_of_errors += solution.error;
  if (!(solution.error <= Report::kPoorError)) ++report_.poor;
  const std::span<const double> pressure = solver_.pressure_kPa();
  const PixelGrid& grid = gap_.grid;
  double sum = 0.0, sum_x = 0.0, sum_y = 0.0;
  bool border = false;
  for (std::size_t j = 0; j < grid.rows; ++j) {
    for (std::size_t i = 0; i < grid.columns; ++i) {
      const double p = pressure[j * grid.columns + i];
      if (!(p > 0.0)) continue;
      border = border || i == 0 || j == 0 || i + 1 == grid.columns || j + 1 == grid.rows;
      sum += p;
      sum_x += p * grid.x_mm(i);
      sum_y += p * grid.y_mm(j);
    }
  }
  if (border) ++report_.cut_off;
  const Position load{sum_x / sum, sum_y / sum};
  double rim2 = 0.0;
  for (std::size_t j = 0; j < grid.rows; ++j) {
    for (std::size_t i = 0; i < grid.columns; ++i) {
      if (!(pressure[j * grid.columns + i] > 0.0)) continue;
      const double x = grid.x_mm(i) - load.x_mm;
      const double y = grid.y_mm(j) - load.y_mm;
      rim2 = std::max(rim2, x * x + y * y);
    }
  }
  next_.load_x_mm = map_.x_mm(column_) - grid.x_mm(0) + load.x_mm;
  next_.load_y_mm = map_.y_mm(row_) - grid.y_mm(0) + load.y_mm;
  next_.rim_mm = std::sqrt(rim2) + grid.pixel_mm;
  place_loads(gap_, pressure, loads_);
  transform_.forward(loads_, grid.columns, grid.rows, pressure_);
}

void SlidingContact::compute_fields(std::size_t first) noexcept {
  for (std::size_t f = first; f < std::min(first + 2, kPixelFields); ++f) {
    transform_.convolve(pressure_, kernels_[f], plan_.window.columns, plan_.window.rows, image_);
    for (std::size_t i = 0; i < image_.size(); ++i) {
      next_.nodes[i].values[f] = static_cast<float>(image_[i]);
    }
  }
}

bool SlidingContact::place(double x_mm, double y_mm, GridPatch& patch) const noexcept {
  // Both tables have their nodes at the same places of the surface, from a different first one on.
  const PixelGrid& grid = plan_.window;
  const double column = map_.place_x(x_mm);
  const double row = map_.place_y(y_mm);
  const double column_below = std::floor(column);
  const double row_below = std::floor(row);
  const auto i = static_cast<std::ptrdiff_t>(column_below);
  const auto j = static_cast<std::ptrdiff_t>(row_below);
  const auto columns = static_cast<std::ptrdiff_t>(grid.columns);
  const auto rows = static_cast<std::ptrdiff_t>(grid.rows);
  std::size_t used = 0;
  const auto add = [&](const Table& table, double weight) {
    if (!(weight > 0.0 && table.force_mN > 0.0)) return true;
    const std::ptrdiff_t left = i - 1 - table.column;
    const std::ptrdiff_t below = j - 1 - table.row;
    if (left < 0 || below < 0 || left + 4 > columns || below + 4 > rows) return false;
    patch.corner[used] = table.nodes.data() + below * columns + left;
    patch.weight[used++] = weight;
    return true;
  };
  if (!add(older_, 1.0 - weight_) || !add(newer_, weight_)) return false;
  patch.columns = grid.columns;
  patch.along_x = cubic_weights(column - column_below);
  patch.along_y = cubic_weights(row - row_below);
  return true;
}

SkinField SlidingContact::at(double x_mm, double y_mm) const noexcept {
  const double x = surface_x_mm_ + x_mm;
  const double y = surface_y_mm_ + y_mm;
  GridPatch patch;
  if (place(x, y, patch)) {
    const GridNode total = interpolate(patch);
    return {.stress = total.stress(), .displacement = static_cast<double>(total.values[6])};
  }
  return far_.at(load_mN_, x - load_x_mm_, y - load_y_mm_);
}

double SlidingContact::energy_kPa(double x_mm, double y_mm) const noexcept {
  const double x = surface_x_mm_ + x_mm;
  const double y = surface_y_mm_ + y_mm;
  GridPatch patch;
  if (place(x, y, patch))
    return energy_density_kPa(interpolate(patch).stress(), material_, skin_.energy_density);
  const double dx = x - load_x_mm_;
  const double dy = y - load_y_mm_;
  return load_mN_ * load_mN_ * far_energy_.at(std::sqrt(dx * dx + dy * dy));
}

double SlidingContact::reach_mm() const noexcept {
  if (!(limit_kPa_ > 0.0)) return std::numeric_limits<double>::infinity();
  double reach = 0.0;
  for (const Table* const table : {&older_, &newer_}) {
    if (!(table->force_mN > 0.0)) continue;
    const double per_mN2 =
        limit_kPa_ / (table->force_mN * table->force_mN * press_.contact.stiffening);
    const double off =
        std::hypot(table->load_x_mm - surface_x_mm_, table->load_y_mm - surface_y_mm_);
    reach = std::max(reach, off + table->rim_mm + far_energy_.reach_mm(per_mN2));
  }
  return reach;
}

}  // namespace merkel
