#include "tools/run/force_and_depth.hpp"

#include "core/contact/tip_contact.hpp"
#include "core/units.hpp"

namespace merkel {

std::optional<ForceAndDepth> force_and_depth(const RunReport::OfProbe& probe,
                                             const TactileModel& model, std::size_t indenter) {
  constexpr std::uint32_t kBoth = ProbeSample::kDepth | ProbeSample::kForce;
  if ((probe.channels & kBoth) != kBoth) return std::nullopt;
  Indenter by_depth = model.parameters().indenters[indenter];
  by_depth.control = Indenter::Control::kDepth;
  const Press press =
      TipContact(by_depth, model.parameters().skin).press(probe.deepest_press.input);
  const ForceAndDepth both{.depth_mm = probe.deepest_press.input.depth_mm,
                           .force_N = units::N_from_mN(probe.deepest_press.input.force_mN),
                           .model_force_N = units::N_from_mN(press.contact.force_mN)};
  if (both.force_N <= 0.0 || both.model_force_N <= 0.0) return std::nullopt;
  return both;
}

}  // namespace merkel
