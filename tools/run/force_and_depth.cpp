#include "tools/run/force_and_depth.hpp"

#include "core/contact/sliding_contact.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/units.hpp"

namespace merkel {

std::optional<ForceAndDepth> force_and_depth(const RunReport::ProbeReport& probe,
                                             const TactileModel& model, std::size_t indenter) {
  constexpr std::uint32_t kBoth = ProbeSample::kDepth | ProbeSample::kForce;
  if ((probe.channels & kBoth) != kBoth) return std::nullopt;
  Indenter by_depth = model.parameters().indenters[indenter];
  by_depth.control = Indenter::Control::kDepth;
  const SkinParameters& skin = model.parameters().skin;
  const ContactInput& input = probe.deepest_press.input;
  const Press press =
      by_depth.surface.slides
          ? SlidingContact(by_depth, skin, model.parameters().tick, 0.0).settle(input)
          : TipContact(by_depth, skin).press(input);
  const ForceAndDepth both{.depth_mm = input.depth_mm,
                           .force_N = units::N_from_mN(input.force_mN),
                           .model_force_N = units::N_from_mN(press.contact.force_mN)};
  if (both.force_N <= 0.0 || both.model_force_N <= 0.0) return std::nullopt;
  return both;
}

}  // namespace merkel
