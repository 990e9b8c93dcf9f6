#include "tools/scene/contact_sentence.hpp"

#include <string>

#include "core/contact/contact_validity.hpp"
#include "core/contact/pressed_tip.hpp"
#include "core/contact/sliding_contact.hpp"
#include "core/printed.hpp"
#include "core/units.hpp"

namespace merkel {

namespace {

const char* stiffening_note(const SkinParameters& skin) {
  if (!skin.stiffens()) return "";
  return std::isfinite(skin.stiffening_kPa) ? "; the skin stiffens with the pressure"
                                            : "; the skin stiffens with depth";
}

double ms_of(int ticks, const TactileModel& model) {
  return ticks * units::ms_from(model.parameters().tick);
}

std::string surface_sentence(const SlidingContact& sliding, const TactileModel& model) {
  const SlidingPlan& plan = sliding.plan();
  const SlidingContact::Report& report = sliding.report();
  std::string sentence = printed(
      "contact of the surface solved at %.4g Hz on %zu x %zu pixels of %.3f mm, and linear in "
      "between; it lags the probe by %.4g ms; linear elasticity without friction%s",
      1e3 / ms_of(plan.ticks, model), plan.contact.columns, plan.contact.rows,
      plan.contact.pixel_mm, ms_of(plan.latency(), model),
      stiffening_note(model.parameters().skin));
  if (report.solutions == 0) return sentence;
  const auto solutions = static_cast<double>(report.solutions);
  sentence += printed(
      "; gap in contact within %.2g %% of the depth on average, and worse than 1 %% in "
      "%.2g %% of the solutions",
      100.0 * report.sum_of_errors / solutions,
      100.0 * static_cast<double>(report.poor) / solutions);
  if (report.farthest_mm > 0.0) {
    sentence += printed(
        "; moved by up to %.2g mm between two solutions, so that energy densities are off by "
        "up to about %.2g %% of the largest",
        report.farthest_mm, 100.0 * sliding.movement_error());
  }
  return sentence;
}

}  // namespace

std::string contact_sentence(const ContactState& contact, const Indenter& indenter,
                             const SkinParameters& skin, bool by_tables) {
  if (const TaxelArray* const taxels = indenter.taxels()) {
    return "the pressures of " + std::to_string(taxels->size()) + " taxels, as measured, on " +
           (skin.layers.empty() ? "a half-space" : "layered skin") +
           "; linear elasticity without friction, no contact law";
  }
  if (!indenter.closed_form(skin)) {
    const PressedTip tip = pressed_tip(indenter, skin);
    const PixelGrid grid = contact_pixels(tip, tip.deepest_mm, skin.receptor_depth_mm).grid;
    const std::string depths = tip.proportional ? "proportional to the depth"
                                                : printed("at depths to %.2g mm", tip.deepest_mm);
    const std::string sentence = printed(
        "contact of the tip \"%s\" solved on %zu x %zu pixels of %.3f mm, %s; linear "
        "elasticity without friction, valid while the depth is small beside the tip's "
        "smallest part%s",
        std::string(indenter.tip_name()).c_str(), static_cast<std::size_t>(grid.columns),
        static_cast<std::size_t>(grid.rows), grid.pixel_mm, depths.c_str(), stiffening_note(skin));
    if (!by_tables || tip.proportional || contact.depth_mm <= tip.deepest_mm) return sentence;
    return sentence +
           "; this press is deeper: its force and stresses are extrapolated, "
           "which is right only once the whole tip touches";
  }
  return validity_of(contact, skin, indenter.sphere()->radius_mm).sentence();
}

std::string contact_sentence(const Press& press, const TactileModel& model, std::size_t probe) {
  if (model.sliding(probe) != nullptr) return surface_sentence(*model.sliding(probe), model);
  return contact_sentence(press.contact, model.parameters().indenters[probe],
                          model.parameters().skin, true);
}

}  // namespace merkel
