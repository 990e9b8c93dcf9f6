#include "drivers/probes/limited_probe.hpp"

#include <cmath>

#include "core/printed.hpp"
#include "core/units.hpp"

namespace merkel {

std::string press_excess(const ProbeSample& sample, const PressLimits& limits,
                         const std::string& name) {
  const double force_N = units::N_from_mN(sample.force_mN);
  const bool force = sample.has(ProbeSample::kForce) && std::fabs(force_N) > limits.force_N;
  const bool depth = sample.has(ProbeSample::kDepth) && sample.depth_mm > limits.depth_mm;
  if (!force && !depth) return {};
  return name +
         printed(
             " reports a press of %.4g %s, beyond the limit of %.4g, so the reading is refused: "
             "check the unit, or increase [probe] %s",
             force ? force_N : sample.depth_mm, force ? "N" : "mm",
             force ? limits.force_N : limits.depth_mm, force ? "max_force_N" : "max_depth_mm");
}

namespace {

/// The name of a probe, with the time of a recording's sample. That of a device's is on the host's
/// clock, which means nothing to the user.
std::string name_at(const ProbeInfo& probe, std::chrono::nanoseconds time) {
  return probe.name + (probe.replayed ? printed(" at %.3f s", units::s_from(time)) : "");
}

}  // namespace

Expected<std::size_t, ProbeError> LimitedProbe::read(Readings& readings,
                                                     std::chrono::milliseconds patience) {
  if (!error_message_.empty()) return Unexpected<ProbeError>(ProbeError::kBadData);
  if (auto count = ForwardingProbe::read(readings, patience); !count) return count;
  readings.drop_if([&](std::size_t i) {
    bool measured = false;
    for (std::size_t output = 0; output < limits_.size() && error_message_.empty(); ++output) {
      const auto sample = readings.sample(i, output);
      if (!sample) continue;
      std::string why =
          press_excess(*sample, limits_[output], name_at(outputs()[output], sample->time));
      if (why.empty()) {
        measured = true;
      } else if (info().replayed) {
        error_message_ = std::move(why);
      } else {
        readings.columns().of(output).put_nothing(readings.row(i));
        if (!reported_[output]) add_notice(std::move(why));
        reported_[output] = true;
        const std::scoped_lock lock(mutex_);
        ++refused_;
      }
    }
    // A reading of a recording without values ends the press of its probes.
    return (!measured && !info().replayed) || !error_message_.empty();
  });
  if (!error_message_.empty() && readings.empty()) {
    return Unexpected<ProbeError>(ProbeError::kBadData);
  }
  return readings.size();
}

ProbeStatus LimitedProbe::status() const {
  ProbeStatus status = ForwardingProbe::status();
  const std::scoped_lock lock(mutex_);
  if (status.device) status.device->refused += refused_;
  return status;
}

}  // namespace merkel
